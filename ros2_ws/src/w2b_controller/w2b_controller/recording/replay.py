"""`w2b replay`: publishes a recording again, or tells what happened in it."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from w2b_controller.recording.events import events
from w2b_controller.recording.parts import RecordingError
from w2b_controller.recording.reader import Recorded, messages
from w2b_core.command_process import command
from w2b_ros.ros_process import StopFlag, own, start_ros

if TYPE_CHECKING:
    from rclpy.node import Node

ABOUT = """\
Publish a recording again, in its own time, for the page, RViz and Foxglove; or tell what happened:

  w2b replay walk                  # --rate 0.5: half as fast, --loop: again and again
  w2b replay walk --events         # words, answers, states of the body, why it stopped (no ROS)

What moves a robot (words, Twist, joint targets) is never published again, and nothing is where a
robot or another replay publishes.
"""
#: Types that move a robot, and what comes of the middleware itself.
MOVES = frozenset({'trajectory_msgs/msg/JointTrajectory', 'geometry_msgs/msg/Twist',
                   'geometry_msgs/msg/TwistStamped'})
WORDS, LEFT_OUT = 'std_msgs/msg/String', ('/rosout', '/parameter_events')
#: How long others are looked for before the first message: discovery takes its time.
LOOK_S, LOOK_AGAIN_S = 2.0, 0.5


class OccupiedError(RuntimeError):
    """Somebody else publishes on a topic of the recording; one line says who and where."""


def harmless(message: Recorded) -> bool:
    """Return whether a message moves no robot: words are, but not latched texts such as URDF."""
    return (message.type_name not in MOVES and message.topic not in LEFT_OUT
            and (message.type_name != WORDS or message.latched))


class Replayer:
    """Publishes recorded messages on their topics."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._publishers: dict[str, Any] = {}
        self._refused: set[str] = set()

    def announce(self, topics: Iterable[Recorded]) -> None:
        """Make the publishers of the topics, so that listeners find them before it begins."""
        from rclpy.qos import DurabilityPolicy, QoSProfile

        from w2b_ros.ros_messages import message_class
        for one in topics:
            try:
                message_type = message_class(one.type_name)
            except (ImportError, AttributeError) as error:
                print(f'warning: not published: {one.topic}: {error}', file=sys.stderr)
                continue
            durability = (DurabilityPolicy.TRANSIENT_LOCAL if one.latched
                          else DurabilityPolicy.VOLATILE)
            self._publishers[one.topic] = self._node.create_publisher(
                message_type, one.topic, QoSProfile(depth=1 if one.latched else 100,
                                                    durability=durability))

    def look_for_others(self) -> None:
        """Raise OccupiedError if another node publishes where this one does."""
        from w2b_ros.ros_messages import other_publisher
        for topic in self._publishers:
            other = other_publisher(self._node, topic)
            # Each robot has its own diagnostics and frames there.
            if other and topic not in ('/diagnostics', '/tf', '/tf_static'):
                raise OccupiedError(f'{other} publishes on {topic}: stop the robot, or the other '
                                    'replay, first')

    def publish(self, message: Recorded) -> None:
        """Publish one message as it is."""
        if message.topic in self._publishers:
            self._publishers[message.topic].publish(message.data)


def _arguments(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog='w2b replay', description=ABOUT, formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog='Exit code: 0 done, 1 no recording, 2 a robot or another replay is there.')
    parser.add_argument('recording', type=Path, help='folder of `w2b record`, or one MCAP file')
    parser.add_argument('--events', action='store_true',
                        help='print what happened, publish nothing')
    parser.add_argument('--rate', type=_rate, default=1.0, metavar='X',
                        help='times as fast as it was (default: 1)')
    parser.add_argument('--loop', action='store_true', help='begin again at the end')
    return parser.parse_args(arguments)


def _rate(text: str) -> float:
    value = float(text)
    if not 0.01 <= value <= 100:
        raise argparse.ArgumentTypeError(f'expected 0.01 to 100, got {text}')
    return value


@command
def main() -> int:
    """Replay or tell; return the exit code."""
    options = _arguments(own(sys.argv))
    try:
        if options.events:
            for event in events(messages(options.recording)):
                print(event)
            return 0
        return _replay(options)
    except (RecordingError, OccupiedError) as error:
        print(f'error: {error}', file=sys.stderr)
        return 1 if isinstance(error, RecordingError) else 2


def _replay(options: argparse.Namespace) -> int:
    stop = StopFlag()
    stop.install()
    topics: dict[str, Recorded] = {}
    count = 0
    for message in messages(options.recording):
        if harmless(message):
            topics.setdefault(message.topic, message)
            count += 1
    if not start_ros():
        return 2
    import rclpy
    node = rclpy.create_node('replay')
    try:
        replayer = Replayer(node)
        replayer.announce(topics.values())
        until_s = time.monotonic() + LOOK_S
        while time.monotonic() < until_s and not stop.requested:
            replayer.look_for_others()
            time.sleep(0.05)
        print(f'replaying {count} messages of {len(topics)} topics; Ctrl-C ends it', flush=True)
        while not stop.requested:
            for message in _in_time(messages(options.recording), options.rate, stop, replayer):
                replayer.publish(message)
            if not options.loop:
                break
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
    return 0


def _in_time(recorded: Iterable[Recorded], rate: float, stop: StopFlag,
             replayer: Replayer) -> Iterator[Recorded]:
    """Yield each harmless message when it is due; until a signal."""
    begin_s, first_ns, looked_s = time.monotonic(), None, 0.0
    for message in recorded:
        first_ns = message.log_ns if first_ns is None else first_ns
        due_s = begin_s + (message.log_ns - first_ns) / 1e9 / rate
        while (wait_s := due_s - time.monotonic()) > 0 and not stop.requested:
            time.sleep(min(wait_s, 0.1))
        if stop.requested:
            return
        if time.monotonic() - looked_s > LOOK_AGAIN_S:
            looked_s = time.monotonic()
            replayer.look_for_others()
        if harmless(message):
            yield message
