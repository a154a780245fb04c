"""
A champion tried again where it was not evolved: other starts, another engine, other words.

Each *trial* is a condition (`perturbed`, `pybullet` or `lexicon`), an engine, words and starts. The
outcome is raw: final positions and paths. What counts as right is decided in the report.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from training.evolution.starts import slightly_different
from training.evolution.treatments import treated
from training.study.config import RunSpec, StudyConfig
from w2b_core.network import Network
from w2b_sim.engines.interface import Evaluation, Evaluator, Start

#: Seed of the perturbed starts: the same ones for every champion, so that champions compare.
STARTS_SEED = 1

#: Columns of a rescored champion, one row a word and start (see `store.ROBUSTNESS`).
COLUMNS = ('condition', 'engine', 'word', 'word_class', 'role', 'start', 'start_height_m',
           'start_roll_rad', 'start_pitch_rad', 'final_x_m', 'final_y_m', 'final_z_m', 'path_m',
           'largest_step_m')


@dataclass(frozen=True)
class Word:
    """
    A word of a trial.

    `word_class` is the behaviour that it asks for, or `unrelated`; `role` is `trained`, `held_out`
    or `lexicon`.
    """

    word: str
    word_class: str
    role: str


@dataclass(frozen=True)
class Trial:
    """One way in which a champion is tried again."""

    condition: str
    engine: str
    words: tuple[Word, ...]
    starts: tuple[Start, ...]


def trials(config: StudyConfig, run: RunSpec, lexicon: Mapping[str, Sequence[str]],
           *, in_pybullet: bool) -> list[Trial]:
    """
    Return how the champion of `run` is tried again.

    Parameters
    ----------
    config
        Its `robustness` says how much of what.
    run
        Whose champion.
    lexicon
        Class (a behaviour, or `unrelated`) -> words. Words that the run knows are left out: they
        are scored in their own right.
    in_pybullet
        Whether PyBullet is part of it for this run.

    """
    plan = config.robustness
    trained, held_out = run.words()
    own = tuple(Word(word, behaviour, role) for role, pairs in (
        ('trained', trained), ('held_out', held_out)) for word, behaviour in pairs)
    known = {word.word for word in own}
    other = tuple(Word(word, word_class, 'lexicon') for word_class, words in lexicon.items()
                  for word in words if word not in known)
    perturbed = slightly_different(np.random.default_rng(STARTS_SEED),
                                   max(plan.perturbed_starts, plan.pybullet_starts))
    chosen = [Trial('perturbed', config.engine, own, perturbed[:plan.perturbed_starts])]
    if in_pybullet:
        # The exact start first: with one start, PyBullet differs by the engine alone.
        chosen.append(Trial('pybullet', 'pybullet', own,
                            (Start(), *perturbed)[:plan.pybullet_starts]))
    if plan.lexicon:
        chosen.append(Trial('lexicon', config.engine, other, (Start(),)))
    return [trial for trial in chosen if trial.words and trial.starts]


def rescore(network: Network, run: RunSpec, trial: Trial, evaluator: Evaluator,
            vectors: Mapping[str, ArrayLike]) -> dict[str, list[Any]]:
    """
    Return what one champion does in a trial: a list for each of `COLUMNS`.

    Under the control treatment every word, also one of the lexicon, is shuffled by its own
    permutation of that run.
    """
    words = [word.word for word in trial.words]
    heard = treated(vectors, words, run.treatment, run.evolution_seed)
    return _rows(trial, evaluator.evaluate(network.batched(), heard, trial.starts))


def _rows(trial: Trial, outcome: Evaluation) -> dict[str, list[Any]]:
    count = len(trial.starts)

    def by_word(value: Callable[[Word], str]) -> list[str]:
        return [value(word) for word in trial.words for _ in range(count)]

    def by_start(value: Callable[[Start], float]) -> list[float]:
        return [value(start) for start in trial.starts] * len(trial.words)

    def measured(values: NDArray[np.float64]) -> list[float | None]:
        return [float(value) if np.isfinite(value) else None for value in values.reshape(-1)]

    position = outcome.final_position_m[0]
    rows = len(trial.words) * count
    return {
        'condition': [trial.condition] * rows,
        'engine': [trial.engine] * rows,
        'word': by_word(lambda word: word.word),
        'word_class': by_word(lambda word: word.word_class),
        'role': by_word(lambda word: word.role),
        'start': list(range(count)) * len(trial.words),
        'start_height_m': by_start(lambda start: start.height_m),
        'start_roll_rad': by_start(lambda start: start.roll_rad),
        'start_pitch_rad': by_start(lambda start: start.pitch_rad),
        'final_x_m': measured(position[..., 0]),
        'final_y_m': measured(position[..., 1]),
        'final_z_m': measured(position[..., 2]),
        'path_m': measured(outcome.path_length_m[0]),
        'largest_step_m': measured(outcome.largest_step_m[0]),
    }
