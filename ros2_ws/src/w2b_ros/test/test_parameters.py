"""Parameters of a node: what makes no sense is refused, and says when it can be set."""

import os

import pytest
import rclpy
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter

from w2b_core.status import Level, Status
from w2b_ros.parameters import Parameter, When, check_frame_id, declare
from w2b_ros.ros_messages import full_name, stamp_ns, to_diagnostic, to_stamp

PARAMETERS = (
    Parameter('file', 'a', 'Loaded when configured.', when=When.CONFIGURE),
    Parameter('body', 'b', 'Fixed.', when=When.START),
    Parameter('words_topic', 'words', 'A topic.', topic=True),
    Parameter('speed', 1.0, 'A number.', (0.0, 2.0)),
    Parameter('frame', 'imu_link', 'A frame.', check=check_frame_id))


@pytest.fixture
def node():
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'OFF'
    rclpy.init()
    node = Node('walker', namespace='dog1')
    node.state = 'active'
    declare(node, PARAMETERS, state=lambda: node.state)
    yield node
    node.destroy_node()
    rclpy.shutdown()


def put(node, name, value):
    result = node.set_parameters_atomically([RosParameter(name, value=value)])
    return result.reason if not result.successful else ''


def test_each_is_applied_or_refused_with_the_reason(node):
    assert 'can be set in the state unconfigured' in put(node, 'file', 'c')
    node.state = 'unconfigured'
    assert put(node, 'file', 'c') == ''
    assert 'start it again with --ros-args -p body:=VALUE' in put(node, 'body', 'c')
    assert 'expected the name of a topic' in put(node, 'words_topic', 'a//b')
    assert 'speed' in put(node, 'speed', float('nan'))
    assert put(node, 'speed', 2) == '', 'a whole number will do'
    assert 'expected the name of a frame' in put(node, 'frame', '/imu')
    assert [node.get_parameter(name).value for name in ('file', 'body', 'words_topic', 'speed')] \
        == ['c', 'b', 'words', 2.0]


def test_a_status_carries_the_full_name_of_its_node(node):
    status = Status(Level.WARN, full_name(node, 'walker: legs'), 'tired', {'left': '1'})
    message = to_diagnostic(status, 'dog')
    assert (message.name, message.level, message.values[0].key) == (
        'dog1/walker: legs', b'\x01', 'left')


def test_stamps_survive_the_way_there_and_back():
    assert stamp_ns(to_stamp(1_795_893_456_053_285_646)) == 1_795_893_456_053_285_646
