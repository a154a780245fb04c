"""
Whether the robot stands on its feet: tipped over, picked up and dropped, by its IMU.

At 20 samples a second, steps as quick as the twin's fold into any acceleration and any turn; a
filter that integrates them is off by up to 40 degrees. So each cue asks for a state that no gait
has, for long enough, in the accelerometer's own mean. A robot that is lifted level while it shakes
itself is noticed when it is tilted, not before.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from math import acos, degrees, dist, hypot
from statistics import median

from w2b_hw.imu.part import STANDARD_GRAVITY_M_S2, Sample, Vector

#: Tilts, and for how long: lying, and held askew, which only a robot that is steady shows. The twin
#: stands at up to 26 degrees, and shows up to 30 while it shakes.
LYING_DEG, LYING_FOR_S = 45.0, 0.25
ASKEW_DEG, ASKEW_FOR_S = 35.0, 0.5
#: Falling: the specific force, of g, in this many samples in a row.
FALLING_G, FALLING_SAMPLES = 0.35, 4
#: Turned about by hand: the median rate over `WINDOW` samples. Gaits of the twin reach 60.
SPUN_DPS = 120.0
#: Lifted or lowered: each of the last `LIFT_SAMPLES` is off 1 g by this much, and their mean more.
LIFT_SAMPLES, LIFT_EACH_G, LIFT_MEAN_G = 5, 0.06, 0.10
#: A lift shows only in a robot that was calm before: no sample was off by more.
CALM_SAMPLES, CALM_G = 40, 0.08
#: Gravity is the mean of so many samples that differ by less than this, of g; of a second if not.
WINDOW, STEADY_G, SHAKING_WINDOW = 8, 0.15, 20
#: A robot that begins to move shakes: its joints' mean speed then is more than twice that before.
_SPEED_RAD_S = 0.2


@dataclass(frozen=True)
class _Moment:
    force_g: Vector
    rate_dps: Vector
    weight_g: float
    speed_rad_s: float


class PostureWatch:
    """
    Looks at each sample.

    Parameters
    ----------
    period_s
        Time between samples.

    """

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        self._moments: deque[_Moment] = deque(maxlen=CALM_SAMPLES + LIFT_SAMPLES)
        self._lying_s = self._askew_s = 0.0
        #: Angle between the robot's z axis and the vertical, None while it is not known.
        self.tilt_deg: float | None = None

    def restart(self) -> None:
        """Forget all samples: some were missing."""
        self._moments.clear()
        self._lying_s = self._askew_s = 0.0
        self.tilt_deg = None

    @property
    def lies(self) -> bool:
        """Whether the robot does not stand on its feet now, so that its legs must not be driven."""
        return self.tilt_deg is not None and self.tilt_deg > LYING_DEG

    def update(self, sample: Sample, speed_rad_s: float) -> str | None:
        """
        Take a sample; return what happened to the robot, None if nothing did.

        `speed_rad_s` is the mean speed of the joints as commanded.
        """
        x, y, z = (value / STANDARD_GRAVITY_M_S2 for value in sample.acceleration_m_s2)
        rates = [degrees(value) for value in sample.angular_velocity_rad_s]
        self._moments.append(_Moment((x, y, z), (rates[0], rates[1], rates[2]), hypot(x, y, z),
                                     speed_rad_s))
        return self._tilted() or self._falling() or self._spun() or self._lifted()

    def _tilted(self) -> str | None:
        forces = [moment.force_g for moment in self._moments]
        recent = forces[-WINDOW:]
        mean = _mean(recent)
        steady = (len(recent) == WINDOW and abs(hypot(*mean) - 1.0) < STEADY_G
                  and all(dist(force, mean) < STEADY_G for force in recent))
        if not steady:
            mean = _mean(forces[-SHAKING_WINDOW:])
        if (not steady and len(forces) < SHAKING_WINDOW) or hypot(*mean) < STEADY_G:
            self.tilt_deg = None
        else:
            self.tilt_deg = degrees(acos(max(-1.0, min(1.0, mean[2] / hypot(*mean)))))
        tilt, period_s = self.tilt_deg or 0.0, self._period_s
        self._lying_s = self._lying_s + period_s if tilt > LYING_DEG else 0.0
        self._askew_s = self._askew_s + period_s if steady and tilt > ASKEW_DEG else 0.0
        if self._lying_s >= LYING_FOR_S:
            return f'tipped over: it is tilted by {tilt:.0f} degrees'
        if self._askew_s >= ASKEW_FOR_S:
            return f'picked up or tipped over: it is tilted by {tilt:.0f} degrees'
        return None

    def _falling(self) -> str | None:
        recent = [hypot(*moment.force_g) for moment in self._moments][-FALLING_SAMPLES:]
        if len(recent) == FALLING_SAMPLES and max(recent) < FALLING_G:
            return f'dropped: it weighs {max(recent):.2f} g'
        return None

    def _spun(self) -> str | None:
        recent = [moment.rate_dps for moment in self._moments][-WINDOW:]
        # Not the mean: a flipped bit on the wire can be hundreds of degrees/s.
        rate = hypot(*(median(axis) for axis in zip(*recent, strict=True)))
        if len(recent) == WINDOW and rate > SPUN_DPS:
            return f'picked up: it is turned at {rate:.0f} degrees/s'
        return None

    def _lifted(self) -> str | None:
        if len(self._moments) < CALM_SAMPLES + LIFT_SAMPLES:
            return None
        before = [*self._moments][:CALM_SAMPLES]
        recent = [*self._moments][CALM_SAMPLES:]
        off = [moment.weight_g - 1.0 for moment in recent]
        mean = sum(off) / len(off)
        if (abs(mean) < LIFT_MEAN_G or min(map(abs, off)) < LIFT_EACH_G
                or any(value * mean < 0 for value in off)):
            return None
        if max(abs(moment.weight_g - 1.0) for moment in before) > CALM_G:
            return None
        # A gait that begins within the look-back is no lift, however it shakes the robot.
        speed = max(moment.speed_rad_s for moment in [*before, *recent][-CALM_SAMPLES // 2:])
        calm = sum(moment.speed_rad_s for moment in before) / len(before)
        if speed > 2 * calm + _SPEED_RAD_S:
            return None
        return f'picked up: it weighs {1 + mean:.2f} g'


def _mean(vectors: list[Vector]) -> Vector:
    x, y, z = (sum(parts) / len(vectors) for parts in zip(*vectors, strict=True))
    return x, y, z
