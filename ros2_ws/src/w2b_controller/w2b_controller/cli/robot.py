"""The subcommands that ask a running robot: services, status, topics."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from w2b_controller.say import seconds, values_of
from w2b_core.body_status import TOPIC as BODY_STATUS
from w2b_core.shell import w2b_command
from w2b_ros.ros_process import StopFlag, own, start_ros

if TYPE_CHECKING:
    from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
    from rclpy.node import Node

DONE, REFUSED, NOBODY = 0, 1, 2
LEVELS = ('OK', 'WARN', 'ERROR', 'STALE')
NO_BODY = {
    'hardware': f'no hardware node answers: start one with `{w2b_command("hardware")}`',
    'sim': f'no simulation answers: start one with `{w2b_command("sim")}`',
}


class NobodyError(RuntimeError):
    """No node answered in time; one line names the node or service."""


class _Asking:
    """A node of ours for as long as a command takes."""

    def __init__(self, node: Node, deadline_s: float, stop: StopFlag) -> None:
        self.node, self.deadline_s, self._stop = node, deadline_s, stop

    def until(self, condition: Callable[[], object], reason: str) -> None:
        """Spin until the condition holds (NobodyError with the reason if it does not in time)."""
        import rclpy
        while not condition():
            if self._stop.requested:
                raise NobodyError('interrupted')
            if time.monotonic() > self.deadline_s:
                raise NobodyError(reason)
            rclpy.spin_once(self.node, timeout_sec=0.05)

    def call(self, kind: type, service: str, request: Any, reason: str) -> Any:
        """Return the response of a service (NobodyError)."""
        client = self.node.create_client(kind, service)
        self.until(client.service_is_ready, reason)
        future = client.call_async(request)
        self.until(future.done, f'{service} did not answer in time')
        return future.result()


@contextmanager
def _asking(options: argparse.Namespace) -> Iterator[_Asking]:
    import rclpy
    stop = StopFlag()
    stop.install()
    if not start_ros():
        raise SystemExit(NOBODY)
    node = rclpy.create_node('w2b', namespace=options.namespace or None)
    try:
        yield _Asking(node, time.monotonic() + options.timeout, stop)
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


def _parser(command: str, about: str) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog=f'w2b {command}', description=about, epilog=(
        'Exit code: 0 done, 1 refused (the answer says why), 2 nobody answered.'))
    parser.add_argument('--namespace', '--ns', default='', metavar='/NAME',
                        help='of the robot, where there are several')
    parser.add_argument('--timeout', type=seconds, default=10.0, metavar='S',
                        help='seconds to wait for an answer (default: %(default)s)')
    return parser


def _trigger(options: argparse.Namespace, node: str, service: str) -> int:
    from std_srvs.srv import Trigger
    try:
        with _asking(options) as asking:
            response = asking.call(Trigger, f'{node}/{service}', Trigger.Request(), NO_BODY[node])
    except NobodyError as error:
        print(f'error: {error}', file=sys.stderr)
        return NOBODY
    return _told(response)


def _told(response: Any) -> int:
    print(response.message, file=sys.stdout if response.success else sys.stderr)
    return DONE if response.success else REFUSED


def arm() -> int:
    """`w2b arm`: return the exit code."""
    options = _parser('arm', 'Let the servos follow the brain; they come on one by one.') \
        .parse_args(own(sys.argv))
    return _trigger(options, 'hardware', 'arm')


def disarm() -> int:
    """`w2b disarm`: return the exit code."""
    options = _parser('disarm', 'Park the robot and relax its servos.').parse_args(own(sys.argv))
    return _trigger(options, 'hardware', 'disarm')


def reset() -> int:
    """`w2b reset`: return the exit code."""
    options = _parser('reset', 'Put a simulated body back to its start, at rest.') \
        .parse_args(own(sys.argv))
    return _trigger(options, 'sim', 'reset')


def pause() -> int:
    """`w2b pause`: return the exit code."""
    parser = _parser('pause', 'Stop the clock of a simulation.')
    parser.add_argument('--off', action='store_true', help='let it go on')
    options = parser.parse_args(own(sys.argv))
    from std_srvs.srv import SetBool
    try:
        with _asking(options) as asking:
            response = asking.call(SetBool, 'sim/pause', SetBool.Request(data=not options.off),
                                   NO_BODY['sim'])
    except NobodyError as error:
        print(f'error: {error}', file=sys.stderr)
        return NOBODY
    return _told(response)


def stop() -> int:
    """`w2b stop`: return the exit code."""
    options = _parser('stop', 'Emergency stop: the servos go off at once; a simulation pauses. '
                      'To stand still instead, say stop.').parse_args(own(sys.argv))
    from std_srvs.srv import SetBool, Trigger
    try:
        with _asking(options) as asking:
            hardware = asking.node.create_client(Trigger, 'hardware/emergency_stop')
            simulation = asking.node.create_client(SetBool, 'sim/pause')
            asking.until(lambda: hardware.service_is_ready() or simulation.service_is_ready(),
                         'neither a hardware node nor a simulation answers: cut the power, or '
                         f'turn the servos off over the bus with `{w2b_command("relax")}`')
            # Whichever is there is stopped: where both are, both.
            futures = [client.call_async(request) for client, request in (
                (hardware, Trigger.Request()), (simulation, SetBool.Request(data=True)))
                if client.service_is_ready()]
            asking.until(lambda: all(future.done() for future in futures),
                         'no answer: cut the power')
            return max(_told(future.result()) for future in futures)
    except NobodyError as error:
        print(f'error: {error}', file=sys.stderr)
        return NOBODY


def status() -> int:
    """`w2b status`: return the exit code."""
    parser = _parser('status', 'How brain and body are, from /diagnostics and body_status.')
    parser.epilog = 'Exit code: 0 all is well, 1 a part says WARN or ERROR, 2 nobody is there.'
    parser.add_argument('--listen', type=seconds, default=1.5, metavar='S',
                        help='seconds to listen once somebody is there (default: %(default)s)')
    options = parser.parse_args(own(sys.argv))
    from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

    from w2b_ros.ros_messages import LATCHED
    found: dict[str, DiagnosticStatus] = {}

    def heard(message: DiagnosticArray) -> None:
        found.update((part.name, part) for part in message.status)

    try:
        with _asking(options) as asking:
            asking.node.create_subscription(DiagnosticArray, '/diagnostics', heard, 10)
            asking.node.create_subscription(
                DiagnosticStatus, BODY_STATUS, lambda part: found.update({part.name: part}),
                LATCHED)
            asking.until(lambda: found, 'nobody publishes diagnostics: start a brain and a body')
            until_s = time.monotonic() + options.listen
            asking.until(lambda: time.monotonic() > until_s, 'interrupted')
    except NobodyError as error:
        print(f'error: {error}', file=sys.stderr)
        return NOBODY
    for name in sorted(found):
        level = min(found[name].level[0], len(LEVELS) - 1)
        print(f'{LEVELS[level]:5}  {name}: {found[name].message}')
        if name.endswith(': body'):
            values = values_of(found[name])
            print(f'       follows: {values.get("follows", "?")}, state: '
                  f'{values.get("state", "?")}')
    return REFUSED if any(part.level[0] for part in found.values()) else DONE


def _topic(node: Node, text: str) -> str:
    from rclpy.impl.implementation_singleton import rclpy_implementation
    try:
        return node.resolve_topic_name(text)
    except rclpy_implementation.RCLError as error:
        reason = str(error).split(', at ')[0]
        raise NobodyError(f'expected the name of a topic, got {text!r} ({reason})') from None


def plain(value: Any) -> Any:
    """Return a message, or a field of one, as what YAML can hold."""
    fields = getattr(value, 'get_fields_and_field_types', None)
    if fields is not None:
        return {name: plain(getattr(value, name)) for name in fields()}
    if isinstance(value, bytes):
        return list(value) if len(value) > 1 else value[0]
    if isinstance(value, str | bool | int | float):
        return value
    return [plain(item) for item in value]


def _count(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f'expected a whole number above 0, got {text}')
    return int(text)


def echo() -> int:
    """`w2b echo TOPIC`: return the exit code."""
    parser = _parser('echo', 'Print what is published on a topic, as YAML.')
    parser.add_argument('topic', help='such as joint_states; relative to the namespace')
    parser.add_argument('--count', type=_count, default=None, metavar='N',
                        help='end after this many messages (default: go on until Ctrl-C)')
    options = parser.parse_args(own(sys.argv))
    import yaml
    from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

    from w2b_ros.ros_messages import message_class
    seen = 0

    def show(message: Any) -> None:
        nonlocal seen
        seen += 1
        print(yaml.safe_dump(plain(message), sort_keys=False, default_flow_style=None) + '---',
              flush=True)

    try:
        with _asking(options) as asking:
            name = _topic(asking.node, options.topic)
            asking.until(lambda: asking.node.get_publishers_info_by_topic(name),
                         f'nobody publishes on {name}')
            publishers = asking.node.get_publishers_info_by_topic(name)
            # Only if all are latched: a listener that asks for it hears no others.
            latched = all(publisher.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
                          for publisher in publishers)
            profile = QoSProfile(
                depth=10, reliability=ReliabilityPolicy.BEST_EFFORT,
                durability=DurabilityPolicy.VOLATILE)
            if latched:
                profile = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE,
                                     durability=DurabilityPolicy.TRANSIENT_LOCAL)
            asking.node.create_subscription(
                message_class(publishers[0].topic_type), name, show, profile)
            if options.count is None:
                asking.deadline_s = float('inf')
            asking.until(lambda: options.count is not None and seen >= options.count,
                         f'{seen} messages on {name} within {options.timeout:g} s')
    except NobodyError as error:
        if str(error) == 'interrupted':
            return DONE
        print(f'error: {error}', file=sys.stderr)
        return NOBODY
    return DONE
