"""What an IMU part is to the rest: something found by its identity that gives samples."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from w2b_hw.i2c import Transport

Vector = tuple[float, float, float]
STANDARD_GRAVITY_M_S2 = 9.80665
#: Identical raw bytes in so many samples in a row: noise never does that, a hung part does.
FROZEN_AFTER = 3


class ImuError(RuntimeError):
    """No usable sample, or no usable part; one line says why."""


@dataclass(frozen=True)
class Sample:
    """
    What the part felt since the last one, in the board's frame.

    A part that measures more often than it is read averages: one measurement a frame would alias
    the gait into a drift of the heading. `acceleration_m_s2` is the specific force (+9.81 along z
    at rest), `field_t` the magnetic field or None if no new one was ready.
    """

    acceleration_m_s2: Vector
    angular_velocity_rad_s: Vector
    field_t: Vector | None


class Part(Protocol):
    """A driver of one kind of IMU. Variances are those of one sample, from its data sheet."""

    name: ClassVar[str]
    addresses: ClassVar[tuple[int, ...]]
    who_am_i_register: ClassVar[int]
    who_am_i: ClassVar[int]
    acceleration_variance: ClassVar[float]
    angular_velocity_variance: ClassVar[float]
    field_variance: ClassVar[float]
    gyroscope_range_dps: ClassVar[float]

    def __init__(self, transport: Transport, address: int) -> None: ...

    def configure(self) -> None:
        """Reset the part and set it up (OSError, ImuError)."""

    def read(self) -> Sample:
        """Return a new sample (OSError; ImuError if there is none or the part lost its setup)."""


class FrozenCheck:
    """Notices a part that repeats itself."""

    def __init__(self) -> None:
        self._last = b''
        self._times = 0

    def check(self, raw: bytes) -> None:
        """Take the raw bytes of a sample (ImuError if they are the same too often)."""
        self._times = self._times + 1 if raw == self._last else 1
        self._last = raw
        if self._times >= FROZEN_AFTER:
            raise ImuError(f'frozen: {self._times} samples with the same bits')


def scaled(words: tuple[int, ...], scale: float) -> Vector:
    """Return three raw words in units."""
    x, y, z = words
    return x * scale, y * scale, z * scale


def mean_rate_rad_s(rates_rad_s: NDArray[np.float64], period_s: float) -> Vector:
    """
    Return the steady rate that turns as far as `rates_rad_s` (N, 3), each of them for `period_s`.

    Turns about different axes do not add up: beside the mean there is the coning correction of
    strapdown navigation (Savage 1998, Strapdown Inertial Navigation, part 1, equation 47).
    """
    turned = np.cumsum(rates_rad_s, axis=0) - rates_rad_s
    coning = np.cross(turned, rates_rad_s).sum(axis=0) * (0.5 * period_s)
    x, y, z = ((rates_rad_s.sum(axis=0) + coning) / len(rates_rad_s)).tolist()
    return x, y, z
