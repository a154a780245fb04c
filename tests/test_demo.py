"""The demo's client: it counts the frames of this start and no others."""

import pytest

pytest.importorskip('rclpy', reason='no ROS 2 here (make setup installs it)')

from nav_msgs.msg import Odometry

from demo.robot import Motion, Robot
from w2b_controller.ros_messages import to_stamp


def test_frames_of_the_walk_before_are_not_counted():
    """They may arrive after the robot was put back: then *stop* would end where *forward* began."""
    robot = object.__new__(Robot)
    robot._motion, robot._frames, robot._first_ns = Motion(), 3, 1_000_000_000
    for stamp_ns, x in ((950_000_000, 0.9), (1_000_000_000, 0.0), (1_050_000_000, 0.1)):
        frame = Odometry()
        frame.header.stamp = to_stamp(stamp_ns)
        frame.pose.pose.position.x = x
        robot._on_odometry(frame)
    assert robot._motion.displacement_m[0] == pytest.approx(0.1)
    assert sorted(robot._motion.poses) == [1_000_000_000, 1_050_000_000]
