"""Rotations: fixed-axis roll, pitch and yaw (URDF, REP-103), and turns about a joint's axis."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from w2b_core.bodies.model import Vector

Array = NDArray[np.float64]


def from_rpy(rpy_rad: Sequence[float]) -> Array:
    """Return the rotation matrix (3, 3) of fixed-axis roll, pitch and yaw."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy_rad), np.sin(rpy_rad)
    return np.array([[cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
                     [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
                     [-sp, cp * sr, cp * cr]])


def from_axis_angle(axis: Array, angle_rad: float) -> Array:
    """Return the rotation matrix (3, 3) by an angle about a unit axis (3,)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turn: Array = np.eye(3) + np.sin(angle_rad) * cross + (1 - np.cos(angle_rad)) * cross @ cross
    return turn


def to_rpy(turn: Array) -> Vector:
    """Return roll, pitch and yaw of a rotation matrix (3, 3); roll is 0 where pitch is 90 deg."""
    pitch = np.arcsin(np.clip(-turn[2, 0], -1.0, 1.0))
    if np.hypot(turn[0, 0], turn[1, 0]) < 1e-9:
        return 0.0, float(pitch), float(np.arctan2(-turn[0, 1], turn[1, 1]))
    return (float(np.arctan2(turn[2, 1], turn[2, 2])), float(pitch),
            float(np.arctan2(turn[1, 0], turn[0, 0])))


def quaternion_wxyz(turn: Array) -> Array:
    """Return the unit quaternion w, x, y, z (4,) of a rotation matrix (3, 3)."""
    roll, pitch, yaw = to_rpy(turn)
    (cr, cp, cy), (sr, sp, sy) = (f(np.array([roll, pitch, yaw]) / 2) for f in (np.cos, np.sin))
    return np.array([cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy,
                     cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy])
