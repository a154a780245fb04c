"""
Which way each behaviour goes: what a heading sense and a body's mirrors need to know of it.

The course of a behaviour is part of its entry in `w2b_core.behaviours`, and of a controller file.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray


class Course(NamedTuple):
    """Direction along the body's x axis and of the turn about z, each -1, 0 or 1 (REP-103)."""

    along: float = 0.0
    turn: float = 0.0


#: The course of a behaviour that is registered nowhere.
NOWHERE = Course()


def held(courses: Sequence[Course], command: ArrayLike) -> NDArray[np.float64]:
    """
    Return (..., 2): how much of a command (..., K) holds a heading, and with which direction.

    The first is the share of behaviours that go straight, the second that share with the sign of
    their direction: 1, 1 for forward, 1, -1 for backward, 0, 0 for stop or left.
    """
    along = np.array([course.along for course in courses])
    u = np.asarray(command, dtype=np.float64)
    return np.stack([u @ np.abs(along), u @ along], axis=-1)
