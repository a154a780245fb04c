"""
Sensor frames: what the body's stamped messages say, checked, and put together by their stamps.

A body reports its joints on `joint_states`, its feet on `contacts` where it has touch sensors, and
its attitude on `imu/data` where it has an IMU. One stamp makes them one frame.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from w2b_core.senses import Readings, gravity_in, heading_of

#: Parts that wait for the other part of their frame; older ones are dropped.
WAITING_PARTS = 8
#: An orientation whose length differs by more is damaged.
UNIT_TOLERANCE = 0.01
_NAMES_SHOWN = 4
_NAME_LENGTH_SHOWN = 40


class FrameError(ValueError):
    """A message that is no part of a sensor frame of this body; one line says what is wrong."""


class OtherBodyError(FrameError):
    """A message that names the joints or links of another body."""


@dataclass(frozen=True)
class Attitude:
    """Heading of the base, rate of turn about its z axis, unit vector of gravity in its axes."""

    heading_rad: float = 0.0
    yaw_rate_rad_s: float = 0.0
    gravity: tuple[float, float, float] = (0.0, 0.0, -1.0)


@dataclass(frozen=True)
class SensorFrame:
    """
    What the body senses at one instant.

    `position_rad` maps every driven joint to its angle; `touching` maps every link with a touch
    sensor to whether it touches something; the others are what an IMU measures, see
    `w2b_core.senses.Readings`.
    """

    stamp_ns: int
    position_rad: Mapping[str, float]
    touching: Mapping[str, bool]
    attitude: Attitude = field(default_factory=Attitude)

    @property
    def readings(self) -> Readings:
        """What senses read of it."""
        return Readings(self.touching, self.position_rad, {}, self.attitude.heading_rad,
                        self.attitude.yaw_rate_rad_s, self.attitude.gravity)


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
        If expected names are missing and others stand in their place; where others are ignored, at
        least half of them.
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
    twice = [name for name, count in counts.items() if count > 1 and name in wanted]
    if twice:
        raise FrameError(f'{topic}: expected each name once, got {shown(twice)} more than once')
    if unexpected and missing and (not ignore_others or len(missing) * 2 >= len(wanted)):
        raise OtherBodyError(f'{topic}: another body? expected {shown(wanted)}, '
                             f'got {shown(counts)}')
    if missing:
        raise FrameError(f'{topic}: {shown(missing)} missing')
    if unexpected and not ignore_others:
        raise FrameError(f'{topic}: unexpected {shown(unexpected)}')
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
    """
    Checks the parts of frames as they arrive, in any order, and joins those of one stamp.

    Parameters
    ----------
    joints, touch_links
        Names that `joint_states` and `contacts` must hold; no contacts are needed without links.
    imu
        Whether frames need `imu/data`.

    """

    def __init__(self, joints: Sequence[str], touch_links: Sequence[str], *,
                 imu: bool = False) -> None:
        self._joints = tuple(joints)
        self._touch_links = tuple(touch_links)
        self._parts: dict[str, dict[int, Any]] = {
            'joint_states': {}, **({'contacts': {}} if touch_links else {}),
            **({'imu/data': {}} if imu else {})}

    def joint_states(self, stamp_ns: int, names: Sequence[str],
                     position_rad: Sequence[float]) -> SensorFrame | None:
        """Take a `joint_states` message; return the frame if this completes it (FrameError)."""
        _check_stamp('joint_states', stamp_ns)
        return self._keep('joint_states', stamp_ns, named_values(
            'joint_states', names, position_rad, self._joints, ignore_others=True))

    def contacts(self, stamp_ns: int, names: Sequence[str],
                 touching: Sequence[float]) -> SensorFrame | None:
        """Take a `contacts` message; return the frame if this completes it (FrameError)."""
        if 'contacts' not in self._parts:
            return None
        _check_stamp('contacts', stamp_ns)
        values = named_values('contacts', names, touching, self._touch_links, ignore_others=True)
        for name, value in values.items():
            if value not in (0.0, 1.0):
                raise FrameError(f'contacts: expected 0 or 1, got {value} for {name}')
        return self._keep('contacts', stamp_ns,
                          {name: value == 1.0 for name, value in values.items()})

    def imu(self, stamp_ns: int, orientation_xyzw: Sequence[float] | None,
            angular_velocity_rad_s: Sequence[float]) -> SensorFrame | None:
        """
        Take an `imu/data` message; return the frame if this completes it (FrameError).

        `orientation_xyzw` is None while the orientation is not known (REP-145).
        """
        if 'imu/data' not in self._parts:
            return None
        _check_stamp('imu/data', stamp_ns)
        if orientation_xyzw is None:
            raise FrameError('imu/data: no orientation yet: the filter has not settled')
        for name, values in (('orientation', orientation_xyzw),
                             ('angular_velocity', angular_velocity_rad_s)):
            if not all(map(math.isfinite, values)):
                raise FrameError(f'imu/data: expected finite numbers, got {tuple(values)} '
                                 f'for {name}')
        length = math.hypot(*orientation_xyzw)
        if abs(length - 1.0) > UNIT_TOLERANCE:
            raise FrameError('imu/data: expected an orientation of unit length, '
                             f'got a length of {length:.4g}')
        return self._keep('imu/data', stamp_ns, Attitude(
            heading_of(orientation_xyzw), float(angular_velocity_rad_s[2]),
            gravity_in(orientation_xyzw)))

    @property
    def missing(self) -> str:
        """The topics whose parts of the frames do not come, empty if none is missed."""
        silent = [topic for topic, parts in self._parts.items() if not parts]
        return '' if len(silent) == len(self._parts) else ' and '.join(silent)

    def _keep(self, topic: str, stamp_ns: int, part: object) -> SensorFrame | None:
        waiting = self._parts[topic]
        waiting.pop(stamp_ns, None)
        waiting[stamp_ns] = part
        while len(waiting) > WAITING_PARTS:
            del waiting[next(iter(waiting))]
        if not all(stamp_ns in parts for parts in self._parts.values()):
            return None
        whole = {topic: parts.pop(stamp_ns) for topic, parts in self._parts.items()}
        return SensorFrame(stamp_ns, whole['joint_states'], whole.get('contacts', {}),
                           whole.get('imu/data', Attitude()))


def _check_stamp(topic: str, stamp_ns: int) -> None:
    if stamp_ns <= 0:
        raise FrameError(f'{topic}: expected a stamp after 0, got {stamp_ns / 1e9:g} s')
