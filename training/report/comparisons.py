"""
The study's numbers, one row a run, and every comparison that is made between them.

*Move*, *stop* and *test* are a champion's mean net displacement, in body lengths, under the move
and the stop commands of its training and under the held-out stop word (the paper's figure 5).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas as pd

from training.report.published import TITLES, title
from training.report.statistics import Comparison, Sample

GROUPS = ('move', 'stop', 'test')
TREATMENTS = ('control', 'experimental')
#: How the paper's figures call the treatments.
LETTERS = {'control': 'C', 'experimental': 'E'}
#: A share of the body's typical move: less than it is standing still, more is moving.
THRESHOLD_SHARE = 0.25

Panel = tuple[str, str]


def per_run(runs: pd.DataFrame, outcomes: pd.DataFrame) -> pd.DataFrame:
    """
    Return one row a run: `runs` with the columns move, stop and test, in body lengths.

    `forward_m` and `backward_m` (mean progress in the right direction, m) are added too.
    """
    merged = outcomes.merge(runs[['run', 'body_length_m']], on='run')
    merged['lengths'] = merged.displacement_m / merged.body_length_m
    moves = merged.behaviour != 'stop'
    groups = {'move': (merged.role == 'trained') & moves,
              'stop': (merged.role == 'trained') & ~moves,
              'test': merged.role == 'held_out'}
    table = runs.set_index('run')
    for name, mask in groups.items():
        table[name] = merged[mask].groupby('run').lengths.mean()
    for behaviour, sign in (('forward', 1.0), ('backward', -1.0)):
        mask = (merged.role == 'trained') & (merged.behaviour == behaviour)
        table[f'{behaviour}_m'] = sign * merged[mask].groupby('run').final_x_m.mean()
    return table.reset_index()


def panels(runs: pd.DataFrame) -> list[Panel]:
    """Return the (word set, body) pairs there are: the paper's bodies in its order, then others."""
    order = list(TITLES)
    found = set(zip(runs.word_set, runs.body, strict=True))
    return sorted(found, key=lambda panel: (
        panel[0] != 'paper', panel[0],
        order.index(panel[1]) if panel[1] in order else len(order), panel[1]))


def select(table: pd.DataFrame, panel: Panel, treatment: str | None = None) -> pd.DataFrame:
    """Return the rows of a panel, of one treatment or of all."""
    mask = (table.word_set == panel[0]) & (table.body == panel[1])
    return table[mask if treatment is None else mask & (table.treatment == treatment)]


def comparisons(table: pd.DataFrame, selectivity: pd.DataFrame | None = None) -> list[Comparison]:
    """
    Return every comparison of a study: the paper's eight a panel, and one on the lexicon.

    Parameters
    ----------
    table
        As `per_run` returns it.
    selectivity
        As `behaviour.selectivity` returns it; None leaves its comparisons out.

    """
    return [comparison for panel in panels(table)
            for comparison in _of_panel(table, selectivity, panel)]


def _of_panel(table: pd.DataFrame, selectivity: pd.DataFrame | None,
              panel: Panel) -> Iterator[Comparison]:
    arms = {name: select(table, panel, name) for name in TREATMENTS}
    here = title(*panel)
    both = all(len(arm) for arm in arms.values())

    def sample(treatment: str, column: str) -> Sample:
        return Sample(f'{LETTERS[treatment]} {column}', arms[treatment][column].to_numpy(float))

    if both:
        yield Comparison(here, 'fitness: E against C', sample('experimental', 'fitness'),
                         sample('control', 'fitness'))
        for group in GROUPS:
            yield Comparison(here, f'{group}: E against C', sample('experimental', group),
                             sample('control', group))
    for name in TREATMENTS:
        if len(arms[name]):
            for first, second in (('move', 'stop'), ('test', 'stop')):
                yield Comparison(here, f'{LETTERS[name]}: {first} against {second}',
                                 sample(name, first), sample(name, second))
    if both and selectivity is not None:
        shares = {name: select(selectivity, panel, name).selectivity.to_numpy(float)
                  for name in TREATMENTS}
        if all(len(share) for share in shares.values()):
            yield Comparison(here, 'lexicon selectivity for stop words: E against C',
                             Sample('E selectivity', shares['experimental']),
                             Sample('C selectivity', shares['control']))


def thresholds_m(table: pd.DataFrame) -> dict[str, float]:
    """
    Return body -> displacement, m, that tells moving from standing still.

    A quarter of the median move of all the body's champions, both treatments and all word sets
    together, so that the threshold favours neither treatment and no body's scale.
    """
    lengths = table.groupby('body')[['move', 'body_length_m']].median()
    return {str(body): float(THRESHOLD_SHARE * row.move * row.body_length_m)
            for body, row in lengths.iterrows()}


def right(word_class: pd.Series, final_x_m: pd.Series, displacement_m: pd.Series,
          largest_step_m: pd.Series, threshold_m: pd.Series) -> pd.Series:
    """
    Return whether each outcome is what its word asks for.

    forward: x above the threshold; backward: x below minus it; stop: no farther away than it. An
    outcome that is not finite, or in which the simulator exploded, is never right.
    """
    sound = (largest_step_m <= 0.1) & np.isfinite(final_x_m) & np.isfinite(displacement_m)
    return sound & (((word_class == 'forward') & (final_x_m > threshold_m))
                    | ((word_class == 'backward') & (final_x_m < -threshold_m))
                    | ((word_class == 'stop') & (displacement_m <= threshold_m)))
