"""`w2b description`: publishes the robot description and the robot's frames (tf)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from w2b_core.command_process import command
from w2b_ros import node_help
from w2b_ros.ros_process import run

if TYPE_CHECKING:
    from w2b_description.description_node import DescriptionNode
    from w2b_ros.parameters import Parameter

ABOUT = """
What the robot is and where its parts are: `robot_description` (std_msgs/String, latched), `/tf`
(odom -> base_link from the odometry, base_link -> base_footprint, the joints) and `/tf_static`.
The body is the one that says its name on `body_status`, unless the parameter `body` names one.
"""


def make() -> DescriptionNode:
    """Build the node."""
    from w2b_description.description_node import DescriptionNode
    return DescriptionNode()


@command
def main() -> int:
    """Run the node until a signal; return the exit code."""
    code = node_help.answer('w2b_description', 'description', ABOUT, _parameters)
    return run(make) if code is None else code


def _parameters() -> Sequence[Parameter]:
    from w2b_description.description_node import PARAMETERS
    return PARAMETERS
