"""`--help` of a node: what it is for, and its parameters as they are declared."""

from __future__ import annotations

import sys
import textwrap
from collections.abc import Sequence
from typing import Protocol


class Described(Protocol):
    """What the help says of a parameter."""

    @property
    def name(self) -> str:
        """Its name."""

    @property
    def default(self) -> str | float | int | bool:
        """Its value unless told otherwise."""

    @property
    def description(self) -> str:
        """What it means."""

    @property
    def range(self) -> tuple[float, float] | None:
        """Least and greatest value of a number."""


def asked(arguments: Sequence[str] | None = None) -> bool:
    """Return whether the process was started with -h or --help."""
    return not {'-h', '--help'}.isdisjoint(sys.argv[1:] if arguments is None else arguments)


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
