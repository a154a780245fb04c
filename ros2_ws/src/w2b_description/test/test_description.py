"""The node as a process: the description of a body, and its frames where tf2_msgs is there."""

import os
import subprocess
import sys
import time
from importlib.util import find_spec
from xml.etree import ElementTree

import pytest

RUN = 'from w2b_description.description import main; raise SystemExit(main())'
DEADLINE_S = 120


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


def test_a_late_listener_gets_the_description_and_the_fixed_frames(node):
    import rclpy
    from std_msgs.msg import String

    from w2b_ros.ros_messages import LATCHED
    described, fixed = [], []
    process = subprocess.Popen([sys.executable, '-c', RUN, '--ros-args', '-p', 'body:=quadruped'])
    try:
        node.create_subscription(String, 'robot_description', described.append, LATCHED)
        frames = find_spec('tf2_msgs') is not None
        if frames:
            from tf2_msgs.msg import TFMessage
            node.create_subscription(TFMessage, '/tf_static', fixed.append, LATCHED)
        end_s = time.monotonic() + DEADLINE_S
        while not (described and (fixed or not frames)) and time.monotonic() < end_s:
            rclpy.spin_once(node, timeout_sec=0.1)
    finally:
        process.terminate()
        assert process.wait(DEADLINE_S) == 0
    assert ElementTree.fromstring(described[0].data).get('name') == 'quadruped'
    if frames:
        assert [one.child_frame_id for one in fixed[0].transforms] == ['imu_link']
