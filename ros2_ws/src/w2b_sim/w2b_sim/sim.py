"""`w2b sim`: a simulated body that sends sensor frames and takes joint targets."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from w2b_core.command_process import command
from w2b_ros import node_help
from w2b_ros.ros_process import run

if TYPE_CHECKING:
    from w2b_ros.parameters import Parameter
    from w2b_sim.sim_node import SimNode

ABOUT = """
A simulated body in PyBullet (or, with `-p engine:=mujoco`, in MuJoCo): sends sensor frames
(`joint_states`, `contacts`, `imu/data`, `odom`, `/clock`) and takes joint targets
(`joint_trajectory`). Services: `~/reset` (std_srvs/Trigger) puts the body back to its start,
`~/pause` (std_srvs/SetBool) stops the clock.
"""


def make() -> SimNode:
    """Build the node."""
    from w2b_sim.sim_node import SimNode
    return SimNode()


@command
def main() -> int:
    """Run the simulation until a signal; return the exit code."""
    code = node_help.answer('w2b_sim', 'sim', ABOUT, _parameters)
    return run(make) if code is None else code


def _parameters() -> Sequence[Parameter]:
    from w2b_sim.sim_node import PARAMETERS
    return PARAMETERS
