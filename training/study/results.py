"""
What the engine returns for a fixed set of evaluations, as a hash: a part of a run's identity.

Two programs that return the same bits make the same runs, whatever their sources look like. So a
run is identified by results: controllers drawn once evaluated under words drawn once from several
starts, and a short evolution under the run's objective.

The batched engine's arithmetic does not depend on the processor. The few numbers around it that
numpy computes may (`cos` and `sin` of tilted starts): where they do, this hash differs, and runs of
both machines are not mixed.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from hashlib import sha256

import numpy as np
from numpy.typing import NDArray

from training.evolution.champion import outcomes
from training.evolution.engines import TimedEvaluator, make_evaluator
from training.evolution.exact import Exact
from training.evolution.loop import Loop
from training.evolution.operators import Layout, random_genomes
from training.evolution.optimisers import PAPER, make_optimiser
from training.evolution.starts import slightly_different
from training.evolution.treatments import EVOLUTION, generator, treated
from w2b_core import bodies
from w2b_sim.engines.interface import Evaluation, Evaluator, Start
from w2b_sim.worlds import WORLDS

SEED = 20261128
#: Length of the words' vectors, and their spread: those of the default vocabulary.
ELEMENTS, SPREAD = 300, 0.17
WORDS = (('forward', 'forward'), ('backward', 'backward'), ('stop', 'stop'))
HELD_OUT = (('halt', 'stop'),)


@dataclass(frozen=True)
class Size:
    """How much is evaluated: controllers x 3 words x starts, then an evolution."""

    controllers: int
    starts: int
    population: int
    generations: int


#: Engine -> size: PyBullet evaluates some ten robots a second, the batched engine thousands.
SIZES = {'batched': Size(64, 3, 12, 12), 'pybullet': Size(2, 2, 2, 2)}


@cache
def results_sha256(engine: str, precision: str, body: str, objective: str) -> str:
    """
    Return the hash of what `engine` returns for `body`; the same in every process of a program.

    Raises
    ------
    ValueError
        If the engine does not model the body.

    """
    described = bodies.get(body)
    evaluator = make_evaluator(engine, described, WORLDS[described.world], precision=precision)
    digest = sha256()
    add(digest, evaluation_arrays(fixed_evaluation(evaluator, body, SIZES[engine])))
    add(digest, short_evolution(evaluator, body, objective, SIZES[engine]))
    return digest.hexdigest()


def words() -> NDArray[np.float64]:
    """Return the vectors (4, 300) of `WORDS` and `HELD_OUT`, drawn once."""
    rng = np.random.default_rng(SEED)
    return rng.uniform(-SPREAD, SPREAD, (len(WORDS + HELD_OUT), ELEMENTS))


def fixed_evaluation(evaluator: Evaluator, body: str, size: Size) -> Evaluation:
    """Return the outcome of controllers drawn once, the first from the body's exact start."""
    layout = Layout.of(bodies.get(body))
    rng = np.random.default_rng(SEED)
    genomes = random_genomes(rng, size.controllers, layout)
    starts = (Start(), *slightly_different(rng, size.starts - 1))
    return evaluator.evaluate(layout.network(genomes), words()[:len(WORDS)], starts)


def short_evolution(evaluator: Evaluator, body: str, objective: str,
                    size: Size) -> list[NDArray[np.float64]]:
    """
    Return what comes of a short evolution under the control treatment, in memory.

    The last population's genomes, ages and fitness, then the champion under every word.
    """
    layout = Layout.of(bodies.get(body))
    names = [word for word, _behaviour in WORDS + HELD_OUT]
    behaviours = [behaviour for _word, behaviour in WORDS]
    heard = treated(dict(zip(names, words(), strict=True)), names, 'control', SEED)
    rng = generator(SEED, EVOLUTION)
    loop = Loop(make_optimiser(PAPER, layout, rng, capacity=size.population),
                Exact(layout, TimedEvaluator(evaluator), heard[:len(WORDS)], behaviours, (Start(),),
                      objective), rng)
    loop.run(size.generations)
    last = loop.optimiser.population
    judged = outcomes(evaluator, layout.network(last.genomes[last.best]), WORDS, HELD_OUT, heard,
                      (Start(),), objective)
    return [last.genomes, last.ages.astype(np.float64), last.fitness,
            np.array([word.score for word in judged]),
            np.array([word.final_position_m for word in judged]),
            np.array([word.path_length_m for word in judged])]


def evaluation_arrays(outcome: Evaluation) -> list[NDArray[np.float64]]:
    """Return what an evaluation says of every controller, word and start."""
    return [outcome.final_position_m, outcome.path_length_m, outcome.largest_step_m,
            outcome.touch_fraction]


def add(digest: object, arrays: Iterable[NDArray[np.float64]]) -> None:
    """Add arrays' shapes and little-endian doubles to a hash."""
    for array in arrays:
        digest.update(f'{array.shape}'.encode())  # type: ignore[attr-defined]
        digest.update(np.ascontiguousarray(array, dtype='<f8').tobytes())  # type: ignore[attr-defined]
