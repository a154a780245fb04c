"""
Behaviours: what a word may ask for, what a body earns for it, and what counts as obeyed.

One entry a behaviour, used by evolution, gate, report and demo. Add one of your own with
`BEHAVIOURS.add(name, Behaviour(...))` in a plugin (see `registry`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import radians

import numpy as np
from numpy.typing import ArrayLike, NDArray

from w2b_core.courses import NOWHERE, Course, held
from w2b_core.outcome import FIGURES, Motion, Outcome, told
from w2b_core.registry import Registry

Array = NDArray[np.float64]
Truth = NDArray[np.bool_]


@dataclass(frozen=True)
class Bounds:
    """
    From where on a behaviour counts as shown; numbers, or arrays of the motion's shape.

    Attributes
    ----------
    move_m
        A move must get this far in its direction.
    still_m
        A body that stops or turns must end this close to where it began.
    turn_rad
        A turn must reach this angle.
    sit_height
        A body that sits must lower its base to this share of where it began.

    """

    move_m: float | Array
    still_m: float | Array
    turn_rad: float = radians(45)
    sit_height: float = 0.85


@dataclass(frozen=True)
class Behaviour:
    """
    What a word can ask for.

    Attributes
    ----------
    about
        One line for people.
    moves
        Whether the body leaves its place or turns: what stop words take precedence over.
    progress
        How far a `Motion` is what was asked for: metres, radians, or a share. More is better.
    obeyed
        Whether a `Motion` is what was asked for, within `Bounds`.
    earned
        What an `Outcome` is worth to evolution, (C, W, K); the progress if it is not given.
    course
        Where it takes the body: what heading senses and mirrors need to know.
    figures
        Names of `outcome.FIGURES` that it reads: evolution then has them worked out.

    """

    about: str
    moves: bool
    progress: Callable[[Motion], Array]
    obeyed: Callable[[Motion, Bounds], Truth]
    earned: Callable[[Outcome], Array] | None = None
    course: Course = NOWHERE
    figures: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check the figures (ValueError)."""
        for name in self.figures:
            if name not in FIGURES:
                raise ValueError(f'figures: expected names of {", ".join(FIGURES)}, got {name!r}')

    def worth(self, outcome: Outcome) -> Array:
        """Return what the outcome earns, (C, W, K)."""
        if self.earned is not None:
            return self.earned(outcome)
        return self.progress(outcome.motion)


BEHAVIOURS: Registry[Behaviour] = Registry('behaviour')


def _near(motion: Motion, bounds: Bounds) -> Truth:
    return np.asarray(motion.away_m) <= bounds.still_m


def _walk(sign: float, about: str) -> Behaviour:
    return Behaviour(about, True, lambda motion: sign * motion.along_m,
                     lambda motion, bounds: sign * motion.along_m >= bounds.move_m,
                     course=Course(along=sign))


def _turn(sign: float, about: str) -> Behaviour:
    def progress(motion: Motion) -> Array:
        return sign * told(motion, 'yaw_rad')

    return Behaviour(about, True, progress, lambda motion, bounds: (
        (progress(motion) >= bounds.turn_rad) & _near(motion, bounds)), course=Course(turn=sign),
        figures=('yaw_rad',))


#: The original program rewards the shortest path; the paper's text the shortest distance.
BEHAVIOURS.add('stop', Behaviour('stand still', False, lambda motion: -motion.away_m, _near,
                                 lambda outcome: -outcome.path_length_m))
BEHAVIOURS.add('forward', _walk(1.0, 'walk towards where the body faces'))
BEHAVIOURS.add('backward', _walk(-1.0, 'walk backwards'))
BEHAVIOURS.add('left', _turn(1.0, 'turn left on the spot'))
BEHAVIOURS.add('right', _turn(-1.0, 'turn right on the spot'))
BEHAVIOURS.add('sit', Behaviour(
    'lower the base and rest', False,
    lambda motion: (1.0 - told(motion, 'height')) - motion.away_m,
    lambda motion, bounds: (told(motion, 'height') <= bounds.sit_height) & _near(motion, bounds),
    lambda outcome: (1.0 - told(outcome.motion, 'height')) - outcome.path_length_m,
    figures=('start_height_m',)))
#: The behaviours of a controller that does not say otherwise, in the order of its command vector.
DEFAULT_BEHAVIOURS = BEHAVIOURS.built_in()


def course_of(behaviour: str) -> Course:
    """Return the course of a registered behaviour, `NOWHERE` for any other."""
    return BEHAVIOURS.get(behaviour).course if behaviour in BEHAVIOURS else NOWHERE


def holds(behaviours: Sequence[str], command: ArrayLike) -> NDArray[np.float64]:
    """Return `courses.held` of a command (..., K) to behaviours by their names."""
    return held([course_of(behaviour) for behaviour in behaviours], command)
