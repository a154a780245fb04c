"""
`w2b console`: type words, and read what the brain makes of each.

One line is one command; an empty line, Ctrl-D or Ctrl-C leaves. Also reads a pipe.
"""

from __future__ import annotations

import argparse
import sys

from w2b_controller.say import (
    UNANSWERED,
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
    """Talk until the input ends; return 0, or 2 if the brain did not answer."""
    try:
        return _talk()
    except KeyboardInterrupt:
        return 0


def _talk() -> int:
    parser = argparse.ArgumentParser(prog='console', description='Talk to the brain.')
    parser.add_argument('--timeout', type=seconds, default=10.0, metavar='S',
                        help='seconds to wait for an answer (default: %(default)s)')
    options = parser.parse_args(own(sys.argv))
    if not start_ros():
        return UNANSWERED
    import rclpy
    node = rclpy.create_node('console')
    try:
        messenger = Messenger(node)
        while text := _line():
            if readable(text):
                show(messenger.say(text, options.timeout))
            else:
                print('error: command: expected text in UTF-8, got other bytes', file=sys.stderr)
    except NoAnswerError as error:
        print(f'error: {error}', file=sys.stderr)
        return UNANSWERED
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
    return 0


def _line() -> str:
    """Return the next line, empty at the end."""
    try:
        return input(PROMPT if sys.stdin.isatty() else '').strip()
    except EOFError:
        return ''
