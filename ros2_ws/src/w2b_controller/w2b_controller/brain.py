"""`ros2 run w2b_controller brain`: hears words on /command and walks the body (see brain_node)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from w2b_controller.ros_process import run

if TYPE_CHECKING:
    from w2b_controller.brain_node import BrainNode


def make() -> BrainNode:
    """Build the node; it starts itself unless its parameter `autostart` is false."""
    from w2b_controller.brain_node import BrainNode
    node = BrainNode()
    if node.get_parameter('autostart').value:
        node.autostart()
    return node


def main() -> int:
    """Run the brain until a signal; return the exit code."""
    return run(make)
