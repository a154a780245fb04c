"""`w2b brain`: hears words on /command and walks the body (see brain_node)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from w2b_core.command_process import command
from w2b_ros import node_help
from w2b_ros.ros_process import run

if TYPE_CHECKING:
    from w2b_controller.brain_node import BrainNode
    from w2b_ros.parameters import Parameter

ABOUT = """
The brain: hears words on `command` (std_msgs/String), primes its network with their vectors, and
answers every sensor frame (`joint_states`, `contacts`) with joint targets (`joint_trajectory`).
A lifecycle node; it stands until the first word. Speak to it with `w2b say`.
"""


def make() -> BrainNode:
    """Build the node; it starts itself unless its parameter `autostart` is false."""
    from w2b_controller.brain_node import BrainNode
    node = BrainNode()
    if node.get_parameter('autostart').value:
        node.autostart()
    return node


@command
def main() -> int:
    """Run the brain until a signal; return the exit code."""
    code = node_help.answer('w2b_controller', 'brain', ABOUT, _parameters)
    return run(make) if code is None else code


def _parameters() -> Sequence[Parameter]:
    from w2b_controller.brain_node import PARAMETERS
    return PARAMETERS
