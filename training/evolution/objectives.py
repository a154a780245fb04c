"""
What a robot is rewarded for: pure functions of where it went, in metres.

A command's score is bounded by the body's way (500 steps of at most 0.1 m in the paper's world). A
command in which any step moved the body by more than `LARGEST_STEP_M` scores 0, since no gait does
that and a simulator that explodes does; so does one whose outcome is not finite. Paper, section
II-A; the variants are the program's and the paper's readings of `stop`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from w2b_core.behaviours import BEHAVIOURS, Behaviour
from w2b_core.outcome import Outcome

Array = NDArray[np.float64]

#: A step longer than this is no gait but an explosion: the command scores 0.
LARGEST_STEP_M = 0.1
#: A sum above this, or one that is not finite, counts as 0.
LARGEST_SUM = 30.0

#: Objective -> what a behaviour is worth, (C, W, K). `program`: what the published program
#: computed. `paper`: what the paper says of its main experiment, where `stop` is judged by the
#: final distance. `balanced`: what the paper says of its balanced one, where `stop` is judged by
#: total movement, as the program always did.
OBJECTIVES: dict[str, Callable[[Behaviour, Outcome], Array]] = {
    'program': lambda behaviour, outcome: behaviour.worth(outcome),
    'paper': lambda behaviour, outcome: behaviour.progress(outcome.motion),
    'balanced': lambda behaviour, outcome: behaviour.worth(outcome),
}


def scores(outcome: Outcome, behaviours: Sequence[str], objective: str) -> Array:
    """
    Return what each controller earned under each word, shape (C, W), averaged over the starts.

    Parameters
    ----------
    outcome
        Of C controllers under W words from K starts.
    behaviours
        The behaviour that each word asks for (W,).
    objective
        A key of `OBJECTIVES`.

    Raises
    ------
    ValueError
        If there is no such objective or behaviour, or the engine does not tell what it needs.

    """
    if objective not in OBJECTIVES:
        raise ValueError(f'objective: expected one of {", ".join(OBJECTIVES)}, got {objective!r}')
    worth = OBJECTIVES[objective]
    asked = {name: BEHAVIOURS.get(name) for name in behaviours}
    with np.errstate(invalid='ignore', over='ignore'):
        columns = {name: worth(behaviour, outcome) for name, behaviour in asked.items()}
        earned = np.stack([columns[name][:, word] for word, name in enumerate(behaviours)], axis=1)
        sound = (np.isfinite(earned) & np.isfinite(outcome.final_position_m[..., :2]).all(axis=-1)
                 & (outcome.largest_step_m <= LARGEST_STEP_M))
        mean: Array = np.where(sound, earned, 0.0).mean(axis=-1)
    return mean


def total(word_scores: ArrayLike) -> Array:
    """Return the sum (C,) over the words of scores (C, W): the original's fitness."""
    with np.errstate(invalid='ignore', over='ignore'):
        return _bounded(np.asarray(word_scores, dtype=np.float64).sum(axis=-1))


def worst(word_scores: ArrayLike, behaviours: Sequence[str]) -> Array:
    """
    Return the sum (C,) with each word counted as the worst of its kind: a move, or a stop.

    The plain sum lets a controller walk far under `forward` and not at all under `backward`; here
    only the worse of the moves, and the worst of the stops, can raise the fitness. Moves and stops
    stay apart because no stop scores above 0: their common minimum would reward no walking.
    """
    word_scores = np.asarray(word_scores, dtype=np.float64)
    moves = np.array([BEHAVIOURS.get(behaviour).moves for behaviour in behaviours])
    fitness = np.zeros(word_scores.shape[:-1])
    for kind in (moves, ~moves):
        if kind.any():
            fitness = fitness + kind.sum() * word_scores[..., kind].min(axis=-1)
    return _bounded(fitness)


AGGREGATES = ('sum', 'worst')


def aggregate(word_scores: ArrayLike, behaviours: Sequence[str], kind: str) -> Array:
    """Return the fitness (C,) of word scores (C, W) by an aggregate of `AGGREGATES`."""
    if kind == 'sum':
        return total(word_scores)
    if kind == 'worst':
        return worst(word_scores, behaviours)
    raise ValueError(f'aggregate: expected one of {", ".join(AGGREGATES)}, got {kind!r}')


def _bounded(fitness: Array) -> Array:
    """Fitness, or 0 where it is not finite or too good to be true."""
    return np.where(np.isfinite(fitness) & (fitness <= LARGEST_SUM), fitness, 0.0)
