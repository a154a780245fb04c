"""
Sensor frames: what the body's stamped messages say, checked, and put together by their stamps.

A body reports its joints on `joint_states` and, where it has touch sensors, its feet on `contacts`;
both are named vectors, and one stamp makes them one frame.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

T = TypeVar('T')
#: Parts that wait for the other part of their frame; older ones are dropped.
WAITING_PARTS = 8
_NAMES_SHOWN = 4
_NAME_LENGTH_SHOWN = 40


class FrameError(ValueError):
    """A message that is no part of a sensor frame of this body; one line says what is wrong."""


class OtherBodyError(FrameError):
    """A message that names the joints or links of another body."""


@dataclass(frozen=True)
class SensorFrame:
    """
    What the body senses at one instant.

    `position_rad` maps every driven joint to its angle; `touching` maps every link with a touch
    sensor to whether it touches something.
    """

    stamp_ns: int
    position_rad: Mapping[str, float]
    touching: Mapping[str, bool]


def named_values(topic: str, names: Sequence[str], values: Sequence[float],
                 expected: Iterable[str], *, ignore_others: bool = False) -> dict[str, float]:
    """
    Return the values by name, in the order of `expected`.

    Parameters
    ----------
    topic
        Begins every error.
    names, values
        As the message has them.
    expected
        The names that are needed.
    ignore_others
        Ignore the values of other names, as of joints that this body has and the controller does
        not drive; else they are refused.

    Raises
    ------
    OtherBodyError
        If at least half of the expected names are missing and others stand in their place.
    FrameError
        If lengths differ, names repeat, are missing or are too many, or a value is not finite.

    """
    if len(names) != len(values):
        raise FrameError(f'{topic}: expected one position for each name, '
                         f'got {len(names)} names and {len(values)} positions')
    wanted = dict.fromkeys(expected)
    counts = Counter(names)
    unexpected = [name for name in counts if name not in wanted]
    missing = [name for name in wanted if name not in counts]
    if unexpected and missing and len(missing) * 2 >= len(wanted):
        raise OtherBodyError(f'{topic}: another body? expected {shown(wanted)}, '
                             f'got {shown(counts)}')
    if missing:
        raise FrameError(f'{topic}: {shown(missing)} missing')
    if unexpected and not ignore_others:
        raise FrameError(f'{topic}: unexpected {shown(unexpected)}')
    twice = [name for name, count in counts.items() if count > 1 and name in wanted]
    if twice:
        raise FrameError(f'{topic}: expected each name once, got {shown(twice)} more than once')
    given = {name: float(value) for name, value in zip(names, values, strict=True)
             if name in wanted}
    for name, value in given.items():
        if not math.isfinite(value):
            raise FrameError(f'{topic}: expected finite numbers, got {value} for {name}')
    return {name: given[name] for name in wanted}


def shown(names: Iterable[str]) -> str:
    """Return the first few names, cut short, for an error message of one line."""
    listed = list(names)
    head = [repr(name[:_NAME_LENGTH_SHOWN])[1:-1] for name in listed[:_NAMES_SHOWN]]
    rest = len(listed) - len(head)
    return ', '.join(head) + (f' and {rest} more' if rest else '') if listed else 'none'


class FrameAssembler:
    """Checks the parts of frames as they arrive, in any order, and joins those of one stamp."""

    def __init__(self, joints: Sequence[str], touch_links: Sequence[str]) -> None:
        self._joints = tuple(joints)
        self._touch_links = tuple(touch_links)
        self._positions: dict[int, dict[str, float]] = {}
        self._contacts: dict[int, dict[str, bool]] = {}

    def joint_states(self, stamp_ns: int, names: Sequence[str],
                     position_rad: Sequence[float]) -> SensorFrame | None:
        """Take a `joint_states` message; return the frame if this completes it (FrameError)."""
        _check_stamp('joint_states', stamp_ns)
        positions = named_values('joint_states', names, position_rad, self._joints,
                                 ignore_others=True)
        if not self._touch_links:
            return SensorFrame(stamp_ns, positions, {})
        _keep(self._positions, stamp_ns, positions)
        return self._joined(stamp_ns)

    def contacts(self, stamp_ns: int, names: Sequence[str],
                 touching: Sequence[float]) -> SensorFrame | None:
        """Take a `contacts` message; return the frame if this completes it (FrameError)."""
        if not self._touch_links:
            return None
        _check_stamp('contacts', stamp_ns)
        values = named_values('contacts', names, touching, self._touch_links, ignore_others=True)
        for name, value in values.items():
            if value not in (0.0, 1.0):
                raise FrameError(f'contacts: expected 0 or 1, got {value} for {name}')
        _keep(self._contacts, stamp_ns, {name: value == 1.0 for name, value in values.items()})
        return self._joined(stamp_ns)

    @property
    def missing(self) -> str:
        """The topic whose half of the frames does not come, empty if none is missed."""
        if bool(self._positions) == bool(self._contacts):
            return ''
        return 'contacts' if self._positions else 'joint_states'

    def _joined(self, stamp_ns: int) -> SensorFrame | None:
        if stamp_ns not in self._positions or stamp_ns not in self._contacts:
            return None
        return SensorFrame(stamp_ns, self._positions.pop(stamp_ns), self._contacts.pop(stamp_ns))


def _check_stamp(topic: str, stamp_ns: int) -> None:
    if stamp_ns <= 0:
        raise FrameError(f'{topic}: expected a stamp after 0, got {stamp_ns / 1e9:g} s')


def _keep(parts: dict[int, T], stamp_ns: int, part: T) -> None:
    parts.pop(stamp_ns, None)
    parts[stamp_ns] = part
    while len(parts) > WAITING_PARTS:
        del parts[next(iter(parts))]
