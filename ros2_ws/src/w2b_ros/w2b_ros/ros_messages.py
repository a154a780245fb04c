"""Between ROS messages and plain data; clock and quality of service that the nodes share."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    QoSProfile,
    ReliabilityPolicy,
    qos_profile_sensor_data,
)
from rclpy.topic_endpoint_info import TopicEndpointInfo

from w2b_core.status import Status

#: Sensor frames and targets are sent reliably, so that any subscriber can match, ...
FRAMES_OUT = TARGETS = COMMANDS = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, depth=10, reliability=ReliabilityPolicy.RELIABLE)
#: ... and sensor frames are listened to as sensor data: a late one is worth nothing.
FRAMES_IN = qos_profile_sensor_data
#: The last message waits for late listeners.
LATCHED = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, depth=1, reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL)

NS_PER_S = 1_000_000_000
#: For timers that go on while simulated time stands still.
STEADY = Clock(clock_type=ClockType.STEADY_TIME)


def publisher_name(publisher: TopicEndpointInfo) -> str:
    """Return the node's name, which is discovered a little later than its publishers."""
    if 'UNKNOWN' in publisher.node_name:
        return 'another node'
    return f'the node {publisher.node_namespace.rstrip("/")}/{publisher.node_name}'


def other_publisher(node: Node, topic: str) -> str:
    """Return what else than this node publishes on a topic it publishes on; empty: nothing."""
    if node.count_publishers(topic) <= 1:
        return ''
    names = [publisher_name(publisher)
             for publisher in node.get_publishers_info_by_topic(topic)]
    own = f'the node {node.get_fully_qualified_name()}'
    if own in names:
        names.remove(own)
    if not names:
        return ''
    return f'another node with the name {own.rpartition(" ")[2]}' if own in names else min(names)


def reaches_all(node: Node, publisher: Publisher[Any]) -> bool:
    """
    Return whether a publisher is connected to all subscriptions that the node knows of.

    A subscription is known a little earlier than it is connected; what is published in between is
    lost. Where one never connects, its quality of service being another, it stays false.
    """
    return publisher.get_subscription_count() >= node.count_subscribers(publisher.topic_name)


def message_class(type_name: str) -> Any:
    """
    Return the class of a message type such as `std_msgs/msg/String`.

    ImportError or AttributeError if it is not installed.
    """
    package, _, kind = type_name.partition('/msg/')
    return getattr(import_module(f'{package}.msg'), kind)


def stamp_ns(stamp: Time) -> int:
    """Return a message's stamp in nanoseconds."""
    return int(stamp.sec) * NS_PER_S + int(stamp.nanosec)


def to_stamp(nanoseconds: int) -> Time:
    """Return nanoseconds as a message's stamp."""
    seconds, rest = divmod(nanoseconds, NS_PER_S)
    return Time(sec=seconds, nanosec=rest)


def full_name(node: Node, name: str) -> str:
    """Return the name of a status, `node: part` (REP-107), with the node's namespace and name."""
    return f'{node.get_fully_qualified_name().lstrip("/")}: {name.partition(": ")[2]}'


def to_diagnostic(status: Status, hardware_id: str) -> DiagnosticStatus:
    """Return a status as a diagnostic message."""
    return DiagnosticStatus(
        level=bytes([status.level]), name=status.name, message=status.message,
        hardware_id=hardware_id,
        values=[KeyValue(key=key, value=value) for key, value in status.values.items()])
