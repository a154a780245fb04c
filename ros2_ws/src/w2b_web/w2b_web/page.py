"""`w2b page`: the page that shows robots in a browser."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from w2b_core.command_process import command
from w2b_ros import node_help
from w2b_ros.ros_process import run

if TYPE_CHECKING:
    from w2b_ros.parameters import Parameter
    from w2b_web.page_node import PageNode

ABOUT = """
A page that shows the robots of this ROS domain in a browser of this machine: what they do, what
they understood, and a box for words. STOP (or Esc) turns servos off, and stops and pauses a
simulation. Other machines reach it over an SSH tunnel, or with TLS and a secret (docs/page.md).
"""


def make() -> PageNode:
    """Build the node; it starts itself unless its parameter `autostart` is false."""
    from w2b_web.page_node import PageNode
    node = PageNode()
    if node.get_parameter('autostart').value:
        node.autostart()
    return node


@command
def main() -> int:
    """Run the node until a signal; what a page moved stands when it ends."""
    code = node_help.answer('w2b_web', 'page', ABOUT, _parameters)
    return run(make) if code is None else code


def _parameters() -> Sequence[Parameter]:
    from w2b_web.page_node import PARAMETERS
    return PARAMETERS


if __name__ == '__main__':
    raise SystemExit(main())
