"""`w2b hardware`: the robot's servos and IMU (see hardware_node)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from w2b_core.command_process import command
from w2b_ros import node_help
from w2b_ros.ros_process import run

if TYPE_CHECKING:
    from w2b_hw.hardware_node import HardwareNode
    from w2b_ros.parameters import Parameter

ABOUT = """
The robot: twelve servos on a PCA9685 and an IMU. Takes joint targets (`joint_trajectory`), sends
sensor frames (`joint_states`, `imu/...`) every 50 ms. Nothing moves before `~/arm`
(std_srvs/Trigger); `~/disarm` parks, `~/emergency_stop` cuts all pulses.
With `-p transport:=emulated` it needs no hardware.
"""


def make() -> HardwareNode:
    """Build the node; it starts itself unless its parameter `autostart` is false."""
    from w2b_hw.hardware_node import HardwareNode
    node = HardwareNode()
    if node.get_parameter('autostart').value:
        node.autostart()
    return node


@command
def main() -> int:
    """Run the node until a signal; the servos are off when it ends."""
    code = node_help.answer('w2b_hw', 'hardware', ABOUT, _parameters)
    return run(make) if code is None else code


def _parameters() -> Sequence[Parameter]:
    from w2b_hw.hardware_node import PARAMETERS
    return PARAMETERS


if __name__ == '__main__':
    raise SystemExit(main())
