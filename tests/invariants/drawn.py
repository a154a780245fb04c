"""
Training in drawn worlds: fixed inputs, and hashes of what comes out.

`python -m tests.invariants.drawn` prints the entries. Those in `hashes.json` are what it printed at
commit 2199f48 (2026-11-28), before the pipeline was made of recipes.
"""

from __future__ import annotations

import json
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from tests.invariants.fixed import sha
from training.evolution.operators import Layout
from training.robust.config import RobustConfig
from training.robust.hidden_life import live, live_exactly
from training.robust.pretraining import listen
from training.robust.scenarios import draw
from training.robust.search import train
from training.robust.settings import Careful, Pretraining, Randomisation, Stage
from w2b_core import bodies
from w2b_core.vocabulary import Vocabulary
from w2b_sim.worlds import PAPER

WORDS = (('forward', 'forward'), ('backward', 'backward'), ('stop', 'stop'), ('cease', 'stop'),
         ('wait', 'stop'))
WITHOUT_CONTACT = Randomisation(contact=False, servos=False, pushes=False)
CONFIGS = {
    'quadruped': RobustConfig(
        body='quadruped', seed=2, words=WORDS, population=8, pretraining=Pretraining(1, 8),
        stages=(Stage(4, 2, 2, 0, False, 0.5, vectors=False, length=0.1),
                Stage(7, 3, 4, 2, True, 0.5, length=0.1, stray_weight=3.0, free_stray_m=0.02))),
    'physical_twin': RobustConfig(
        body='physical_twin', seed=5, words=WORDS, population=6, pretraining=Pretraining(1, 5),
        physics_steps=4, move_noise=0.02, careful=Careful(), randomisation=WITHOUT_CONTACT,
        aggregate='worst_word',
        stages=(Stage(3, 2, 2, 2, False, 0.4, length=0.5),
                Stage(3, 2, 3, 1, False, 0.8, vectors=False, length=1.0))),
}


class Stopped(BaseException):
    """A run was stopped on purpose."""


def vectors() -> dict[str, np.ndarray]:
    vocabulary = Vocabulary.load()
    return {word: vocabulary.vector(word) for word, _behaviour in WORDS}


def run(body: str, directory: Path, stops: tuple[int, ...] = ()) -> str:
    """A run in drawn worlds, killed in some generations and taken up again."""
    for stop in stops:
        def progress(now, stop=stop):
            if now.generation == stop:
                raise Stopped
        try:
            train(CONFIGS[body], directory, progress, checkpoint_s=1e-9, vectors=vectors())
        except Stopped:
            continue
        raise AssertionError(f'the run was not stopped at generation {stop}')
    networks, fitness = train(CONFIGS[body], directory, vectors=vectors())
    return sha([networks.hidden_weights, networks.motor_weights, fitness])


def ears() -> str:
    """Hidden weights that tell words apart, bred without a body."""
    rng = np.random.default_rng(5)
    heard = {1: 0.2 * rng.normal(size=(1, 40)), -1: 0.2 * rng.normal(size=(1, 40)),
             0: 0.2 * rng.normal(size=(4, 40))}
    return sha([listen(Layout.of(bodies.get('quadruped')), Pretraining(2, 12, bias=0.07), 3,
                       lambda rng, moves, stops: draw(rng, heard, PAPER, Randomisation(),
                                                      moves=moves, stops=stops, move_noise=0.02))])


def arithmetic() -> str:
    """What compiled hidden layers and numpy round to here: the others hang on it."""
    rng = np.random.default_rng(4)
    weights, signals = rng.normal(size=(40, 5, 6)), 0.2 * rng.normal(size=(6, 40))
    values = rng.uniform(0.1, 4, 512)
    lives = (live(weights, signals, 0.1 * rng.normal(size=(6, 5))), live_exactly(weights, signals))
    return sha([*lives[0], *lives[1], np.log(values), np.exp(values), np.sin(values),
                np.linalg.norm(signals, axis=1)])


def table() -> dict[str, str]:
    """Return every hash, by name."""
    with TemporaryDirectory() as folder:
        found = {f'drawn worlds {body}': run(body, Path(folder) / body) for body in CONFIGS}
    return {**found, 'ears': ears(), "hidden layers' arithmetic": arithmetic()}


if __name__ == '__main__':
    print(json.dumps(table(), indent=1))
