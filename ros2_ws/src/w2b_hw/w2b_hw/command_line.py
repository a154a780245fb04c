"""
The command line of this package's tools, without what is for ROS.

`w2b_ros.ros_process.own` does the same for nodes. It is not used here: `relax` must run
where neither ROS nor w2b_controller is installed.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import ParamSpec

P = ParamSpec('P')

try:
    from w2b_core.command_process import command
except ImportError:  # the last thing between a dead node and warm servos needs none of it
    def command(main: Callable[P, int | None]) -> Callable[P, int | None]:
        """Return `main` as it is."""
        return main

__all__ = ['command', 'own']


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
