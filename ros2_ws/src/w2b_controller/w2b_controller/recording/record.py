"""`w2b record`: all topics of a robot into a folder of MCAP files, without the `ros2` tool."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from w2b_controller.recording.definitions import DefinitionError, definition
from w2b_controller.recording.parts import PartsWriter, RecordingError, Topic
from w2b_core.command_process import command
from w2b_ros.ros_process import StopFlag, own, start_ros

if TYPE_CHECKING:
    from rclpy.node import Node
    from rclpy.qos import QoSProfile

ABOUT = """\
Record all topics of a robot, those of its namespace and those that robots share (/diagnostics,
/tf, /tf_static, /clock, /rosout), into a folder of MCAP files:

  w2b record --out walk            # until Ctrl-C
  w2b replay walk --events         # what happened: words, answers, why it stopped
  w2b replay walk                  # publish it again: the page, RViz and Foxglove show it

The folder stays below --max-mb: the oldest file goes first. A killed recorder loses half a second.
"""
#: Absolute names that all robots share.
SHARED = ('/diagnostics', '/tf', '/tf_static', '/clock', '/rosout')
LEFT_OUT = ('/parameter_events',)
DISCOVER_S, FLUSH_S, DISK_S, DEPTH = 0.3, 0.5, 5.0, 200
PART_MB = 8


class Recorder:
    """Subscribes to the topics of a robot and writes what comes."""

    def __init__(self, node: Node, writer: PartsWriter, namespace: str,
                 left_out: tuple[str, ...] = ()) -> None:
        self._node, self._writer = node, writer
        self._namespace = namespace.rstrip('/') + '/'
        self._left_out = (*LEFT_OUT, *left_out)
        self._subscriptions: dict[str, tuple[QoSProfile, Any]] = {}
        self._refused: set[str] = set()
        self._heard: set[str] = set()

    @property
    def topics(self) -> tuple[str, ...]:
        """Names of the topics of which something was recorded."""
        return tuple(sorted(self._heard))

    def wants(self, topic: str) -> bool:
        """Return whether a topic belongs to the robot and is not left out."""
        return (topic.startswith(self._namespace) or topic in SHARED) and \
            topic not in self._left_out and not topic.rpartition('/')[2].startswith('_')

    def discover(self) -> None:
        """Subscribe to what has appeared since."""
        for name, types in self._node.get_topic_names_and_types():
            if self.wants(name) and name not in self._refused and len(types) == 1:
                self._subscribe(name, types[0])

    def _subscribe(self, name: str, type_name: str) -> None:
        from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

        from w2b_ros.ros_messages import message_class
        # A word's publisher may come, speak and go: a topic that has only listeners is listened to.
        publishers = self._node.get_publishers_info_by_topic(name)
        if not publishers and name in self._subscriptions:
            return
        # What all of them offer: a listener that asks for more hears nothing.
        latched = bool(publishers) and all(
            publisher.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
            for publisher in publishers)
        reliable = all(publisher.qos_profile.reliability == ReliabilityPolicy.RELIABLE
                       for publisher in publishers)
        profile = QoSProfile(
            depth=DEPTH,
            reliability=(ReliabilityPolicy.RELIABLE if reliable
                         else ReliabilityPolicy.BEST_EFFORT),
            durability=(DurabilityPolicy.TRANSIENT_LOCAL if latched
                        else DurabilityPolicy.VOLATILE))
        before = self._subscriptions.get(name)
        if before is not None:
            if before[0] == profile:
                return
            self._node.destroy_subscription(before[1])
        try:
            message_type = message_class(type_name)
            topic = Topic(name, type_name, definition(type_name), latched)
        except (ImportError, AttributeError, DefinitionError) as error:
            self._refused.add(name)
            print(f'warning: not recorded: {name}: {error}', file=sys.stderr)
            return
        self._subscriptions[name] = (profile, self._node.create_subscription(
            message_type, name, self._taker(topic), profile, raw=True))

    def _taker(self, topic: Topic) -> Callable[[bytes, dict[str, int]], None]:
        def take(data: bytes, info: dict[str, int]) -> None:
            now_ns = time.time_ns()
            self._heard.add(topic.name)
            self._writer.write(topic, data, now_ns, info.get('source_timestamp', 0) or now_ns)
        return take


def _positive(text: str) -> float:
    value = float(text)
    if not 0 < value < float('inf'):
        raise argparse.ArgumentTypeError(f'expected a number above 0, got {text}')
    return value


def _arguments(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog='w2b record', description=ABOUT, formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog='Exit code: 0 recorded, 1 the disk is full or nothing came, 2 it cannot start.')
    parser.add_argument('--out', type=Path, default=None, metavar='DIR',
                        help='new folder (default: recording-TIME)')
    parser.add_argument('--namespace', '--ns', default='', metavar='/NAME',
                        help='of the robot (default: everything)')
    parser.add_argument('--exclude', action='append', default=[], metavar='TOPIC',
                        help='leave a topic out, by its full name; can be given again')
    parser.add_argument('--max-mb', type=_positive, default=512.0, metavar='MB',
                        help='of all files together; the oldest are removed (default: 512)')
    parser.add_argument('--seconds', type=_positive, default=None, metavar='S',
                        help='end after this time (default: with Ctrl-C)')
    return parser.parse_args(arguments)


@command
def main() -> int:
    """Record until a signal, the given time or a full disk; return the exit code."""
    stop = StopFlag()
    stop.install()
    options = _arguments(own(sys.argv))
    now = datetime.now(UTC)
    folder = options.out or Path(f'recording-{now:%Y%m%dT%H%M%SZ}')
    try:
        writer = PartsWriter(
            folder, total_bytes=round(options.max_mb * 1e6), part_bytes=PART_MB * 10**6,
            about={'namespace': options.namespace or '/', 'began': now.isoformat()})
    except RecordingError as error:
        print(f'error: {error}', file=sys.stderr)
        return 2
    if not start_ros():
        return 2
    import rclpy
    node = rclpy.create_node('record')
    recorder = Recorder(node, writer, options.namespace, tuple(options.exclude))
    print(f'recording to {folder}; Ctrl-C ends it', flush=True)
    code = 0
    try:
        _record(node, recorder, writer, stop, options.seconds)
        writer.close()
    except RecordingError as error:
        print(f'error: {error}', file=sys.stderr)
        code = 1
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
    print(f'{writer.messages} messages of {len(recorder.topics)} topics in {folder}: '
          f'{writer.size_bytes / 1e6:.1f} MB')
    return code if writer.messages else 1


def _record(node: Node, recorder: Recorder, writer: PartsWriter, stop: StopFlag,
            seconds: float | None) -> None:
    import rclpy
    end_s = float('inf') if seconds is None else time.monotonic() + seconds
    discovered_s = flushed_s = synced_s = float('-inf')
    while not stop.requested and (now_s := time.monotonic()) < end_s:
        if now_s - discovered_s >= DISCOVER_S:
            recorder.discover()
            discovered_s = now_s
        if now_s - flushed_s >= FLUSH_S:
            to_disk = now_s - synced_s >= DISK_S
            writer.flush(to_disk)
            flushed_s, synced_s = now_s, now_s if to_disk else synced_s
        rclpy.spin_once(node, timeout_sec=0.1)
