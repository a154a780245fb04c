"""
The command line of a node: `--help`, and arguments that are refused instead of ignored.

A node takes ROS arguments only. One that it ignored would be one that its user counts on: a robot
that was meant to be emulated would move.
"""

from __future__ import annotations

import sys
import textwrap
from collections.abc import Callable, Sequence
from typing import Protocol

from w2b_ros.ros_process import USAGE_ERROR, own


class Described(Protocol):
    """What the help says of a parameter."""

    @property
    def name(self) -> str:
        """Its name."""

    @property
    def default(self) -> str | float | int | bool:
        """Its default value."""

    @property
    def description(self) -> str:
        """What it means."""

    @property
    def range(self) -> tuple[float, float] | None:
        """Least and greatest value of a number."""


def answer(package: str, executable: str, about: str,
           parameters: Callable[[], Sequence[Described]]) -> int | None:
    """
    Return the exit code of a node that shall not start, None for one that shall.

    With -h or --help its help is printed; of an argument that is not for ROS one line says what
    was expected. `parameters` is called for these alone: it may import ROS.
    """
    if not {'-h', '--help'}.isdisjoint(sys.argv[1:]):
        print(text(package, executable, about, parameters()))
        return 0
    arguments = own(sys.argv)
    if arguments:
        names = [parameter.name for parameter in parameters()]
        print(f'error: {executable}: {refusal(arguments, names)}', file=sys.stderr)
        return USAGE_ERROR
    return None


def refusal(arguments: Sequence[str], names: Sequence[str]) -> str:
    """Return in one line what a node expects instead of these arguments, which are not ROS's."""
    # What is given as NAME:=VALUE, --NAME VALUE or --NAME=VALUE is most likely a parameter.
    for index, argument in enumerate(arguments):
        following = arguments[index + 1] if index + 1 < len(arguments) else ''
        name, assigned, value = argument.partition(':=')
        got = argument
        if not assigned:
            name, assigned, value = argument.partition('=')
            if not assigned and following and not following.startswith('-'):
                value, got = following, f'{argument} {following}'
        name = name.lstrip('-').replace('-', '_')
        if name in names:
            return _line(f'expected --ros-args -p {name}:={value or "VALUE"}, got {got!r}')
    return _line(f'expected ROS arguments only, --ros-args -p NAME:=VALUE (see --help), '
                 f'got {" ".join(arguments)!r}')


def _line(text: str) -> str:
    return ''.join(character if character.isprintable() else ' ' for character in text)


def text(package: str, executable: str, about: str, parameters: Sequence[Described]) -> str:
    """Return the help of a node of a package."""
    lines = [f'usage: ros2 run {package} {executable} --ros-args [-p NAME:=VALUE ...] '
             f'[--params-file FILE] [-r FROM:=TO ...]', '', about.strip(), '', 'parameters:']
    for parameter in parameters:
        limits = ''
        if parameter.range is not None:
            limits = f', {parameter.range[0]:g} to {parameter.range[1]:g}'
        lines.append(f'  {parameter.name} (default: {_shown(parameter.default)}{limits})')
        lines += textwrap.wrap(parameter.description, 90, initial_indent=' ' * 6,
                               subsequent_indent=' ' * 6)
    return '\n'.join(lines)


def _shown(value: str | float | int | bool) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return str(value) if value != '' else "''"
