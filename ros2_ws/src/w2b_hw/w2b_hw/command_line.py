"""The command line of this package's tools. No ROS is needed to leave out what is for ROS."""

from __future__ import annotations

import sys


def own() -> list[str]:
    """Return this process' arguments but those of ROS, which launch files add."""
    left, of_ros = [], False
    for argument in sys.argv[1:]:
        if of_ros:
            of_ros = argument != '--'
        elif argument == '--ros-args':
            of_ros = True
        else:
            left.append(argument)
    return left
