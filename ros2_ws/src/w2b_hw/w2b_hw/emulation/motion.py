"""What an emulated IMU feels: one motion, shared by the chips on the board."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from time import monotonic

Vector = tuple[float, float, float]


@dataclass
class Motion:
    """
    The true motion of the board, in its frame (x forward, y left, z up).

    Attributes
    ----------
    acceleration_m_s2
        Specific force: +9.80665 along z when it lies still.
    angular_velocity_rad_s, field_t
        Rotation, and the magnetic field (north along x, dip 63 degrees).
    clock
        Seconds; the parts take their samples by it.

    """

    acceleration_m_s2: Vector = (0.0, 0.0, 9.80665)
    angular_velocity_rad_s: Vector = (0.0, 0.0, 0.0)
    field_t: Vector = (22e-6, 0.0, -43e-6)
    clock: Callable[[], float] = monotonic


def noise_lsb(sample: int, axis: int) -> int:
    """Return -2..2, the same for the same sample and axis: a sensor at rest is never constant."""
    mixed = (sample * 2654435761 + axis * 40503 + 12345) & 0xFFFFFFFF
    return ((mixed >> 13) ^ (mixed >> 7)) % 5 - 2


def to_int16(value: float) -> int:
    """Round and saturate, as the parts do."""
    return max(-32768, min(32767, round(value)))
