"""What an IMU in the base feels: one piece of code for all engines that move step by step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_TINY_RAD = 1e-12


@dataclass(frozen=True)
class Inertial:
    """
    Measured without noise, in the base's axes, averaged over the time that the simulation last
    advanced by: a control period, as the robot averages all samples since its last frame. One
    sample a frame would alias the gait into a drift of the heading.

    `specific_force_m_s2` (3,) is what an accelerometer at the base's origin shows (upwards at
    rest), `angular_velocity_rad_s` (3,) what a gyroscope shows.
    """

    specific_force_m_s2: Array
    angular_velocity_rad_s: Array


@dataclass(frozen=True)
class BaseMotion:
    """Rotation matrix (3, 3) of the base and the world-frame velocity (3,) of its origin."""

    turn: Array
    velocity_m_s: Array


def at_rest(turn: Array, gravity_m_s2: float) -> Inertial:
    """Return what is felt at rest by a base turned by the matrix `turn` (3, 3)."""
    return Inertial(-gravity_m_s2 * turn[2], np.zeros(3))


def between(before: BaseMotion, after: BaseMotion, elapsed_s: float, gravity_m_s2: float
            ) -> Inertial:
    """Return the mean of what is felt between two moments."""
    force = (after.velocity_m_s - before.velocity_m_s) / elapsed_s
    force[2] -= gravity_m_s2
    rate = rotation_vector(before.turn.T @ after.turn) / elapsed_s
    return Inertial((before.turn.T + after.turn.T) @ force / 2, rate)


def rotation_vector(turn: Array) -> Array:
    """Return axis times angle (3,) of a rotation matrix (3, 3) of less than half a turn."""
    twice_sine = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0],
                           turn[1, 0] - turn[0, 1]])
    length = float(np.linalg.norm(twice_sine))
    if length < _TINY_RAD:
        return twice_sine / 2
    angle = float(np.arctan2(length, np.trace(turn) - 1))
    vector: Array = twice_sine * (angle / length)
    return vector


def matrix(orientation_xyzw: Array) -> Array:
    """Return the rotation matrix (3, 3) of a unit quaternion x, y, z, w."""
    x, y, z, w = (float(value) for value in orientation_xyzw)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])
