"""The demo's client: it counts the frames of this start and no others."""

import pytest

pytest.importorskip('rclpy', reason='no ROS 2 here (make setup installs it)')

from nav_msgs.msg import Odometry

from demo.robot import Motion, Robot
from demo.ros_session import Domain
from w2b_ros.ros_messages import to_stamp


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


def test_a_domain_belongs_to_one_until_it_is_given_back(monkeypatch):
    # Numbers that ROS does not have: nobody else is in the way.
    monkeypatch.setattr('demo.ros_session.DOMAINS', range(900, 903))
    monkeypatch.setattr('demo.ros_session.PORTS_PER_DOMAIN', 1)
    taken = [Domain() for _ in range(3)]
    assert {domain.number for domain in taken} == {900, 901, 902}
    with pytest.raises(RuntimeError, match='in use'):
        Domain()
    taken[1].release()
    again = Domain()
    assert again.number == taken[1].number
    for domain in (taken[0], taken[2], again):
        domain.release()
