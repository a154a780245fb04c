"""
`w2b say WORD...`: says a word to the brain and waits for its answer.

Exit code 0: a body follows it. 1: the brain refused it, and says why. 2: no answer. 3: the
brain understood it, but no body follows; with `--understood` that is 0.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from w2b_core.command_process import command
from w2b_core.shell import w2b_command
from w2b_ros.ros_process import StopFlag, own, start_ros

if TYPE_CHECKING:
    from diagnostic_msgs.msg import DiagnosticStatus
    from rclpy.node import Node

NO_BRAIN = f'no brain listens: start one with `{w2b_command("brain")}`'
#: Of an endpoint's name, those that all endpoints of a process share (RTPS 2.3, section 9.3).
PARTICIPANT_BYTES = 12
FOLLOWED, REFUSED, UNANSWERED, NOT_FOLLOWED = 0, 1, 2, 3
#: Help of the option of `say` and `console`.
UNDERSTOOD = 'do not wait for a body that follows: the exit code tells what the brain understood'


class NoAnswerError(RuntimeError):
    """No brain, or no answer in time; one line says which."""


class Messenger:
    """Says commands to the brain that a node can reach."""

    def __init__(self, node: Node, command_topic: str = 'command',
                 answer_topic: str = 'command_answer',
                 interrupted: Callable[[], bool] = lambda: False) -> None:
        from diagnostic_msgs.msg import DiagnosticStatus
        from std_msgs.msg import String

        from w2b_ros.ros_messages import COMMANDS, LATCHED
        self._node = node
        self._interrupted = interrupted
        self._answer: DiagnosticStatus | None = None
        self._string = String
        self._publisher = node.create_publisher(String, command_topic, COMMANDS)
        self._subscription = node.create_subscription(
            DiagnosticStatus, answer_topic, self._on_answer, LATCHED)

    def _on_answer(self, answer: DiagnosticStatus) -> None:
        values = values_of(answer)
        if values.get('received', '').isdigit() and 'text' in values:  # not a stranger's
            self._answer = answer

    def say(self, text: str, timeout_s: float = 10.0,
            understood: bool = False) -> DiagnosticStatus:
        """
        Say a command and return the brain's answer to it.

        The brain counts what it hears. Its latched answer has the count before, so that an
        answer with a higher count and this text can only be to this command. The brain answers
        again when a body has accepted the first target that follows the word, or will not.

        Parameters
        ----------
        text
            The command.
        timeout_s
            How long to wait for a brain, its answer and a body that follows.
        understood
            Return the first answer, without waiting for a body.

        Raises
        ------
        NoAnswerError
            If no brain listens, or none answers in time.

        """
        import rclpy

        from w2b_core.command import quoted
        deadline_s = time.monotonic() + timeout_s
        self._spin(deadline_s, self._reaches_the_brain, NO_BRAIN)
        before = values_of(self._answer)['received']
        self._publisher.publish(self._string(data=text))

        def answered() -> bool:
            values = values_of(self._answer)
            return int(values['received']) > int(before) and values['text'] == quoted(text)
        self._spin(deadline_s, answered, f'the brain did not answer within {timeout_s:g} s: '
                   'see what it says on /diagnostics')
        assert self._answer is not None
        answer = self._answer
        while not understood and time.monotonic() < deadline_s and not self._interrupted():
            if not answered():
                return _overtaken(answer, values_of(self._answer)['text'])
            answer = self._answer
            if values_of(answer).get('body_follows') != 'pending':
                break
            rclpy.spin_once(self._node, timeout_sec=0.05)
        return answer

    def _reaches_the_brain(self) -> bool:
        """
        Return whether the process that answers is one of those that hear a command.

        Others may hear it too, and be found earlier: a recorder, the page, `w2b echo`.
        """
        if self._answer is None or not self._publisher.get_subscription_count():
            return False
        answering, hearing = (
            {bytes(end.endpoint_gid[:PARTICIPANT_BYTES]) for end in ends} for ends in (
                self._node.get_publishers_info_by_topic(self._subscription.topic_name),
                self._node.get_subscriptions_info_by_topic(self._publisher.topic_name)))
        return bool(answering) and answering <= hearing

    def _spin(self, deadline_s: float, condition: Callable[[], bool], reason: str) -> None:
        import rclpy
        while not condition():
            if self._interrupted():
                raise NoAnswerError('interrupted')
            if time.monotonic() > deadline_s:
                raise NoAnswerError(reason)
            rclpy.spin_once(self._node, timeout_sec=0.05)


def values_of(status: DiagnosticStatus | None) -> dict[str, str]:
    """Return a status's values by key."""
    return {} if status is None else {value.key: value.value for value in status.values}


