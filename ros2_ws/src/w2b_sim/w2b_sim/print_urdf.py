"""`ros2 run w2b_sim urdf BODY`: the robot description, for viewers and other simulators."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from w2b_core import bodies
from w2b_core.bodies.urdf import to_urdf

ABOUT = """\
Print a body's URDF, which robot_state_publisher, RViz and other simulators read:

  ros2 run w2b_sim urdf quadruped > quadruped.urdf
  ros2 run robot_state_publisher robot_state_publisher quadruped.urdf

The joints' names are those of `joint_states`.
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return the exit code."""
    parser = argparse.ArgumentParser(prog='urdf', description=ABOUT,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('body', choices=bodies.names(), metavar='BODY',
                        help='one of ' + ', '.join(bodies.names()))
    print(to_urdf(bodies.get(parser.parse_args(arguments).body)))
    return 0
