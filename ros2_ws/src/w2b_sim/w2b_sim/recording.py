"""The recording of a walk, the same for every engine, and the outcome computed from it."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from w2b_core.outcome import REVERSAL_RAD, Motion, Outcome

Array = NDArray[np.float64]

#: Time that a robot has to begin what a phase asks for; at most a third of the phase.
SETTLE_S = 1.0


@dataclass(frozen=True)
class Recording:
    """
    Frames of one walk, or of a batch of them: the state before each control period.

    Attributes
    ----------
    period_s
        Between two frames.
    position_m: shape (..., T, 3)
        Of the base's origin.
    orientation_wxyz: shape (..., T, 4)
    yaw_rate_rad_s: shape (..., T)
        Mean rate of turn about the base's z axis since the last frame.
    joint_position_rad, target_rad: shape (..., T, J)
        Angles, and those that the servos were sent in the period that begins with the frame.
    touching: shape (..., T, touch sensors)
    torque_nm: shape (..., T, J)
        Mean magnitude in the period that ends with the frame; NaN where an engine cannot say.
    limited: shape (..., T, J)
        Share of the period that ends with the frame for which the servo asked for more than its
        greatest speed.

    """

    period_s: float
    position_m: NDArray
    orientation_wxyz: NDArray
    yaw_rate_rad_s: NDArray
    joint_position_rad: NDArray
    target_rad: NDArray
    touching: NDArray
    torque_nm: NDArray
    limited: NDArray

    @property
    def frames(self) -> int:
        """Number of frames, T."""
        return int(self.position_m.shape[-2])

    def take(self, index: object) -> Recording:
        """Return the recordings at `index` of the leading axes."""
        return Recording(self.period_s, *(getattr(self, field.name)[index]
                                          for field in fields(self)[1:]))

    @property
    def yaw_rad(self) -> Array:
        """Heading (..., T), which turns on past a full turn."""
        w, x, y, z = np.moveaxis(self.orientation_wxyz.astype(np.float64), -1, 0)
        yaw: Array = np.unwrap(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)), axis=-1)
        return yaw

    @property
    def upright(self) -> Array:
        """Cosine (..., T) between the base's z axis and the vertical."""
        _w, x, y, _z = np.moveaxis(self.orientation_wxyz.astype(np.float64), -1, 0)
        return 1 - 2 * (x * x + y * y)

    @property
    def path_length_m(self) -> Array:
        """Length (...) of the base's path in x-y."""
        length: Array = self._steps_m().sum(-1)
        return length

    @property
    def largest_step_m(self) -> Array:
        """Longest displacement (...) of the base in x-y between two frames."""
        longest: Array = self._steps_m().max(-1, initial=0.0)
        return longest

    def _steps_m(self) -> Array:
        place = self.position_m[..., :2].astype(np.float64)
        steps: Array = np.linalg.norm(np.diff(place, axis=-2), axis=-1)
        return steps


