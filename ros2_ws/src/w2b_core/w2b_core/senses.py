"""
The senses that a network can have: one table of what each is, where it comes from, its range.

A sense is named `KIND` or `KIND:SOURCE`, such as `touch:front_lower_leg`, `gravity:x`, `heading`.
`heading` and `steer` compare the body's heading with the one that it had when the last command
came. They are felt while the command goes straight, and `steer` carries the sign of its direction,
so that the same synapse steers the body back forwards and backwards.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from w2b_core.registry import Registry

Array = NDArray[np.float64]

#: A heading error of 0.25 rad is felt in full.
HEADING_GAIN = 4.0
#: A rate of turn that is felt in full.
FULL_YAW_RATE_RAD_S = 4.0
AXES = ('x', 'y', 'z')


@dataclass(frozen=True)
class Readings:
    """
    What is measured of a robot at one frame.

    Attributes
    ----------
    touching
        Link -> 1 or 0.
    position_rad
        Joint -> angle.
    motors
        Joint -> motor neuron one step ago.
    heading_rad
        Of the base about the vertical; it may turn on past pi.
    yaw_rate_rad_s
        About the base's z axis.
    gravity: shape (3,)
        Unit vector of gravity in the base's axes.

    """

    touching: Mapping[str, float] = field(default_factory=dict)
    position_rad: Mapping[str, float] = field(default_factory=dict)
    motors: Mapping[str, float] = field(default_factory=dict)
    heading_rad: float = 0.0
    yaw_rate_rad_s: float = 0.0
    gravity: tuple[float, float, float] = (0.0, 0.0, -1.0)


@dataclass(frozen=True)
class Reference:
    """
    What the senses know of the last command.

    `heading_rad` is the heading when it came, `hold` and `direction` are those of
    `w2b_core.courses.holds`.
    """

    heading_rad: float = 0.0
    hold: float = 0.0
    direction: float = 0.0


Reader = Callable[[str, Readings, Reference], float]


@dataclass(frozen=True)
class Sense:
    """
    One kind of sense.

    Attributes
    ----------
    topic, message_field
        Where a robot measures it; empty for what the network knows by itself.
    unit
        Of what is measured.
    low, high
        Range of the number that the network hears.
    source
        What follows the colon of the name: `link`, `joint`, `axis` or nothing.
    meaning
        In words.
    read
        (source, readings, reference of the last command) -> the number that the network hears.

    """

    kind: str
    topic: str
    message_field: str
    unit: str
    low: float
    high: float
    source: str
    meaning: str
    read: Reader


def _yaw_rate(_source: str, readings: Readings, _reference: Reference) -> float:
    return float(np.clip(readings.yaw_rate_rad_s / FULL_YAW_RATE_RAD_S, -1.0, 1.0))


def _error(readings: Readings, reference: Reference) -> float:
    return float(np.clip(HEADING_GAIN * np.sin(readings.heading_rad - reference.heading_rad),
                         -1.0, 1.0))


#: Add one of your own with `SENSES.add(kind, Sense(...))` in a plugin: step-wise engines and the
#: robot read it; the batched engine refuses kinds that it does not model.
SENSES: Registry[Sense] = Registry('sense')
for _sense in (
        Sense('touch', 'contacts', 'position', '', 0.0, 1.0, 'link', 'whether the link touches',
              lambda source, readings, _: float(readings.touching[source])),
        Sense('position', 'joint_states', 'position', 'rad', -np.inf, np.inf, 'joint',
              "the joint's angle",
              lambda source, readings, _: float(readings.position_rad[source])),
        Sense('motor', '', '', '', -1.0, 1.0, 'joint', "the joint's motor neuron one step ago",
              lambda source, readings, _: float(readings.motors[source])),
        Sense('yaw_rate', 'imu/data', 'angular_velocity.z', 'rad/s', -1.0, 1.0, '',
              f"rate of turn about the base's z axis, 1 at {FULL_YAW_RATE_RAD_S:g} rad/s",
              _yaw_rate),
        Sense('gravity', 'imu/data', 'orientation', '', -1.0, 1.0, 'axis', 'component of the '
              'direction of gravity along an axis of the base: (0, 0, -1) upright',
              lambda source, readings, _: float(readings.gravity[AXES.index(source)])),
        Sense('heading', 'imu/data', 'orientation', 'rad', -1.0, 1.0, '',
              f'{HEADING_GAIN:g} sin(heading error since the command), while it goes straight',
              lambda _, readings, reference: _error(readings, reference) * reference.hold),
        Sense('steer', 'imu/data', 'orientation', 'rad', -1.0, 1.0, '',
              'heading, with the sign of the direction of the command',
              lambda _, readings, reference: _error(readings, reference) * reference.direction)):
    SENSES.add(_sense.kind, _sense)


@lru_cache(maxsize=256)
def split(sense: str) -> tuple[str, str]:
    """Return kind and source of a sense's name (ValueError if it is not one of the table)."""
    kind, colon, source = sense.partition(':')
    known = SENSES.get(kind) if kind in SENSES else None
    if (known is None or bool(colon) != bool(known.source) or bool(colon) != bool(source)
            or (known.source == 'axis' and source not in AXES)):
        forms = ', '.join(name + (f':{SENSES.get(name).source.upper()}'
                                  if SENSES.get(name).source else '') for name in SENSES)
        raise ValueError(f'sense: expected one of {forms}, got {sense!r}')
    return kind, source


def read(senses: Sequence[str], readings: Readings, reference: Reference | None = None) -> Array:
    """
    Return what the network hears (S,), in the order of `senses`.

    Without a `reference` there was no command yet, and no heading to hold.

    Raises
    ------
    KeyError
        If a link or joint that a sense names was not measured.
    ValueError
        If a name is not in the table.

    """
    found = reference or Reference()
    values = []
    for name in senses:
        kind, source = split(name)
        values.append(SENSES.get(kind).read(source, readings, found))
    return np.array(values, dtype=np.float64)


def gravity_in(orientation_xyzw: Sequence[float]) -> tuple[float, float, float]:
    """Return the unit vector of gravity in the axes of a base with this orientation."""
    x, y, z, w = (float(value) for value in orientation_xyzw)
    return 2 * (w * y - x * z), -2 * (y * z + w * x), 2 * (x * x + y * y) - 1


def heading_of(orientation_xyzw: Sequence[float]) -> float:
    """Return the heading of a base: the direction of its x axis about the vertical, rad."""
    x, y, z, w = (float(value) for value in orientation_xyzw)
    return float(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))
