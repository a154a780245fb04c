"""The table of the ablation: medians over a row's runs, and tests against the first row."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import fisher_exact, mannwhitneyu

from training.evolution.operators import Array
from training.pipeline.table import Row, from_json, passes, score
from training.robust.scenarios import BACKWARD, FORWARD, STOP, direction_of


def to_markdown(rows: Sequence[Mapping[str, Any]]) -> str:
    """
    Return the table, a row a treatment: medians over its runs, and tests against the first row.

    *Drawn worlds* is the fitness in situations with every means. The columns to its right are
    PyBullet's: medians over the runs of each run's result, for *shorter way* with the quartiles.
    Both have the p of a one-sided Mann-Whitney test against the first row. *Both ways* counts
    the runs whose median start gets far enough in each direction (p: Fisher's exact test against
    the first row, one-sided), *obey* those that also stay within the bound under the stop words.
    """
    lines = ['| means | runs | fitness, own worlds | fitness, drawn worlds (p) | forward, m | '
             'backward, m | shorter way, m (quartiles; p) | farthest under a stop word, m | '
             'both ways (p) | obey |',
             '|---' * 10 + '|']
    first = _judged(rows[0])
    for row in rows:
        runs = row['runs']
        judged = _judged(row)
        low, middle, high = np.quantile(judged.shorter_m, [0.25, 0.5, 0.75])
        against = judged.against(first) if row is not rows[0] else ('', '', '')
        lines.append(
            f'| {row["row"]} | {len(runs)} | {np.median([run["fitness"] for run in runs]):.2f} | '
            f'{np.median(judged.drawn):.2f}{against[2]} | '
            f'{np.median(judged.forward_m):+.2f} | {-np.median(judged.backward_m):+.2f} | '
            f'{middle:+.2f} ({low:+.2f} to {high:+.2f}{against[0]}) | '
            f'{np.median(judged.farthest_m):.2f} | {judged.both_ways}{against[1]} | '
            f'{judged.obey} |')
    return '\n'.join(lines) + '\n'


@dataclass(frozen=True)
class _Judged:
    """Of a row's runs, (R,): fitness in drawn worlds; ways and distances in PyBullet; a count."""

    drawn: Array
    forward_m: Array
    backward_m: Array
    farthest_m: Array
    both_ways: int
    obey: int

    @property
    def shorter_m(self) -> Array:
        return np.minimum(self.forward_m, self.backward_m)

    def against(self, first: _Judged) -> tuple[str, str, str]:
        """Return p of the shorter way, of the count and of the fitness against the first row's."""
        way, drawn = (mannwhitneyu(mine, theirs, alternative='greater').pvalue for mine, theirs in
                      ((self.shorter_m, first.shorter_m), (self.drawn, first.drawn)))
        table = [[judged.both_ways, len(judged.shorter_m) - judged.both_ways]
                 for judged in (self, first)]
        count = fisher_exact(table, alternative='greater').pvalue
        return f'; {way:.2g}', f' ({count:.2g})', f' ({drawn:.2g})'


def _judged(row: Mapping[str, Any]) -> _Judged:
    tables = [from_json(run['rows']) for run in row['runs']]

    def lines(table: Sequence[Row], direction: int) -> list[Row]:
        return [line for line in table if direction_of(line.behaviour) == direction]

    def ways(direction: int) -> Array:
        return np.array([score(lines(table, direction)[0]) for table in tables])

    farthest = np.array([max(line.p90_distance_m for line in lines(table, STOP))
                         for table in tables])
    both = sum(all(line.passed for line in table if direction_of(line.behaviour) != STOP)
               for table in tables)
    drawn = np.array([run['drawn_fitness'] for run in row['runs']])
    return _Judged(drawn, ways(FORWARD), ways(BACKWARD), farthest, both,
                   sum(map(passes, tables)))