def outcome(recording: Recording) -> Outcome:
    """Return every figure of recordings (C, W, K, T, ...), or of one (T, ...), without axes."""
    place = recording.position_m.astype(np.float64)
    yaw, moving = recording.yaw_rad, np.s_[..., min(1, recording.frames - 1):, :]
    return Outcome(
        final_position_m=place[..., -1, :], path_length_m=recording.path_length_m,
        largest_step_m=recording.largest_step_m,
        touch_fraction=recording.touching.astype(np.float64).mean(-2),
        halfway_position_m=place[..., recording.frames // 2, :2],
        farthest_m=np.sqrt((place[..., :2]**2).sum(-1).max(-1)),
        yaw_rad=yaw[..., -1] - yaw[..., 0], lowest_height_m=place[..., 2].min(-1),
        lowest_up=recording.upright.min(-1),
        effort_nm=recording.torque_nm[moving].mean((-1, -2), dtype=np.float64),
        reversals=reversals(recording.joint_position_rad.astype(np.float64)).astype(np.float64),
        at_speed_limit=recording.limited[moving].mean((-1, -2), dtype=np.float64),
        start_height_m=place[..., 0, 2])


@dataclass(frozen=True)
class PhaseOutcome:
    """
    What a robot did in a phase; every field has the recording's leading axes (...,).

    Positions are in the axes of the heading at the phase's first frame. `going`, `turning`, `drift`
    and what follows count after `SETTLE_S`, so that one lunge is no walk.

    Attributes
    ----------
    seconds
        Length of the phase, a number.
    along_m, across_m
        Displacement along that heading and to its left.
    yaw_rad
        Change of heading, past a full turn if it is more.
    going_m_s, turning_rad_s
        Mean speed along that heading, and mean rate of turn.
    drift_m
        Farthest distance from where the robot was after settling.
    wobble_rad
        Largest deviation of the heading from a steady turn.
    rhythm_hz, fastest_joint_hz
        Reversals a joint, divided by twice the time: mean and largest over the joints.
    at_speed_limit
        Share of time at the servos' speed limit, mean over the joints.
    joint_speed_rad_s
        Mean over joints, after settling.
    torque_nm
        Mean magnitude over joints; NaN where the engine cannot say.
    height_m, lowest_m, start_height_m, final_height_m
        Of the base: mean and lowest after settling, at the first frame and at the last.
    lowest_up, tilt
        Smallest cosine between the base's z axis and the vertical; 1 less the mean one.

    """

    seconds: float
    along_m: Array
    across_m: Array
    yaw_rad: Array
    going_m_s: Array
    turning_rad_s: Array
    drift_m: Array
    wobble_rad: Array
    rhythm_hz: Array
    fastest_joint_hz: Array
    at_speed_limit: Array
    joint_speed_rad_s: Array
    torque_nm: Array
    height_m: Array
    lowest_m: Array
    start_height_m: Array
    final_height_m: Array
    lowest_up: Array
    tilt: Array

    @property
    def motion(self) -> Motion:
        """What `w2b_core.behaviours` judges of it."""
        return Motion(self.along_m, np.hypot(self.along_m, self.across_m), self.yaw_rad,
                      self.final_height_m / self.start_height_m)


def phase_outcome(recording: Recording, first: int = 0, last: int | None = None) -> PhaseOutcome:
    """
    Return what happened from frame `first` to frame `last` (the recording's last if None).

    Raises
    ------
    ValueError
        If that is not a phase of at least three frames.

    """
    last = recording.frames - 1 if last is None else last
    if not 0 <= first < last - 1 or last >= recording.frames:
        raise ValueError(f'phase: expected frames 0 <= first < last - 1 < {recording.frames - 1}, '
                         f'got {first} to {last}')
    part = slice(first, last + 1)
    place = recording.position_m[..., part, :].astype(np.float64)
    yaw = recording.yaw_rad[..., part]
    angle = recording.joint_position_rad[..., part, :].astype(np.float64)
    upright = recording.upright[..., part]
    periods = last - first
    seconds = periods * recording.period_s
    settle = min(round(SETTLE_S / recording.period_s), periods // 3)
    rest = seconds - settle * recording.period_s
    cosine, sine = np.cos(yaw[..., 0]), np.sin(yaw[..., 0])
    way = place[..., -1, :2] - place[..., 0, :2]
    going = place[..., -1, :2] - place[..., settle, :2]
    moved = place[..., settle:, :2] - place[..., settle, None, :2]
    steady = yaw[..., :1] + (yaw[..., -1:] - yaw[..., :1]) * np.linspace(0, 1, periods + 1)
    rhythm = reversals(angle) / (2 * seconds)
    speed = np.abs(np.diff(angle[..., settle:, :], axis=-2)) / recording.period_s
    torque = recording.torque_nm[..., first + 1:last + 1, :]
    return PhaseOutcome(
        seconds=seconds,
        along_m=cosine * way[..., 0] + sine * way[..., 1],
        across_m=cosine * way[..., 1] - sine * way[..., 0],
        yaw_rad=yaw[..., -1] - yaw[..., 0],
        going_m_s=(cosine * going[..., 0] + sine * going[..., 1]) / rest,
        turning_rad_s=(yaw[..., -1] - yaw[..., settle]) / rest,
        drift_m=np.sqrt((moved**2).sum(-1)).max(-1),
        wobble_rad=np.abs(yaw - steady).max(-1),
        rhythm_hz=rhythm.mean(-1), fastest_joint_hz=rhythm.max(-1),
        at_speed_limit=recording.limited[..., first + 1:last + 1, :].mean(
            (-1, -2), dtype=np.float64),
        joint_speed_rad_s=speed.mean((-1, -2)),
        torque_nm=torque.mean((-1, -2), dtype=np.float64),
        height_m=place[..., settle:, 2].mean(-1), lowest_m=place[..., settle:, 2].min(-1),
        start_height_m=place[..., 0, 2], final_height_m=place[..., -1, 2],
        lowest_up=upright.min(-1), tilt=1 - upright.mean(-1))


def reversals(path_rad: Array, least_rad: float = REVERSAL_RAD) -> NDArray[np.int64]:
    """Return the number of turning points (..., J) of paths (..., T, J), noise below aside."""
    angles = np.moveaxis(path_rad, -2, 0)
    high = low = angles[0]
    direction = np.zeros(angles.shape[1:], dtype=np.int8)
    count = np.zeros(angles.shape[1:], dtype=np.int64)
    for angle in angles[1:]:
        high = np.where(direction >= 0, np.maximum(high, angle), high)
        low = np.where(direction <= 0, np.minimum(low, angle), low)
        falls = (direction >= 0) & (angle < high - least_rad)
        rises = (direction <= 0) & (angle > low + least_rad) & ~falls
        count += (falls & (direction > 0)) | (rises & (direction < 0))
        low, high = np.where(falls, angle, low), np.where(rises, angle, high)
        direction = np.where(falls, -1, np.where(rises, 1, direction)).astype(np.int8)
    return count
