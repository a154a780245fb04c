"""
Which way each behaviour goes: what a heading sense and a body's mirrors need to know of it.

A behaviour that is not listed here moves the body nowhere, as `stop` and `sit`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

#: The behaviours of a controller that does not say otherwise, in the order of its command vector.
BEHAVIOURS = ('stop', 'forward', 'backward', 'left', 'right', 'sit')


class Course(NamedTuple):
    """Direction along the body's x axis and of the turn about z, each -1, 0 or 1 (REP-103)."""

    along: float = 0.0
    turn: float = 0.0


COURSES = {'forward': Course(along=1.0), 'backward': Course(along=-1.0),
           'left': Course(turn=1.0), 'right': Course(turn=-1.0)}


def course_of(behaviour: str) -> Course:
    """Return the course of a behaviour."""
    return COURSES.get(behaviour, Course())


def holds(behaviours: Sequence[str], command: ArrayLike) -> NDArray[np.float64]:
    """
    Return (..., 2): how much of a command (..., K) holds a heading, and with which direction.

    The first is the share of behaviours that go straight, the second that share with the sign of
    their direction: 1, 1 for forward, 1, -1 for backward, 0, 0 for stop or left.
    """
    along = np.array([course_of(behaviour).along for behaviour in behaviours])
    u = np.asarray(command, dtype=np.float64)
    return np.stack([u @ np.abs(along), u @ along], axis=-1)
