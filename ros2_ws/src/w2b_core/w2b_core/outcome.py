"""Outcomes: named figures of evaluations, from which behaviours are judged."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Outcome:
    """
    Outcome of C controllers under W words from K starts, in the world's frame (REP-103).

    The body starts at x = y = 0 and faces +x. The first six figures are the *plain* ones, which
    every evaluation has. The others are None unless an engine was made with `complete=True`.

    Attributes
    ----------
    final_position_m: shape (C, W, K, 3)
        Base position at the last sensor frame.
    path_length_m: shape (C, W, K)
        Length of the base's path in x-y.
    largest_step_m: shape (C, W, K)
        Longest x-y displacement between two frames.
    touch_fraction: shape (C, W, K, T)
        Share of frames in which each touch-sensitive link touched the floor.
    halfway_position_m: shape (C, W, K, 2)
        Base position in x-y half-way through the frames.
    farthest_m: shape (C, W, K)
        Longest x-y distance of the base from the world's origin.
    yaw_rad: shape (C, W, K)
        Turn about the vertical from the first frame to the last, unwrapped, left positive.
    lowest_height_m: shape (C, W, K)
        Lowest base height of all frames.
    lowest_up: shape (C, W, K)
        Smallest cosine of all frames between the base's z axis and the vertical.
    effort_nm: shape (C, W, K)
        Absolute joint torque, averaged over joints and time; NaN where an engine has none for a
        joint.
    reversals: shape (C, W, K, M)
        How often each joint turned round after it had moved by more than `REVERSAL_RAD`.
    at_speed_limit: shape (C, W, K)
        Share of joints and time in which a servo moved at its speed limit.
    start_height_m: shape (C, W, K)
        Height of the base at the first frame.

    """

    final_position_m: Array
    path_length_m: Array
    largest_step_m: Array
    touch_fraction: Array
    halfway_position_m: Array | None = None
    farthest_m: Array | None = None
    yaw_rad: Array | None = None
    lowest_height_m: Array | None = None
    lowest_up: Array | None = None
    effort_nm: Array | None = None
    reversals: Array | None = None
    at_speed_limit: Array | None = None
    start_height_m: Array | None = None

    def apply(self, function: Callable[[Array], Array]) -> Outcome:
        """Return an outcome of what `function` makes of each figure that there is."""
        values: dict[str, Any] = {name: None if value is None else function(value)
                                  for name, value in vars(self).items()}
        return Outcome(**values)

    @property
    def motion(self) -> Motion:
        """What is judged of it, each figure of shape (C, W, K)."""
        x, y, z = np.moveaxis(self.final_position_m, -1, 0)
        return Motion(along_m=x, away_m=np.hypot(x, y), yaw_rad=self.yaw_rad,
                      height=None if self.start_height_m is None else z / self.start_height_m)


@dataclass(frozen=True)
class Motion:
    """
    What a body did, as far as it decides whether a word was obeyed; numbers or arrays of one shape.

    Attributes
    ----------
    along_m
        Displacement from start to end towards where the body faced at the start.
    away_m
        Distance in x-y from start to end.
    yaw_rad
        Turn about the vertical, unwrapped, left positive; None if unknown.
    height
        Height of the base at the end as a share of that at the start; None if unknown.

    """

    along_m: Array
    away_m: Array
    yaw_rad: Array | None = None
    height: Array | None = None


#: A joint that moves back by less is taken to stand.
REVERSAL_RAD = 0.03
#: Figures that an evaluation need not have.
FIGURES = tuple(field.name for field in fields(Outcome) if field.default is None
                and field.name not in ('halfway_position_m', 'farthest_m'))


def told(outcome: Outcome | Motion, name: str) -> Array:
    """Return a figure of what a body did; ValueError if the evaluation has none."""
    value: Array | None = getattr(outcome, name)
    if value is None:
        raise ValueError(f'outcome: expected an evaluation with {name}, got one without; a '
                         'behaviour that needs it says so in `figures`, and an engine that '
                         'has it is made with complete=True')
    return value
