"""The simulation as a process: one frame is one stamp on all its topics."""

import os
import subprocess
import sys
import time

import pytest

RUN = 'from w2b_sim.sim import main; raise SystemExit(main())'
DEADLINE_S = 120
PERIOD_NS = 50_000_000


@pytest.fixture
def node(monkeypatch):
    """A node in a ROS domain of its own on this machine."""
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    monkeypatch.setenv('ROS_DOMAIN_ID', str(1 + os.getpid() % 101))
    import rclpy
    rclpy.init()
    node = rclpy.create_node('test_client')
    yield node
    node.destroy_node()
    rclpy.shutdown()


def test_the_first_frame_comes_with_one_stamp_on_all_topics(node):
    import rclpy
    from nav_msgs.msg import Odometry
    from sensor_msgs.msg import Imu, JointState

    from w2b_ros.ros_messages import FRAMES_OUT, stamp_ns
    seen = {}
    for kind, topic in ((JointState, 'joint_states'), (JointState, 'contacts'),
                        (Imu, 'imu/data'), (Odometry, 'odom')):
        node.create_subscription(kind, topic, lambda message, topic=topic: seen.update(
            {topic: message}), FRAMES_OUT)
    sim = subprocess.Popen([sys.executable, '-c', RUN, '--ros-args', '-p', 'frame_prefix:=dog1/',
                            '-p', 'body:=quadruped'])
    try:
        end_s = time.monotonic() + DEADLINE_S
        while len(seen) < 4 and time.monotonic() < end_s:
            rclpy.spin_once(node, timeout_sec=0.1)
    finally:
        sim.terminate()
        assert sim.wait(DEADLINE_S) == 0
    assert {stamp_ns(message.header.stamp) for message in seen.values()} == {PERIOD_NS}
    assert len(seen) == 4
    odometry = seen['odom']
    assert (odometry.header.frame_id, odometry.child_frame_id) == ('dog1/odom', 'dog1/base_link')
    assert odometry.pose.pose.position.z > 0.0
    assert all(odometry.pose.covariance[[0, 7, 14, 21, 28, 35]] > 0.0)
