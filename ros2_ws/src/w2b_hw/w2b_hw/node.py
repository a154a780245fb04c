"""`ros2 run w2b_hw hardware`: the robot's servos and IMU (see hardware_node)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from w2b_controller.ros_process import run

if TYPE_CHECKING:
    from w2b_hw.hardware_node import HardwareNode


def make() -> HardwareNode:
    """Build the node; it starts itself unless its parameter `autostart` is false."""
    from w2b_hw.hardware_node import HardwareNode
    node = HardwareNode()
    if node.get_parameter('autostart').value:
        node.autostart()
    return node


def main() -> int:
    """Run the node until a signal; the servos are off when it ends."""
    return run(make)


if __name__ == '__main__':
    raise SystemExit(main())
