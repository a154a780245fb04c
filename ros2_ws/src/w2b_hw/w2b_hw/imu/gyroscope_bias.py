"""
The bias of a gyroscope: what it shows at rest, learnt while the robot stands.

Without a magnetometer it is all that makes a heading drift: 0.01 rad/s are 34 degrees in a minute.
imufusion's own estimate (`Bias`) begins after its stationary period and then takes half a minute;
a robot that stood for five seconds is to know it.
"""

from __future__ import annotations

from collections import deque

import numpy as np

from w2b_hw.imu.part import Sample, Vector

#: At rest for so long, and the mean of that is the bias.
REST_S = 5.0
#: At rest no axis ranges over more: ten times the parts' noise, a tenth of a slow step's.
RATE_RANGE_RAD_S = 0.03
ACCELERATION_RANGE_M_S2 = 0.5
#: Zero-rate level of the parts (ICM-20948: 5 dps); what turns faster turns in truth.
LARGEST_BIAS_RAD_S = 0.1


class GyroscopeBias:
    """
    Learns the bias from samples, and takes it off them.

    Parameters
    ----------
    rate_hz
        Samples a second.

    """

    def __init__(self, rate_hz: float) -> None:
        self._rest: deque[tuple[float, ...]] = deque(maxlen=max(2, round(REST_S * rate_hz)))
        #: Of each axis; zeros until the robot has rested.
        self.rad_s: Vector = (0.0, 0.0, 0.0)
        #: Whether it was learnt since the start.
        self.known = False

    def restart(self) -> None:
        """Samples were missing: rest begins anew. What was learnt stays."""
        self._rest.clear()

    def corrected(self, sample: Sample) -> Vector:
        """Take a sample; return its angular velocity without the bias."""
        self._rest.append((*sample.angular_velocity_rad_s, *sample.acceleration_m_s2))
        if len(self._rest) == self._rest.maxlen:
            self._learn(np.array(self._rest))
        x, y, z = (float(rate - bias) for rate, bias in
                   zip(sample.angular_velocity_rad_s, self.rad_s, strict=True))
        return x, y, z

    def _learn(self, window: np.ndarray) -> None:
        ranges, mean = np.ptp(window, axis=0), window[:, :3].mean(axis=0)
        if (ranges[:3].max() <= RATE_RANGE_RAD_S and np.abs(mean).max() <= LARGEST_BIAS_RAD_S
                and ranges[3:].max() <= ACCELERATION_RANGE_M_S2):
            x, y, z = (float(value) for value in mean)
            self.rad_s, self.known = (x, y, z), True
