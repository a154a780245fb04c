"""
Ears first: hidden weights that sort words which they were not evolved on, found without a body.

Many short runs of `listening` on the trained words, each from its own seed. What comes of them is
screened: every trained word and every *validation* word must lead where its behaviour asks, rest
or a rhythm; those that pass are ranked by how much noise on the vectors their sorting survives.
Held-out words take no part.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from training.evolution import checkpoint
from training.evolution.operators import Array, Layout
from training.evolution.rundir import RunDirectory
from training.evolution.treatments import Words, vector_hash
from training.robust.hidden_life import Life, live, live_exactly
from training.robust.listening import TOUCH_INPUT, Listening, inputs, listen
from training.robust.scenarios import DIRECTION, STOP_NOISE, Randomisation, draw
from training.robust.word_roles import WordRoles
from w2b_core import __version__
from w2b_sim.worlds import PAPER

#: One attempt a seed, on larger draws than a robust run's own listening: more words are at stake.
PLAN = Listening(attempts=1, generations=800, moves=4, stops=20, bias=TOUCH_INPUT)
#: Swing of the hidden neurons below which they rest, and above which they have a rhythm.
REST, RHYTHM = 0.03, 0.3
#: Distance between the means of the two moves' rhythms: nearer, they are hardly two.
CONTRAST = 0.5
#: Noisy versions of each word, and the standard deviation of a move word's noise.
NOISY, MOVE_NOISE = 16, 0.02
#: How many ears are kept, and how many of one run at most: those of one run are much alike.
KEEP, ALIKE = 10, 3


class Screen(NamedTuple):
    """
    How N ears sort words, shape (N,) each.

    `trained` and `validation` are shares of the words that are sorted right, `sturdy` the share of
    their noisy versions, half of them with constant inputs from feet; `two` says whether the two
    moves have a rhythm each.
    """

    trained: Array
    validation: Array
    sturdy: Array
    two: NDArray[np.bool_]

    def order(self) -> NDArray[np.int64]:
        """Return the indices of the ears with two rhythms, best first, by trained words first."""
        ranked = np.lexsort((-self.sturdy, -self.validation, -self.trained, ~self.two))
        order: NDArray[np.int64] = ranked[self.two[ranked]]
        return order


def screen(weights: Array, roles: WordRoles, vectors: Mapping[str, Array]) -> Screen:
    """Return how ears (N, H, H + 1) sort the trained and the validation words, plain and noisy."""
    pairs = roles.trained + roles.validation
    plain = np.array([vectors[word] for word, _asked in pairs])
    stop = np.array([asked == 'stop' for _word, asked in pairs])
    noise = np.where(stop, STOP_NOISE, MOVE_NOISE)[:, None, None] * np.random.default_rng(
        0).standard_normal((len(pairs), NOISY, plain.shape[1]))
    noisy = (plain[:, None] + noise).reshape(-1, plain.shape[1])
    life = live_exactly(weights, plain)
    right = _right(life, stop)
    split = len(roles.trained)
    forward, backward = (np.array([asked == way for _word, asked in pairs])
                         for way in ('forward', 'backward'))
    contrast = np.linalg.norm(life.mean[:, forward].mean(axis=1)
                              - life.mean[:, backward].mean(axis=1), axis=-1)
    moves = right[:, ~stop].all(axis=1)
    shaken = live(weights, noisy, inputs(len(noisy), weights.shape[1], TOUCH_INPUT))
    sturdy = _right(shaken, np.repeat(stop, NOISY)).mean(axis=1)
    return Screen(right[:, :split].mean(axis=1), right[:, split:].mean(axis=1), sturdy,
                  moves & (contrast >= CONTRAST))


def _right(life: Life, stop: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Whether each of R signals led N ears to rest where it asks for that, else to a rhythm."""
    swing, late = (np.sqrt((part**2).mean(axis=-1)) for part in (life.swing, life.late_swing))
    right: NDArray[np.bool_] = np.where(stop, swing < REST, late > RHYTHM)
    return right


def find(directory: Path, roles: WordRoles, vectors: Mapping[str, Array], layout: Layout,
         seeds: int, plan: Listening = PLAN,
         say: Callable[[str], None] = print) -> tuple[Array, Screen]:
    """
    Return the best ears (N, H, H + 1), at most `KEEP`, of `seeds` runs, and how they sort.

    Parameters
    ----------
    directory
        Holds one file a seed; what is there is not done again.
    roles, vectors
        The words, and their vectors (T,).
    layout
        Of the genomes that will start from the ears.
    seeds, plan
        How many runs, and how long each.
    say
        Is told what came of each run.

    Raises
    ------
    RunConflictError
        If the directory belongs to another search.
    ValueError
        If no ear has a rhythm for each move.

    """
    heard = heard_of(roles.trained, vectors)
    identity = {'config': {'plan': vars(plan), 'words': [list(pair) for pair in roles.trained]},
                'program_version': __version__,
                'vectors': {word: vector_hash(vectors[word]) for word, _asked in roles.trained}}
    found = []
    with RunDirectory(directory, identity, may_grow=()) as place:
        for seed in range(seeds):
            path = place.path / f'ears_{seed:04d}.npy'
            if not path.exists():
                checkpoint.save_array(path, listen(
                    layout, plan, seed, lambda rng, moves, stops: draw(
                        rng, heard, PAPER, Randomisation(), moves=moves, stops=stops,
                        move_noise=MOVE_NOISE)))
                best = screen(np.load(path, allow_pickle=False), roles, vectors)
                first = best.order()[:1]
                say(f'ears {seed}: ' + (
                    f'{best.trained[first[0]]:.0%} of the trained words, '
                    f'{best.validation[first[0]]:.0%} of the validation words, '
                    f'{best.sturdy[first[0]]:.0%} with noise' if len(first)
                    else 'no rhythm for each move'))
            heads = np.load(path, allow_pickle=False)
            found.append(heads[screen(heads, roles, vectors).order()[:ALIKE]])
    ears = np.concatenate(found)
    if not len(ears):
        raise ValueError('ears: expected some with a rhythm for each move, got none; give more '
                         'seeds')
    sorting = screen(ears, roles, vectors)
    order = sorting.order()
    # Who sorts fewer words than the best is no start for obeying all of them.
    alike = ((sorting.trained[order] == sorting.trained[order[0]])
             & (sorting.validation[order] == sorting.validation[order[0]]))
    chosen: Array = ears[order[alike][:KEEP]]
    return chosen, screen(chosen, roles, vectors)


def heard_of(words: Words, vectors: Mapping[str, Array]) -> dict[str, Array]:
    """Return behaviour -> vectors (W, T) of the words that ask for it."""
    return {behaviour: np.array([vectors[word] for word, asked in words if asked == behaviour])
            for behaviour in DIRECTION}


def shorter(plan: Listening, effort: float) -> Listening:
    """Return the plan with its generations times `effort`, at least one."""
    return replace(plan, generations=max(1, round(plan.generations * effort)))
