"""
What of a trajectory message a body executes as it is written, and what it refuses.

A body goes to one pose at once, as fast as its servos and its slew limit let it, until the next
frame. A trajectory that asks for anything else would be executed otherwise than it says: it is
refused with the reason.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from w2b_core.sensor_frames import shown

NS_PER_S = 1_000_000_000
#: How much later than the next frame a pose may be due: rounding, not intent.
_ROUNDING_S = 1e-6


class TrajectoryError(ValueError):
    """A trajectory that is not executed as it is written; one line says why."""


class Time(Protocol):
    """A time or a duration, as `builtin_interfaces` has them."""

    sec: int
    nanosec: int


class Point(Protocol):
    """A `trajectory_msgs/JointTrajectoryPoint`."""

    positions: Sequence[float]
    velocities: Sequence[float]
    accelerations: Sequence[float]
    effort: Sequence[float]
    time_from_start: Time


def nanoseconds(what: str, time: Time) -> int:
    """Return a time in nanoseconds (TrajectoryError if it is none: `nanosec` is below 1e9)."""
    if not 0 <= time.nanosec < NS_PER_S:
        raise TrajectoryError(f'{what}: expected a nanosec below 1,000,000,000, '
                              f'got {time.nanosec:,}')
    return int(time.sec) * NS_PER_S + int(time.nanosec)


def check(names: Sequence[str], points: Sequence[Point], period_s: float) -> None:
    """
    Check that a body of this control period executes the points as they are written.

    Positions are not looked at: they need the body's joints.

    Raises
    ------
    TrajectoryError
        If there is not exactly one point, its time is negative or later than the next frame, or it
        asks for velocities, accelerations or efforts. Zero velocities and accelerations, one for
        each joint, are what is done: the robot stops there.

    """
    if len(points) != 1:
        raise TrajectoryError(f'joint_trajectory: expected 1 point, got {len(points)}')
    point = points[0]
    due_s = nanoseconds('joint_trajectory: time_from_start', point.time_from_start) / NS_PER_S
    if not 0 <= due_s <= period_s + _ROUNDING_S:
        raise TrajectoryError(
            f'joint_trajectory: time_from_start: expected 0 to {period_s:g} s, the time of a '
            f'frame, for a body goes to a pose at once; got {due_s:g} s')
    for field, values in (('velocities', point.velocities),
                          ('accelerations', point.accelerations)):
        if len(values) not in (0, len(names)):
            raise TrajectoryError(f'joint_trajectory: {field}: expected none or one for each of '
                                  f'{len(names)} joints, got {len(values)}')
        asked = [f'{name} {value:g}' for name, value in zip(names, values, strict=False)
                 if value]
        if asked:
            raise TrajectoryError(f'joint_trajectory: {field}: expected none or zeros, for only '
                                  f'positions are followed; got {shown(asked)}')
    if len(point.effort):
        raise TrajectoryError('joint_trajectory: effort: expected none, for only positions are '
                              f'followed; got {len(point.effort)} values')
