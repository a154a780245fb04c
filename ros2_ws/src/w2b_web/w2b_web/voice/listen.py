"""
`w2b listen`: hears one word at a time, from a microphone or WAV files.

What is heard is published on `heard`: a page puts it into its box. Only stop and halt are said to
the brain at once; another word when a person presses Enter. Exit code: 0 every file was a word, 1
one was none, 2 it cannot listen.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

from w2b_core.command_process import command
from w2b_ros.ros_process import StopFlag, own, start_ros
from w2b_web.voice.microphone import MicrophoneError, microphone, utterance
from w2b_web.voice.recogniser import DIRECT, HEARD_TOPIC, WORDS, MissingError, Recogniser
from w2b_web.voice.sound import Samples, read_wav

if TYPE_CHECKING:
    from rclpy.node import Node
    from rclpy.publisher import Publisher

HEARD, NOT_HEARD, CANNOT = 0, 1, 2
#: How long a brain and a page are waited for, and that a word has arrived.
FOUND_S, ARRIVED_S = 5.0, 2.0
#: How long others that are known to listen are waited for.
OTHERS_S = 0.5


class Mouth:
    """Publishes what was heard."""

    def __init__(self, node: Node) -> None:
        from std_msgs.msg import String

        from w2b_ros.ros_messages import COMMANDS
        self._node = node
        self._string = String
        self._heard = node.create_publisher(String, HEARD_TOPIC, COMMANDS)
        self._commands = node.create_publisher(String, 'command', COMMANDS)

    def heard(self, text: str) -> None:
        """Show a word to the pages; say it if it stops the robot."""
        if text in DIRECT:
            self.say(text)
        self._send(self._heard, text, needed=False)

    def say(self, text: str) -> None:
        """Say a word to the brain."""
        self._send(self._commands, text, needed=True)

    def _send(self, publisher: Publisher[Any], text: str, needed: bool) -> None:
        from rclpy.duration import Duration

        from w2b_ros.ros_messages import reaches_all
        now_s = time.monotonic()
        end_s = now_s + (FOUND_S if needed else 1.0)
        others_s = now_s + OTHERS_S
        # All who are known to listen: one of them is the brain, or the page.
        while (not publisher.get_subscription_count() and time.monotonic() < end_s) or (
                not reaches_all(self._node, publisher) and time.monotonic() < others_s):
            time.sleep(0.02)
        if needed and not publisher.get_subscription_count():
            print(f'error: {text!r} was heard by no brain: start one with `w2b brain`',
                  file=sys.stderr)
        publisher.publish(self._string(data=text))
        publisher.wait_for_all_acked(Duration(seconds=ARRIVED_S))


def _arguments(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog='w2b listen', formatter_class=argparse.RawDescriptionHelpFormatter,
        description=f'{__doc__}\nIts words: {", ".join(WORDS)}.')
    parser.add_argument('file', nargs='*', type=Path,
                        help='WAV files with one word each, 16 bits (default: the microphone)')
    parser.add_argument('--device', default='', metavar='NAME',
                        help='microphone: part of its name, or its number')
    parser.add_argument('--print', action='store_true', dest='only_print',
                        help='print what is heard and send nothing; needs no ROS')
    parser.add_argument('--measure', action='store_true',
                        help='accuracy, false accepts and latency on synthesised speech (minutes)')
    parser.add_argument('--json', action='store_true', help='with --measure: for a program')
    return parser.parse_args(arguments)


@command
def main() -> int:
    """Listen; return the exit code."""
    options = _arguments(own(sys.argv))
    try:
        if options.measure:
            return _measure(options.json)
        if not options.file and not sys.stdin.isatty():
            raise MicrophoneError('expected a terminal, where Enter begins to listen, or WAV files')
        return _listen(options, Recogniser())
    except (MissingError, MicrophoneError, ValueError) as error:
        print(f'error: listen: {error}', file=sys.stderr)
        return CANNOT
    except KeyboardInterrupt:
        return HEARD


def _measure(for_program: bool) -> int:
    from w2b_web.voice.measure import as_json, measure, table
    figures = measure()
    print(json.dumps(as_json(figures)) if for_program else table(figures))
    return 0


def _listen(options: argparse.Namespace, recogniser: Recogniser) -> int:
    if options.only_print:
        return _hear(options, recogniser, None)
    stop = StopFlag()
    if options.file:
        stop.install()
    if not start_ros():
        return CANNOT
    import rclpy
    node = rclpy.create_node('listen')
    try:
        return _hear(options, recogniser, Mouth(node))
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


def _hear(options: argparse.Namespace, recogniser: Recogniser, mouth: Mouth | None) -> int:
    code = HEARD
    for name, samples in _files(options.file) if options.file else _spoken(options.device):
        heard = recogniser.recognise(samples)
        print(f'{name}{heard.text or "none of the words"} ({heard.took_s:.2f} s)', flush=True)
        if not heard.text:
            code = NOT_HEARD
        elif mouth is not None:
            mouth.heard(heard.text)
            if heard.text in DIRECT:
                print(f'{heard.text!r}: said')
            elif sys.stdin.isatty() and not input(
                    f'Enter says {heard.text!r}, another key before it does not: '):
                mouth.say(heard.text)
    return code if options.file else HEARD


def _files(paths: list[Path]) -> Iterator[tuple[str, Samples]]:
    for path in paths:
        yield f'{path}: ', read_wav(path)


def _spoken(device: str) -> Iterator[tuple[str, Samples]]:
    while True:
        try:
            input('Enter, then say one word (Ctrl-D ends): ')
        except EOFError:
            return
        with closing(microphone(device)) as sound:
            said = utterance(sound)
        yield '', said


if __name__ == '__main__':
    raise SystemExit(main())
