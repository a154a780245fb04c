"""
The robust mode's fitness: pure functions of what robots did in drawn situations, in metres.

Bounded: with a clip of c metres, from -2 c - 2 (both moves the wrong way, restless) to 2 c.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from training.evolution.objectives import LARGEST_STEP_M
from training.robust.settings import Stage
from w2b_sim.engines.interface import Evaluation

Array = NDArray[np.float64]

#: What a stop pays for each metre of its path.
PATH_WEIGHT = 0.02
#: The worst that a stop can score, and what an explosion under a stop word scores.
WORST_STOP = -2.0
#: How three behaviours make one fitness, see `fitness`.
AGGREGATES = ('balanced', 'mean', 'worst_word')
#: A move must have got nearly as far in all as its second half promises.
LUNGE_M = 0.05


def values(outcome: Evaluation, directions: NDArray[np.int64], clip_m: float,
           length: float = 1.0, stray_weight: float = Stage.stray_weight,
           free_stray_m: float = Stage.free_stray_m) -> Array:
    """
    Return what C controllers earned in each of R situations, shape (C, R).

    A move (direction 1 or -1) earns twice the way along x of its second half, no more than its
    whole way plus `LUNGE_M`, clipped to plus and minus `clip_m`. A stop pays for straying farther
    than `free_stray_m`, and a little for its path. What explodes (a step of more than
    `LARGEST_STEP_M`, or a number that is not finite) earns 0 as a move and `WORST_STOP` as a stop.

    Parameters
    ----------
    outcome
        Of C controllers under R words from one start, with `halfway_position_m` and `farthest_m`.
    directions: shape (R,)
        1 forward, -1 backward, 0 stop.
    clip_m
        Progress beyond it earns no more: both moves must come before one of them goes far.
    length
        Of the evaluations, as a share of the whole: progress is extrapolated to the whole.
    stray_weight, free_stray_m
        What a stop pays for each metre beyond which distance.

    Raises
    ------
    ValueError
        If the engine does not tell the halfway position and the farthest distance.

    """
    if outcome.halfway_position_m is None or outcome.farthest_m is None:
        raise ValueError('engine: the robust mode needs the halfway and farthest positions, which '
                         'the batched engine tells')
    end = outcome.final_position_m[:, :, 0, 0]
    late = end - outcome.halfway_position_m[:, :, 0, 0]
    far, path = outcome.farthest_m[:, :, 0], outcome.path_length_m[:, :, 0]
    with np.errstate(invalid='ignore'):
        sound = (np.isfinite(end) & np.isfinite(far) & np.isfinite(path)
                 & (outcome.largest_step_m[:, :, 0] <= LARGEST_STEP_M))
        progress = np.minimum(2 * late * directions, end * directions + LUNGE_M) / length
        move = np.where(sound, np.clip(progress, -clip_m, clip_m), 0.0)
        stray = stray_weight * np.maximum(0.0, far - free_stray_m) + PATH_WEIGHT * path
        stop = np.where(sound, np.maximum(-stray, WORST_STOP), WORST_STOP)
    earned: Array = np.where(directions == 0, stop, move)
    return earned


def fitness(earned: Array, directions: NDArray[np.int64],
            aggregate: str = 'balanced') -> Array:
    """
    Return the fitness (C,) of values (C, R): the sum over forward, backward and stop.

    With the aggregate `balanced`, each counts half by its mean and half by the mean of its worst
    third, so that a controller cannot live off the easy situations, nor is it judged by a single
    unlucky one. `mean` counts each by its mean. `worst_word` takes three times the least of the
    three instead of their sum, each as in `balanced`.

    Raises
    ------
    ValueError
        If there is no such aggregate.

    """
    if aggregate not in AGGREGATES:
        raise ValueError(f'aggregate: expected one of {", ".join(AGGREGATES)}, got {aggregate!r}')
    parts = [earned[:, directions == direction] for direction in (1, -1, 0)]
    three = [part.mean(axis=1) if aggregate == 'mean' else fitness_of(part) for part in parts]
    if aggregate == 'worst_word':
        least: Array = len(three) * np.minimum.reduce(three)
        return least
    total: Array = three[0] + three[1] + three[2]
    return total


def fitness_of(earned: Array) -> Array:
    """Return half the mean and half the mean of the worst third of each row of (C, R)."""
    ordered = np.sort(earned, axis=1)
    worst = max(1, ordered.shape[1] // 3)
    both: Array = 0.5 * ordered.mean(axis=1) + 0.5 * ordered[:, :worst].mean(axis=1)
    return both
