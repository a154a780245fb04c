"""Slightly different starts: a body is never set down exactly as its description says."""

from __future__ import annotations

from math import radians

import numpy as np

from w2b_sim.engines.interface import Start

HEIGHT_M = 0.002
TILT_RAD = radians(0.5)


def slightly_different(rng: np.random.Generator, count: int, *, height_m: float = HEIGHT_M,
                       tilt_rad: float = TILT_RAD) -> tuple[Start, ...]:
    """
    Return `count` starts, raised by up to `height_m` and tilted about x and y by up to `tilt_rad`.

    A controller evolved from one exact start tends to live off that start's sequence of contacts;
    scores averaged over several are what other engines, and floors, will see.
    """
    draws = rng.uniform([0.0, -tilt_rad, -tilt_rad], [height_m, tilt_rad, tilt_rad], (count, 3))
    return tuple(Start(height_m=float(height), roll_rad=float(roll), pitch_rad=float(pitch))
                 for height, roll, pitch in draws)
