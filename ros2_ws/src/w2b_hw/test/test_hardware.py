"""The robot on emulated chips as a process: it sends frames, and drives nothing until armed."""

import os
import subprocess
import sys
import time

import pytest

RUN = 'from w2b_hw.node import main; raise SystemExit(main())'
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


def test_no_pulse_before_it_is_armed(node):
    import rclpy
    from diagnostic_msgs.msg import DiagnosticStatus
    from sensor_msgs.msg import JointState

    from w2b_core.body_status import TOPIC, BodyStatus
    from w2b_ros.ros_messages import LATCHED
    pulses, bodies = [], []
    node.create_subscription(JointState, 'pulses', pulses.append, 10)
    node.create_subscription(
        DiagnosticStatus, TOPIC, lambda message: bodies.append(BodyStatus.from_values(
            {item.key: item.value for item in message.values})), LATCHED)
    hardware = subprocess.Popen(
        [sys.executable, '-c', RUN, '--ros-args', '-p', 'transport:=emulated'])
    try:
        end_s = time.monotonic() + DEADLINE_S
        while time.monotonic() < end_s and (
                len(pulses) < 20 or not bodies or bodies[-1].state != 'DISARMED'):
            rclpy.spin_once(node, timeout_sec=0.1)
    finally:
        hardware.terminate()
        assert hardware.wait(DEADLINE_S) == 0
    assert len(pulses) >= 20
    assert not any(position for message in pulses for position in message.position)
    assert [body.follows for body in bodies].count(True) == 0
