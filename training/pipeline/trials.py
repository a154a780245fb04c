"""
Trials of controllers in PyBullet, from drawn starts: what gates, choices and tables rest on.

PyBullet is the reference engine, and not the one that evolution runs in.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from training.evolution import checkpoint
from training.evolution.starts import slightly_different
from training.evolution.treatments import GATE, Words, generator
from training.pipeline.table import Row, from_json, rows, to_json
from w2b_core.behaviours import BEHAVIOURS
from w2b_core.bodies.model import Body
from w2b_core.network import Network
from w2b_sim.engines.interface import Evaluation, Evaluator, Start
from w2b_sim.engines.pybullet_evaluator import PyBulletEvaluator
from w2b_sim.worlds import World


@dataclass(frozen=True)
class Later:
    """Where a robot is, in the median over the starts, `seconds` after a move word."""

    word: str
    seconds: float
    median_x_m: float
    median_y_m: float


def trial(network: Network, body: Body, world: World, words: Words, held_out: Words,
          vectors: Mapping[str, ArrayLike], *, move_m: float, starts: int, seed: int = 0,
          processes: int = 1, evaluator: Evaluator | None = None,
          optional: Collection[str] = (), validation: Words = ()) -> tuple[Row, ...]:
    """
    Return one row a word: how `network` (one controller) obeys from drawn starts.

    Parameters
    ----------
    network, body, world
        What is tried, and where.
    words, held_out, validation, move_m, optional
        As `table.rows`.
    vectors
        Word -> vector (T,).
    starts, seed
        How many slightly different starts, drawn from which seed.
    processes
        Number of PyBullet processes.
    evaluator
        Instead of PyBullet, of the same body and world.

    """
    asked = [word for word, _behaviour in words + validation + held_out]
    drawn = slightly_different(generator(seed, GATE), starts)
    if evaluator is not None:
        outcome = _outcome(evaluator, network, asked, vectors, drawn)
    else:
        with PyBulletEvaluator(body, world, processes) as pybullet:
            outcome = _outcome(pybullet, network, asked, vectors, drawn)
    return rows(outcome, words, held_out, move_m, optional, validation)


def kept_trial(directory: Path, network: Network, body: Body, world: World, words: Words,
               vectors: Mapping[str, ArrayLike], *, validation: Words = (), starts: int, seed: int,
               evaluator: Evaluator, **options: Any) -> tuple[Row, ...]:
    """
    Return the same as `trial`, word by word: each word's row is kept in `directory`.

    There is one file for each controller, number of starts and seed.
    """
    path = directory / f'{weights_sha256(network)[:16]}_{starts}_{seed}.json'
    known = list(from_json(json.loads(path.read_text(encoding='utf-8')))) if path.exists() else []
    table = []
    for pair in words + validation:
        trained = pair in words
        row = next((row for row in known if (row.word, row.behaviour, row.trained)
                    == (*pair, trained)), None)
        if row is None:
            [row] = trial(network, body, world, (pair,) if trained else (), (), vectors,
                          starts=starts, seed=seed, evaluator=evaluator,
                          validation=() if trained else (pair,), **options)
            known.append(row)
            path.parent.mkdir(parents=True, exist_ok=True)
            checkpoint.write_json(path, to_json(known))
        table.append(row)
    return tuple(table)


def weights_sha256(network: Network) -> str:
    """Return the SHA-256 of a controller's weights: hidden, then motor, little-endian float64."""
    parts = (network.hidden_weights, network.motor_weights)
    return sha256(b''.join(np.asarray(part, dtype='<f8').tobytes() for part in parts)).hexdigest()


def later(network: Network, body: Body, world: World, words: Words,
          vectors: Mapping[str, ArrayLike], *, seconds: float, starts: int, seed: int = 0,
          processes: int = 1) -> tuple[Later, ...]:
    """Return where `network` is in PyBullet under each move word of `words` much later."""
    moves = [word for word, asked in words if BEHAVIOURS.get(asked).moves]
    long = replace(world, steps=round(seconds / world.control_period_s))
    with PyBulletEvaluator(body, long, processes) as pybullet:
        outcome = _outcome(pybullet, network, moves, vectors,
                           slightly_different(generator(seed, GATE), starts))
    places = np.median(outcome.final_position_m[0, :, :, :2], axis=1)
    return tuple(Later(word, seconds, float(x), float(y))
                 for word, (x, y) in zip(moves, places, strict=True))


def _outcome(evaluator: Evaluator, network: Network, words: Sequence[str],
             vectors: Mapping[str, ArrayLike], starts: Sequence[Start]) -> Evaluation:
    """Return the outcome (1, W, K) of one controller."""
    signals = np.array([np.asarray(vectors[word], dtype=np.float64) for word in words])
    return evaluator.evaluate(network.batched(), signals, starts)
