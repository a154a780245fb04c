"""Which joint targets are accepted: whole, finite, of this robot, and fresh."""

from __future__ import annotations

from collections.abc import Sequence

from w2b_core.sensor_frames import FrameError, named_values
from w2b_hw.joints import JOINTS
from w2b_hw.safety import Pose


class TargetRefusedError(ValueError):
    """A target that does not move the robot; one line says why."""


class TargetGate:
    """
    Checks targets as they arrive.

    A target carries the stamp of the sensor frame that it answers, so its age is that of what
    the brain knew. `max_age_s` is the time in which an answer must come.
    """

    def __init__(self, max_age_s: float = 0.150) -> None:
        self._max_age_s = max_age_s
        self._last_stamp_ns = 0
        self.accepted = 0
        self.refused = 0

    def check(self, names: Sequence[str], points: Sequence[Sequence[float]], stamp_ns: int,
              now_ns: int) -> Pose:
        """
        Return the angles in the order of `joints.JOINTS`.

        Parameters
        ----------
        names, points
            Of the trajectory message: joints, and the positions of each point in rad.
        stamp_ns, now_ns
            Its stamp, and the time on the same clock.

        Raises
        ------
        TargetRefusedError
            If it has not exactly one point, joints are missing, unknown or repeated, an angle is
            not finite, or the stamp is in the future, too old, or not later than the last one's.

        """
        try:
            pose = self._checked(names, points, stamp_ns, now_ns)
        except TargetRefusedError:
            self.refused += 1
            raise
        self._last_stamp_ns = stamp_ns
        self.accepted += 1
        return pose

    def _checked(self, names: Sequence[str], points: Sequence[Sequence[float]], stamp_ns: int,
                 now_ns: int) -> Pose:
        if len(points) != 1:
            raise TargetRefusedError(f'joint_trajectory: expected 1 point, got {len(points)}')
        try:
            values = named_values('joint_trajectory', names, points[0], JOINTS)
        except FrameError as error:
            raise TargetRefusedError(str(error)) from None
        age_s = (now_ns - stamp_ns) / 1e9
        if age_s < 0:
            raise TargetRefusedError(f'joint_trajectory: stamped {-age_s:.3f} s in the future')
        if age_s > self._max_age_s:
            raise TargetRefusedError(f'joint_trajectory: {age_s:.3f} s old, '
                                     f'expected at most {self._max_age_s:.3f} s')
        if self._last_stamp_ns > now_ns:
            # The clock was set back, as a Pi's is when it finds the network: no last one to go by.
            self._last_stamp_ns = 0
        if stamp_ns <= self._last_stamp_ns:
            raise TargetRefusedError('joint_trajectory: not later than the last one')
        return tuple(values[joint] for joint in JOINTS)
