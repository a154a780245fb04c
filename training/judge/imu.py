"""A simulated IMU in the base: noise and bias of the LSM6DSOX, and the robot's own filter."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from w2b_hw.imu.lsm6dsox_lis3mdl import Lsm6dsoxLis3mdl as Part
from w2b_hw.imu.orientation import Orientation
from w2b_hw.imu.part import STANDARD_GRAVITY_M_S2, Sample
from w2b_sim.engines.interface import Frame

Array = NDArray[np.float64]


class SimulatedImu:
    """
    What the hardware node would know of the attitude: each frame has the mean since the last one.

    Parameters
    ----------
    period_s
        Between two frames.
    gyro_bias_rad_s
        Of each axis.
    seed
        Of the noise.
    noise
        Whether there is any.
    gravity_m_s2
        Of the world. Where it is not the earth's, accelerations count as shares of it: the filter
        knows the vertical by its weight of 1 g.

    """

    def __init__(self, period_s: float, gyro_bias_rad_s: tuple[float, float, float], seed: int,
                 noise: bool = True, gravity_m_s2: float = -STANDARD_GRAVITY_M_S2) -> None:
        self._rng = np.random.default_rng(seed)
        self._period_s = period_s
        self._bias = np.array(gyro_bias_rad_s)
        self._sigmas = np.sqrt([Part.acceleration_variance, Part.angular_velocity_variance]) * noise
        self._weight = STANDARD_GRAVITY_M_S2 / abs(gravity_m_s2)
        self._filter = Orientation(1.0 / period_s, Part.gyroscope_range_dps)
        self._orientation = np.array([0.0, 0.0, 0.0, 1.0])

    def attitude(self, frame: Frame) -> tuple[Array, float]:
        """Return the filter's orientation x, y, z, w, and the measured rate about z."""
        force = (frame.imu.specific_force_m_s2 * self._weight
                 + self._rng.normal(size=3) * self._sigmas[0])
        rate = (frame.imu.angular_velocity_rad_s + self._bias
                + self._rng.normal(size=3) * self._sigmas[1])
        estimate = self._filter.update(
            Sample(_vector(force), _vector(rate), None), self._period_s)
        if estimate is not None:
            self._orientation = np.array(estimate)
        return self._orientation, float(rate[2])


def _vector(values: Array) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z
