"""What a browser may ask for: one JSON object a message, checked field by field."""

from __future__ import annotations

import json
import math
import re
from dataclasses import dataclass

#: Bytes of a message; a command's text is far shorter.
LARGEST_MESSAGE = 4096
#: Characters of a command.
LONGEST_TEXT = 300
#: Simulated seconds a second.
SLOWEST, FASTEST = 0.05, 20.0
_NAMESPACE = re.compile(r'(/[A-Za-z_][A-Za-z0-9_]*)*')
_LONGEST_NAMESPACE = 200

#: What is asked for -> the field it needs besides `robot`, and its type.
FIELDS: dict[str, tuple[str, type] | None] = {
    'say': ('text', str), 'suggest': ('text', str), 'watch': None, 'pong': ('number', float),
    'stop': None, 'stop_all': None, 'arm': ('confirmed', bool), 'disarm': None, 'reset': None,
    'pause': None, 'resume': None, 'speed': ('number', float),
    # Between these two a page sends sound, in binary messages: 16 kHz, 16 bits, one channel.
    'talk': None, 'talked': None}
#: Never counted, never refused for coming too often.
URGENT = frozenset({'stop', 'stop_all'})


class BadRequestError(ValueError):
    """A message that is none of the page's; one line says what was expected."""


@dataclass(frozen=True)
class Request:
    """
    One request.

    Attributes
    ----------
    do
        One of `FIELDS`.
    robot
        Namespace of the robot, empty for the root; None if the request is for the one watched.
    text, number
        The field that it needs, else empty and 0.

    """

    do: str
    robot: str | None = None
    text: str = ''
    number: float = 0.0


def parse(data: str) -> Request:
    """
    Return the request of a message.

    Raises
    ------
    BadRequestError
        If the message is no JSON object with the fields of a request.

    """
    try:
        # NaN and infinities are no JSON; deep nesting is no request.
        found = json.loads(data, parse_constant=_no_constant)
    except (ValueError, RecursionError):
        raise BadRequestError(f'expected JSON, got {data[:40]!r}') from None
    if not isinstance(found, dict):
        raise BadRequestError(f'expected an object, got {data[:40]!r}')
    do = found.get('do')
    if not isinstance(do, str) or do not in FIELDS:
        raise BadRequestError(f'do: expected one of {", ".join(FIELDS)}, got {str(do)[:40]!r}')
    robot = found.get('robot')
    if robot is not None and not _is_namespace(robot):
        raise BadRequestError(f'robot: expected a namespace, got {str(robot)[:40]!r}')
    needs = FIELDS[do]
    if needs is None:
        return Request(do, robot)
    name, kind = needs
    value = found.get(name)
    if kind is float:
        return Request(do, robot, number=_number(do, name, value))
    if kind is bool:
        if value is not True:
            raise BadRequestError(f'{do}: expected {name}: true, got {str(value)[:40]!r}')
        return Request(do, robot)
    if not isinstance(value, str) or len(value) > LONGEST_TEXT:
        raise BadRequestError(f'{do}: {name}: expected text of {LONGEST_TEXT} characters at most, '
                              f'got {str(value)[:40]!r}')
    # A lone surrogate cannot be sent over ROS.
    return Request(do, robot, text=value.encode('utf-8', 'replace').decode())


def _is_namespace(value: object) -> bool:
    return (isinstance(value, str) and len(value) <= _LONGEST_NAMESPACE
            and _NAMESPACE.fullmatch(value) is not None)


def _number(do: str, name: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) \
            or abs(value) > 2**53 or not math.isfinite(value):
        raise BadRequestError(f'{do}: {name}: expected a number, got {str(value)[:40]!r}')
    if do == 'speed' and not SLOWEST <= value <= FASTEST:
        raise BadRequestError(f'speed: expected {SLOWEST} to {FASTEST}, got {value:g}')
    return float(value)


def _no_constant(name: str) -> float:
    raise ValueError(name)
