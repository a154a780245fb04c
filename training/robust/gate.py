"""
The gate: a controller ships only if it obeys in PyBullet, from starts it has never seen.

PyBullet is the reference engine, and not the one that evolution ran in: a controller that lives off
an exact sequence of contacts does not get through. Robots that PyBullet throws hundreds of metres
away count as failures, never as far walkers.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from training.evolution.starts import slightly_different
from training.evolution.treatments import GATE, Words, generator
from w2b_core.behaviours import BEHAVIOURS, Bounds
from w2b_core.bodies.model import Body
from w2b_core.network import Network
from w2b_core.outcome import Motion
from w2b_sim.engines.interface import Evaluation, Evaluator, Start
from w2b_sim.engines.pybullet_evaluator import PyBulletEvaluator
from w2b_sim.worlds import World

Array = NDArray[np.float64]

STARTS = 20
#: Farther than this within one evaluation is an explosion of the simulator.
EXPLODED_M = 10.0
#: 90 % of the starts must stay this close under every stop word.
STOP_DISTANCE_M = 0.1
#: What a walk of a few metres does not show is whether it goes on straight.
LATER_S, LATER_STARTS = 60.0, 5


@dataclass(frozen=True)
class Later:
    """Where a robot is, in the median of `LATER_STARTS` starts, `seconds` after a move word."""

    word: str
    seconds: float
    median_x_m: float
    median_y_m: float


@dataclass(frozen=True)
class Row:
    """One word: `median_x_m`, and the 90th percentile of the final distance, over the starts."""

    word: str
    behaviour: str
    trained: bool
    median_x_m: float
    lower_quartile_x_m: float
    upper_quartile_x_m: float
    p90_distance_m: float
    median_path_m: float
    explosions: int
    passed: bool
    required: bool = True
    validation: bool = False


def gate(network: Network, body: Body, world: World, words: Words, held_out: Words,
         vectors: Mapping[str, ArrayLike], *, move_m: float, starts: int = STARTS, seed: int = 0,
         processes: int = 1, evaluator: Evaluator | None = None,
         optional: Collection[str] = (), validation: Words = ()) -> tuple[Row, ...]:
    """
    Return one row a word: how `network` (one controller) obeys in PyBullet from drawn starts.

    Parameters
    ----------
    network, body, world
        What is judged, and where.
    words, held_out
        (word, behaviour) pairs, trained and never heard.
    vectors
        Word -> vector (T,).
    move_m
        How far the median start must get along x, in the right direction, under a move word.
    starts, seed
        How many slightly different starts, drawn from which seed.
    processes
        Of PyBullet.
    evaluator
        Instead of PyBullet, of the same body and world.
    optional
        Held-out stop words that are told and not required.
    validation
        (word, behaviour) pairs that were never heard and may choose among candidates: told between
        the trained and the held-out words, and not required.

    """
    asked = [word for word, _behaviour in words + validation + held_out]
    drawn = slightly_different(generator(seed, GATE), starts)
    if evaluator is not None:
        outcome = _outcome(evaluator, network, asked, vectors, drawn)
    else:
        with PyBulletEvaluator(body, world, processes) as pybullet:
            outcome = _outcome(pybullet, network, asked, vectors, drawn)
    return rows(outcome, words, held_out, move_m, optional, validation)


def later(network: Network, body: Body, world: World, words: Words,
          vectors: Mapping[str, ArrayLike], *, seconds: float = LATER_S, starts: int = LATER_STARTS,
          seed: int = 0, processes: int = 1) -> tuple[Later, ...]:
    """Return where `network` is in PyBullet under each move word of `words` much later."""
    moves = [word for word, asked in words if asked != 'stop']
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


def rows(outcome: Evaluation, words: Words, held_out: Words, move_m: float,
         optional: Collection[str] = (), validation: Words = ()) -> tuple[Row, ...]:
    """
    Return the gate's rows for the outcome (1, W, K) of one controller.

    Required are the trained words and the held-out stop words that are not `optional`.
    """
    table = []
    unheard = len(words) + len(validation)
    for index, (word, behaviour) in enumerate(words + validation + held_out):
        position = outcome.final_position_m[0, index]
        distance = np.hypot(position[:, 0], position[:, 1])
        exploded = ~(distance <= EXPLODED_M)
        # An explosion is no progress, and no stop.
        x = np.where(exploded, 0.0, position[:, 0])
        distance = np.where(exploded, np.inf, distance)
        median, low, high = (float(value) for value in np.quantile(x, [0.5, 0.25, 0.75]))
        ordered = np.sort(distance)
        p90 = float(ordered[int(np.ceil(0.9 * len(ordered))) - 1])
        passed = bool(BEHAVIOURS.get(behaviour).obeyed(
            Motion(np.asarray(median), np.asarray(p90)), Bounds(move_m, STOP_DISTANCE_M)))
        table.append(Row(word, behaviour, index < len(words), median, low, high, p90,
                         float(np.median(np.where(exploded, 0.0, outcome.path_length_m[0, index]))),
                         int(exploded.sum()), passed,
                         index < len(words) or (index >= unheard and behaviour == 'stop'
                                                and word not in optional),
                         len(words) <= index < unheard))
    return tuple(table)


def passes(table: Sequence[Row]) -> bool:
    """Whether every word that is required is obeyed."""
    return all(row.passed for row in table if row.required)


def worst_margin(table: Sequence[Row], move_m: float) -> float:
    """
    Return how well the required words are obeyed, for ranking those that pass and those that fail.

    The shortest median way under a trained move word, in units of `move_m`, minus how many
    required stop words are not obeyed.
    """
    moves = [score(row) / move_m for row in table if row.required and row.behaviour != 'stop']
    restless = sum(not row.passed for row in table if row.required and row.behaviour == 'stop')
    return min(moves) - restless


def shorter_way(table: Sequence[Row]) -> float:
    """Return the shortest median way, in metres, under a trained move word, in its direction."""
    return min(score(row) for row in table if row.trained and row.behaviour != 'stop')


def score(row: Row) -> float:
    """Return the `paper` objective's score of a row's median: progress, or minus the distance."""
    return float(BEHAVIOURS.get(row.behaviour).progress(Motion(
        np.asarray(row.median_x_m), np.asarray(min(row.p90_distance_m, EXPLODED_M)))))


def to_json(table: Sequence[Row]) -> list[dict[str, Any]]:
    """Return the rows as JSON objects; an infinite distance (an explosion) as null."""
    result = []
    for row in table:
        value = asdict(row)
        if not np.isfinite(row.p90_distance_m):
            value['p90_distance_m'] = None
        result.append(value)
    return result


def from_json(values: Sequence[Mapping[str, Any]]) -> tuple[Row, ...]:
    """Return the rows that `to_json` wrote."""
    return tuple(Row(**{**value, 'p90_distance_m': np.inf if value['p90_distance_m'] is None
                        else value['p90_distance_m']}) for value in values)


def to_markdown(table: Sequence[Row]) -> str:
    """Return the rows as a Markdown table."""
    lines = ['| word | asks for | role | median final x, m (quartiles) | '
             '90th percentile of distance, m | obeyed | required |',
             '|---|---|---|---|---|---|---|']
    for row in table:
        lines.append(
            f'| {row.word} | {row.behaviour} | {_role(row)} | '
            f'{row.median_x_m:+.2f} ({row.lower_quartile_x_m:+.2f} to '
            f'{row.upper_quartile_x_m:+.2f}) | {row.p90_distance_m:.3f} | '
            f'{"yes" if row.passed else "no"} | {"yes" if row.required else "no"} |')
    return '\n'.join(lines) + '\n'


def _role(row: Row) -> str:
    """The role of a row's word, see `word_roles`."""
    if row.trained:
        return 'trained'
    return 'validation' if row.validation else '**held out**'
