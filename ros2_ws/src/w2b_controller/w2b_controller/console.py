"""
`w2b console`: type words, and read the answer of the brain to each.

One line is one command; an empty line, Ctrl-D or Ctrl-C leaves. Also reads a pipe: the exit code is
then that of the first word which no body follows, as `say` has it.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator

from w2b_controller.say import (
    FOLLOWED,
    REFUSED,
    UNANSWERED,
    UNDERSTOOD,
    Messenger,
    NoAnswerError,
    readable,
    seconds,
    show,
)
from w2b_core.command_process import command
from w2b_ros.ros_process import own, start_ros

PROMPT = 'say> '


@command
def main() -> int:
    """Send commands until the input ends; return the exit code (0 at a terminal with a brain)."""
    try:
        return _talk()
    except KeyboardInterrupt:
        return 0


def _talk() -> int:
    parser = argparse.ArgumentParser(prog='console', description='Talk to the brain.')
    parser.add_argument('--timeout', type=seconds, default=10.0, metavar='S',
                        help='seconds to wait for an answer (default: %(default)s)')
    parser.add_argument('--understood', action='store_true', help=UNDERSTOOD)
    options = parser.parse_args(own(sys.argv))
    code = FOLLOWED
    if not start_ros():
        return UNANSWERED
    import rclpy
    node = rclpy.create_node('console')
    try:
        messenger = Messenger(node)
        for text in _lines():
            if readable(text):
                shown = show(messenger.say(text, options.timeout, options.understood),
                             options.understood)
                code = code or shown
            else:
                print('error: command: expected text in UTF-8, got other bytes', file=sys.stderr)
                code = code or REFUSED
    except NoAnswerError as error:
        print(f'error: {error}', file=sys.stderr)
        return UNANSWERED
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
    return FOLLOWED if sys.stdin.isatty() else code


def _lines() -> Iterator[str]:
    """Yield the lines of a pipe that are not empty; at a terminal, those before an empty one."""
    terminal = sys.stdin.isatty()
    while True:
        try:
            text = input(PROMPT if terminal else '').strip()
        except EOFError:
            return
        if text:
            yield text
        elif terminal:
            return
