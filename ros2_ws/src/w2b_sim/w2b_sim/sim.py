"""`ros2 run w2b_sim sim`: a simulated body that sends sensor frames and takes joint targets."""

from __future__ import annotations

from typing import TYPE_CHECKING

from w2b_controller.ros_process import run

if TYPE_CHECKING:
    from w2b_sim.sim_node import SimNode


def make() -> SimNode:
    """Build the node."""
    from w2b_sim.sim_node import SimNode
    return SimNode()


def main() -> int:
    """Run the simulation until a signal; return the exit code."""
    return run(make)
