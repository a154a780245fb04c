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
#: Yaw without a magnetometer drifts without bound; so it does without a fresh field.
NO_HEADING_VARIANCE = 1e3
FIELD_FRESH_S = 1.0
#: After a longer gap between samples the orientation is not known any more.
LONGEST_GAP_PERIODS = 3.5
#: The filter has settled when its start-up is over and gravity agreed with it for so long.
_AGREES_FOR_S = 0.25
_STEADY_G = 0.15
#: What a gyroscope alone drifts by: zero-rate level of such parts, uncalibrated.
_DRIFT_RAD_S = radians(1.0)


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
        self._period_s = 1.0 / rate_hz
        self._agreed_s = 0.0
        self._unlevelled_s = 0.0
        self._field_age_s = float('inf')
        self.settled = False

    @property
    def tilt_variance(self) -> float:
        """Variance of roll and pitch, rad^2: it grows while gravity cannot be seen."""
        return TILT_VARIANCE + (_DRIFT_RAD_S * self._unlevelled_s) ** 2

    @property
    def yaw_variance(self) -> float:
        """Variance of the rotation about the vertical, rad^2: large without a fresh field."""
        return HEADING_VARIANCE if self._field_age_s <= FIELD_FRESH_S else NO_HEADING_VARIANCE

    def restart(self) -> None:
        """Forget the orientation: samples were missing, and the robot may have been turned."""
        self._ahrs.restart()
        self.bias.restart()
        self._agreed_s = self._unlevelled_s = 0.0
        self._field_age_s = float('inf')
        self.settled = False

    def update(self, sample: Sample, elapsed_s: float) -> tuple[float, float, float, float] | None:
        """
        Take a sample, so long after the last; return the quaternion x, y, z, w.

        After the start, and after a gap of more than `LONGEST_GAP_PERIODS`, it is None until the
        filter has settled.
        """
        if not 0.0 < elapsed_s <= LONGEST_GAP_PERIODS * self._period_s:
            self.restart()
            elapsed_s = self._period_s
        rate_dps = np.array([degrees(value) for value in self.bias.corrected(sample)])
        force_g = np.array(sample.acceleration_m_s2) / STANDARD_GRAVITY_M_S2
        field_t = sample.field_t if self._use_magnetometer else None
        self._ahrs.set_sample_period(elapsed_s)
        if field_t is None:
            self._ahrs.update_no_magnetometer(rate_dps, force_g)
        else:
            self._ahrs.update(rate_dps, force_g, np.array(field_t))
        self._judge(float(np.linalg.norm(force_g)), field_t is not None, elapsed_s)
        if not self.settled:
            return None
        w, x, y, z = (float(value) for value in self._ahrs.get_quaternion())
        return x, y, z, w

    def _judge(self, force_g: float, has_field: bool, elapsed_s: float) -> None:
        """Say how well the last samples agree with the estimate."""
        states = self._ahrs.get_internal_states()
        level = (not states.accelerometer_ignored and states.acceleration_error <= _REJECTION_DEG
                 and abs(force_g - 1.0) <= _STEADY_G)
        self._unlevelled_s = 0.0 if level else self._unlevelled_s + elapsed_s
        heading = (has_field and not states.magnetometer_ignored
                   and states.magnetic_error <= _REJECTION_DEG)
        self._field_age_s = 0.0 if heading else self._field_age_s + elapsed_s
        if not self.settled and not self._ahrs.get_flags().startup:
            self._agreed_s = self._agreed_s + elapsed_s if level else 0.0
            self.settled = self._agreed_s >= _AGREES_FOR_S
