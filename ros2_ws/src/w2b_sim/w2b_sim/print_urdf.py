"""`w2b urdf BODY`: the robot description, for viewers and other simulators."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from w2b_core import bodies
from w2b_core.bodies.urdf import describe
from w2b_core.command_process import command
from w2b_core.registry import use_plugin

ABOUT = """\
Print a body's URDF, which robot_state_publisher, RViz and other simulators read:

  w2b urdf quadruped > quadruped.urdf
  ros2 run robot_state_publisher robot_state_publisher quadruped.urdf

The joints' names are those of `joint_states`, its links the frames of `odom` and `imu/data`. Of
several robots each has its own frames: `-p frame_prefix:=dog1/`, in both nodes.
"""


@command
def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return the exit code."""
    parser = argparse.ArgumentParser(prog='urdf', description=ABOUT,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('body', metavar='BODY', help='one of ' + ', '.join(bodies.names())
                        + ', or a file such as my_robot.yaml')
    parser.add_argument('--plugin', action='append', default=[], metavar='FILE.py',
                        help='a file that registers bodies')
    options = parser.parse_args(arguments)
    try:
        for path in options.plugin:
            use_plugin(path)
        body = bodies.get(options.body)
    except ValueError as error:
        parser.error(str(error))
    print(describe(body))
    return 0
