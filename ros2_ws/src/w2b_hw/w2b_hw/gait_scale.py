"""A first walk in stages: how much of a gait the servos are sent, about the standing pose."""

from __future__ import annotations

from w2b_hw.safety import Pose

#: Fastest growth of the scale: from nothing to the whole gait in two seconds.
GROWTH_PER_S = 0.5


class GaitScale:
    """
    Scales poses about `centre_rad`, one angle for each joint.

    The scale grows no faster than `GROWTH_PER_S` and shrinks at once.
    """

    def __init__(self, centre_rad: Pose) -> None:
        self._centre_rad = centre_rad
        self._scale: float | None = None
        self._scaled_at_s = 0.0

    def scaled(self, pose_rad: Pose, asked: float, now_s: float) -> Pose:
        """Return `pose_rad` under the scale `asked`, 0 to 1, or as much of it as has grown."""
        if self._scale is None:
            self._scale = asked
        grown = self._scale + GROWTH_PER_S * max(0.0, now_s - self._scaled_at_s)
        self._scale, self._scaled_at_s = min(asked, grown), now_s
        if self._scale == 1.0:
            return pose_rad
        return tuple(centre + self._scale * (angle - centre)
                     for centre, angle in zip(self._centre_rad, pose_rad, strict=True))
