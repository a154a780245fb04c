"""
Pretrained hidden weights that sort words which they were not evolved on.

Many short runs of `pretraining` on the trained words, each from its own seed. What comes of them is
screened: every trained word and every *validation* word must lead where its behaviour asks, rest
or a rhythm; those that pass are ranked by how much noise on the vectors their sorting survives.
Held-out words take no part.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from training.evolution import checkpoint
from training.evolution.operators import Array, Layout
from training.evolution.rundir import RunDirectory
from training.evolution.treatments import Words, vector_hash
from training.robust.hidden_life import Life, live, live_exactly
from training.robust.pretraining import TOUCH_INPUT, inputs, listen
from training.robust.scenarios import (
    BACKWARD,
    FORWARD,
    STOP,
    STOP_NOISE,
    by_direction,
    direction_of,
    draw,
)
from training.robust.settings import Pretraining, Randomisation, Screening
from w2b_core import __version__
from w2b_sim.worlds import PAPER


class Screen(NamedTuple):
    """
    How N hidden layers sort words, shape (N,) each.

    `trained` and `validation` are shares of the words that are sorted right, `sturdy` the share of
    their noisy versions, half of them with constant inputs from feet; `two` says whether the two
    directions have a rhythm each.
    """

    trained: Array
    validation: Array
    sturdy: Array
    two: NDArray[np.bool_]

    def order(self) -> NDArray[np.int64]:
        """Return the indices of those with two rhythms, best first, by trained words first."""
        ranked = np.lexsort((-self.sturdy, -self.validation, -self.trained, ~self.two))
        order: NDArray[np.int64] = ranked[self.two[ranked]]
        return order


class WordsToSort(NamedTuple):
    """Words to sort: `trained` and `validation` pairs, their vectors, and the noise on moves."""

    trained: Words
    validation: Words
    vectors: Mapping[str, Array]
    move_noise: float
    settings: Screening = Screening()


def screen(weights: Array, words: WordsToSort) -> Screen:
    """Return how hidden weights (N, H, H + 1) sort trained and validation words."""
    pairs, settings = words.trained + words.validation, words.settings
    plain = np.array([words.vectors[word] for word, _asked in pairs])
    directions = np.array([direction_of(asked) for _word, asked in pairs])
    stop = directions == STOP
    noise = np.where(stop, STOP_NOISE, words.move_noise)[:, None, None] * np.random.default_rng(
        0).standard_normal((len(pairs), settings.noisy, plain.shape[1]))
    noisy = (plain[:, None] + noise).reshape(-1, plain.shape[1])
    life = live_exactly(weights, plain)
    right = _right(life, stop, settings)
    split = len(words.trained)
    contrast = np.linalg.norm(life.mean[:, directions == FORWARD].mean(axis=1)
                              - life.mean[:, directions == BACKWARD].mean(axis=1), axis=-1)
    moves = right[:, ~stop].all(axis=1)
    shaken = live(weights, noisy, inputs(len(noisy), weights.shape[1], TOUCH_INPUT))
    sturdy = _right(shaken, np.repeat(stop, settings.noisy), settings).mean(axis=1)
    return Screen(right[:, :split].mean(axis=1), right[:, split:].mean(axis=1), sturdy,
                  moves & (contrast >= settings.contrast))


def _right(life: Life, stop: NDArray[np.bool_], settings: Screening) -> NDArray[np.bool_]:
    """Whether each of R signals led N hidden layers to rest where it asks for that."""
    swing, late = (np.sqrt((part**2).mean(axis=-1)) for part in (life.swing, life.late_swing))
    right: NDArray[np.bool_] = np.where(stop, swing < settings.rest, late > settings.rhythm)
    return right


def find(directory: Path, words: WordsToSort, layout: Layout, seeds: int, plan: Pretraining,
         say: Callable[[str], None] = print) -> tuple[Array, Screen]:
    """
    Return the best hidden weights (N, H, H + 1) of `seeds` runs, and how they sort.

    Parameters
    ----------
    directory
        Holds one file a seed; what is there is not done again.
    words
        The words, and what sorting them means.
    layout
        Of the genomes that will start from them.
    seeds, plan
        How many runs, and how long each.
    say
        Is told what came of each run.

    Raises
    ------
    RunConflictError
        If the directory belongs to another search.
    ValueError
        If none has a rhythm for each direction.

    """
    heard = by_direction(words.trained, words.vectors)
    identity = {'config': {'plan': asdict(plan), 'words': [list(pair) for pair in words.trained],
                           'move_noise': words.move_noise},
                'program_version': __version__,
                'vectors': {word: vector_hash(words.vectors[word])
                            for word, _asked in words.trained}}
    found = []
    with RunDirectory(directory, identity, may_grow=()) as place:
        for seed in range(seeds):
            path = place.path / f'ears_{seed:04d}.npy'
            if not path.exists():
                checkpoint.save_array(path, listen(
                    layout, plan, seed, lambda rng, moves, stops: draw(
                        rng, heard, PAPER, Randomisation(), moves=moves, stops=stops,
                        move_noise=words.move_noise)))
                say(f'ears {seed}: {_described(screen(_load(path), words))}')
            some = _load(path)
            found.append(some[screen(some, words).order()[:words.settings.alike]])
    weights = np.concatenate(found)
    if not len(weights):
        raise ValueError('ears: expected some with a rhythm for each direction, got none; give '
                         'more seeds')
    sorting = screen(weights, words)
    order = sorting.order()
    # Those that sort fewer words than the best are no start for obeying all of them.
    alike = ((sorting.trained[order] == sorting.trained[order[0]])
             & (sorting.validation[order] == sorting.validation[order[0]]))
    chosen: Array = weights[order[alike][:words.settings.keep]]
    return chosen, screen(chosen, words)


def _load(path: Path) -> Array:
    weights: Array = np.load(path, allow_pickle=False)
    return weights


def _described(sorting: Screen) -> str:
    """Return in one line how the best of a run sorts."""
    first = sorting.order()[:1]
    if not len(first):
        return 'no rhythm for each direction'
    return (f'{sorting.trained[first[0]]:.0%} of the trained words, '
            f'{sorting.validation[first[0]]:.0%} of the validation words, '
            f'{sorting.sturdy[first[0]]:.0%} with noise')
