"""Which joint targets are accepted: whole, finite, of this robot, and fresh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from w2b_core import trajectory
from w2b_core.body_status import marked_epoch
from w2b_core.sensor_frames import FrameError, named_values
from w2b_hw.joints import JOINTS
from w2b_hw.safety import Pose

#: Between two frames of the hardware node.
FRAME_S = 0.05


class TargetRefusedError(ValueError):
    """A target that does not move the robot; one line says why."""


class Header(Protocol):
    """A `std_msgs/Header`."""

    stamp: trajectory.Time
    frame_id: str


class Trajectory(Protocol):
    """A `trajectory_msgs/JointTrajectory`."""

    header: Header
    joint_names: Sequence[str]
    points: Sequence[trajectory.Point]


@dataclass(frozen=True)
class Target:
    """
    A target that may be handed on: see `safety.Safety.take_target`.

    `counts` is whether it moves the robot now: not if it follows a word of an earlier epoch or
    answers a frame from before the arming. `stamp_ns` is that of the frame that it answers.
    """

    pose: Pose
    word_epoch: str | None
    counts: bool
    stamp_ns: int


class TargetGate:
    """
    Checks targets as they arrive.

    A target carries the stamp of the sensor frame that it answers, so its age is that of what
    the brain knew. `max_age_s` is the time in which an answer must come, `period_s` that of frames,
    `joints` the names of the robot's joints.
    """

    def __init__(self, max_age_s: float = 0.150, period_s: float = FRAME_S,
                 joints: Sequence[str] = JOINTS) -> None:
        self._joints = tuple(joints)
        self._max_age_s = max_age_s
        self._period_s = period_s
        self._last_stamp_ns = 0
        self._armed_at_ns = 0
        self.accepted = 0
        self.refused = 0

    def armed(self, now_ns: int) -> None:
        """Note that the robot was armed: answers to earlier frames move nothing."""
        self._armed_at_ns = now_ns

    def take(self, message: Trajectory, now_ns: int, epoch: str) -> Target:
        """
        Return what a message asks for.

        Parameters
        ----------
        message, now_ns
            The message, and the time on the clock of its stamp.
        epoch
            The robot's, now.

        Raises
        ------
        TargetRefusedError
            If it is not executed as it is written (`w2b_core.trajectory`), or as `check` says.

        """
        try:
            stamp_ns = trajectory.nanoseconds('joint_trajectory: stamp', message.header.stamp)
            trajectory.check(message.joint_names, message.points, self._period_s)
        except trajectory.TrajectoryError as error:
            self.refused += 1
            raise TargetRefusedError(str(error)) from None
        pose = self.check(message.joint_names, [point.positions for point in message.points],
                          stamp_ns, now_ns)
        word_epoch = marked_epoch(message.header.frame_id)
        if stamp_ns < self._armed_at_ns <= now_ns:
            # Whoever sent it; no epoch is empty.
            word_epoch = ''
        counts = word_epoch in (None, epoch)
        self.refused += not counts
        return Target(pose, word_epoch, counts, stamp_ns)

    def check(self, names: Sequence[str], points: Sequence[Sequence[float]], stamp_ns: int,
              now_ns: int) -> Pose:
        """
        Return the angles in the order of the robot's joints.

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
            values = named_values('joint_trajectory', names, points[0], self._joints)
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
        return tuple(values[joint] for joint in self._joints)
