"""Orientation from samples, by imufusion (x-io's revised Madgwick filter)."""

from __future__ import annotations

from math import degrees, radians

import imufusion
import numpy as np

from w2b_hw.imu.gyroscope_bias import GyroscopeBias
from w2b_hw.imu.part import STANDARD_GRAVITY_M_S2, Sample

#: x east, y north, z up: REP-103.
_CONVENTION = imufusion.CONVENTION_ENU
_GAIN = 0.5
_REJECTION_DEG = 10.0
_REJECTION_TIMEOUT_S = 5.0
#: Roll and pitch against gravity, yaw against the magnetic field: typical of such parts, rad^2.
TILT_VARIANCE = radians(2.0) ** 2
HEADING_VARIANCE = radians(10.0) ** 2
#: Yaw without a magnetometer drifts without bound.
NO_HEADING_VARIANCE = 1e3


class Orientation:
    """
    The filter.

    Parameters
    ----------
    rate_hz
        Samples a second.
    gyroscope_range_dps
        Beyond it the filter does not trust the gyroscope.
    use_magnetometer
        Off by default: twelve servos beside the part bend the field, and an uncalibrated
        magnetometer turns the whole estimate.

    """

    def __init__(self, rate_hz: float, gyroscope_range_dps: float,
                 use_magnetometer: bool = False) -> None:
        self._use_magnetometer = use_magnetometer
        #: Of the gyroscope, learnt while the robot stands.
        self.bias = GyroscopeBias(rate_hz)
        self._ahrs = imufusion.Ahrs()
        settings = imufusion.AhrsSettings(
            sample_rate=rate_hz, gain=_GAIN, gyroscope_range=gyroscope_range_dps,
            acceleration_rejection=_REJECTION_DEG, magnetic_rejection=_REJECTION_DEG,
            rejection_timeout=_REJECTION_TIMEOUT_S)
        # Set afterwards: the constructor of imufusion 1.3.3 ignores this one.
        settings.convention = _CONVENTION
        self._ahrs.set_settings(settings)

    @property
    def yaw_variance(self) -> float:
        """Variance of the rotation about the vertical, rad^2."""
        return HEADING_VARIANCE if self._use_magnetometer else NO_HEADING_VARIANCE

    def update(self, sample: Sample, elapsed_s: float) -> tuple[float, float, float, float]:
        """Take a sample, so long after the last; return the quaternion x, y, z, w."""
        rate_dps = np.array([degrees(value) for value in self.bias.corrected(sample)])
        force_g = np.array(sample.acceleration_m_s2) / STANDARD_GRAVITY_M_S2
        self._ahrs.set_sample_period(elapsed_s)
        if self._use_magnetometer and sample.field_t is not None:
            self._ahrs.update(rate_dps, force_g, np.array(sample.field_t))
        else:
            self._ahrs.update_no_magnetometer(rate_dps, force_g)
        w, x, y, z = (float(value) for value in self._ahrs.get_quaternion())
        return x, y, z, w