def _overtaken(answer: DiagnosticStatus, text: str) -> DiagnosticStatus:
    """Return the answer to a word that another one took the place of, before a body followed."""
    for item in answer.values:
        if item.key == 'why_not':
            item.value = f'another command was heard since: {text!r}'
        elif item.key == 'body_follows':
            item.value = 'false'
    return answer


def exit_code(answer: DiagnosticStatus, understood: bool) -> int:
    """Return what an answer is worth: FOLLOWED, REFUSED or NOT_FOLLOWED."""
    if answer.level[0] >= 2:
        return REFUSED
    if understood or values_of(answer).get('body_follows') == 'true':
        return FOLLOWED
    return NOT_FOLLOWED


def as_json(answer: DiagnosticStatus) -> str:
    """Return an answer as one line of JSON."""
    return json.dumps({'level': answer.level[0], 'message': answer.message,
                       'hardware_id': answer.hardware_id, **values_of(answer)})


def show(answer: DiagnosticStatus, understood: bool = False) -> int:
    """Print an answer for a person; return its exit code."""
    code, values = exit_code(answer, understood), values_of(answer)
    message = answer.message
    if code == NOT_FOLLOWED and values.get('why_not', '') not in message:
        message += f'; no body follows: {values["why_not"]}'
    print(message, file=sys.stdout if code == FOLLOWED else sys.stderr)
    if values.get('nearest'):
        print(f'nearest in meaning: {values["nearest"]}')
    return code


def seconds(text: str) -> float:
    """Return a number of seconds above 0, for argparse."""
    value = float(text)
    if not 0 < value < float('inf'):
        raise argparse.ArgumentTypeError(f'expected seconds above 0, got {text}')
    return value


def readable(text: str) -> bool:
    """Return whether text came in as UTF-8: what did not cannot be sent."""
    return not any('\ud800' <= character <= '\udfff' for character in text)


def _arguments(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog='say', description='Say a word to the brain and wait for its answer.')
    parser.add_argument('word', nargs='+', help='one word or several, heard in this order')
    parser.add_argument('--timeout', type=seconds, default=10.0, metavar='S',
                        help='seconds to wait for a brain, its answer and a body that follows '
                             '(default: %(default)s)')
    parser.add_argument('--understood', action='store_true', help=UNDERSTOOD)
    parser.add_argument('--json', action='store_true', help='print the answer as JSON')
    return parser.parse_args(arguments)


@command
def main() -> int:
    """Say the words of the command line; return the exit code."""
    stop = StopFlag()
    stop.install()
    if not all(map(readable, sys.argv)):
        print('error: command: expected text in UTF-8, got other bytes', file=sys.stderr)
        return REFUSED
    options = _arguments(own(sys.argv))
    if not start_ros():
        return UNANSWERED
    import rclpy
    node = rclpy.create_node('say')
    try:
        messenger = Messenger(node, interrupted=lambda: stop.requested)
        answer = messenger.say(' '.join(options.word), options.timeout, options.understood)
    except NoAnswerError as error:
        print(f'error: {error}', file=sys.stderr)
        return UNANSWERED
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
    if options.json:
        print(as_json(answer))
        return exit_code(answer, options.understood)
    return show(answer, options.understood)
