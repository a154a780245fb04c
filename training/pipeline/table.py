"""
How a controller obeys in an engine, as a table: one row a word.

A candidate ships only if it obeys every required word from starts it has never met, in an engine
that it was not evolved in: a controller that depends on an exact sequence of contacts fails. Robots
that the engine throws hundreds of metres away count as failures, never as far walkers.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from training.evolution.treatments import Words
from w2b_core.behaviours import BEHAVIOURS, Bounds
from w2b_core.outcome import Motion
from w2b_sim.engines.interface import Evaluation

#: Farther than this within one evaluation is an explosion of the simulator.
EXPLODED_M = 10.0
#: 90 % of the starts must stay this close under every stop word.
STOP_DISTANCE_M = 0.1


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


def rows(outcome: Evaluation, words: Words, held_out: Words, move_m: float,
         optional: Collection[str] = (), validation: Words = ()) -> tuple[Row, ...]:
    """
    Return the rows for the outcome (1, W, K) of one controller.

    Parameters
    ----------
    outcome
        In the order of the words: trained, validation, held out.
    words, held_out, validation
        (word, behaviour) pairs. Required are the trained words, and the held-out words that ask
        for no move and are not `optional`.
    move_m
        How far the median start must get along x, in the right direction, under a move word.
    optional
        Held-out words that are reported and not required.

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
                         index < len(words) or (index >= unheard and not _moves(behaviour)
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
    moves = [score(row) / move_m for row in table if row.required and _moves(row.behaviour)]
    restless = sum(not row.passed for row in table if row.required and not _moves(row.behaviour))
    return min(moves) - restless


def shorter_way(table: Sequence[Row]) -> float:
    """Return the shortest median way, in metres, under a trained move word, in its direction."""
    return min(score(row) for row in table if row.trained and _moves(row.behaviour))


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
    """Return the role of a row's word, see `words`."""
    if row.trained:
        return 'trained'
    return 'validation' if row.validation else '**held out**'


def _moves(behaviour: str) -> bool:
    return BEHAVIOURS.get(behaviour).moves


def in_short(table: Sequence[Row]) -> str:
    """Return in one line what a table says."""
    moves = ', '.join(f'{row.word} {row.median_x_m:+.2f}' for row in table
                      if _moves(row.behaviour))
    restless = [f'{row.word} ({row.p90_distance_m:.2f})' for row in table
                if not _moves(row.behaviour) and not row.passed]
    return f'{moves} m; moves under {", ".join(restless) if restless else "no stop word"}'
