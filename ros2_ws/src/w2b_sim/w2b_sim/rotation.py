"""Turning vectors from the world's frame into a body's."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def into_body(orientation_xyzw: Array, vector: Array) -> Array:
    """Return a world-frame vector (3,) in the frame of a body with this unit quaternion."""
    axis, scalar = -np.asarray(orientation_xyzw[:3]), float(orientation_xyzw[3])
    twice_cross = 2.0 * np.cross(axis, vector)
    turned: Array = vector + scalar * twice_cross + np.cross(axis, twice_cross)
    return turned
