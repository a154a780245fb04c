"""`w2b echo TOPIC`: the messages of a topic as YAML, where there is no `ros2 topic echo`."""

from __future__ import annotations

import array
import importlib
import sys
from collections.abc import Mapping
from typing import Any

import numpy as np
import yaml

from w2b_controller.cli import client
from w2b_controller.cli.client import DONE, Client, UnansweredError

ABOUT = """Print the messages of a topic as YAML documents, until Ctrl-C or --count.
Exit code 0: messages were printed. 2: no publisher, or no message in time."""


def main() -> int:
    """Print messages; return the exit code."""
    parser = client.parser('echo', ABOUT)
    parser.add_argument('topic', help='such as joint_states or /diagnostics')
    parser.add_argument('--count', type=_count, default=None, metavar='N',
                        help='end after N messages (default: go on)')
    options = parser.parse_args(client.arguments())
    return client.run('echo', lambda connection: _echo(
        connection, options.topic, options.count, options.timeout))


def _count(text: str) -> int:
    if not text.isdigit() or int(text) < 1:
        from argparse import ArgumentTypeError
        raise ArgumentTypeError(f'expected a whole number above 0, got {text}')
    return int(text)


def _echo(connection: Client, topic: str, count: int | None, timeout_s: float) -> int:
    from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
    node = connection.node
    name = node.resolve_topic_name(topic)

    def publishers() -> list[Any]:
        return list(node.get_publishers_info_by_topic(name))

    def topics() -> str:
        return ', '.join(sorted(found for found, _types in node.get_topic_names_and_types()))
    if not connection.spin(lambda: bool(publishers()), timeout_s):
        raise UnansweredError(f'expected a publisher on {name}, got none in {timeout_s:g} s; '
                              f'topics here: {topics()}')
    found = publishers()
    # What every publisher offers: a stricter subscription would match none of them.
    offers = [publisher.qos_profile for publisher in found]
    reliable = all(offer.reliability == ReliabilityPolicy.RELIABLE for offer in offers)
    latched = all(offer.durability == DurabilityPolicy.TRANSIENT_LOCAL for offer in offers)
    profile = QoSProfile(
        depth=100,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE)
    printed = 0

    def show(message: object) -> None:
        nonlocal printed
        if count is None or printed < count:
            printed += 1
            print(yaml.safe_dump(plain(message), sort_keys=False, allow_unicode=True) + '---',
                  flush=True)
    node.create_subscription(message_type(found[0].topic_type), name, show, profile)
    connection.wait(lambda: printed > 0, timeout_s,
                    f'expected a message on {name}, got none in {timeout_s:g} s')
    try:
        while not connection.spin(lambda: printed == count, 3600.0):
            pass
    except UnansweredError:  # Ctrl-C is the way to end it
        sys.stdout.flush()
    return DONE


def message_type(name: str) -> type:
    """Return the message class of a type name such as `std_msgs/msg/String`."""
    package, kind, message = name.split('/')
    found: type = getattr(importlib.import_module(f'{package}.{kind}'), message)
    return found


def plain(value: Any) -> Any:
    """Return a message, or what it consists of, as what YAML knows."""
    if hasattr(value, 'get_fields_and_field_types'):
        return {field: plain(getattr(value, field))
                for field in value.get_fields_and_field_types()}
    if isinstance(value, bytes):
        return value[0] if len(value) == 1 else list(value)
    if isinstance(value, np.generic | np.ndarray | array.array):
        return value.tolist()
    if isinstance(value, Mapping):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return value
