"""
The study's numbers, one row a run, and every comparison that is made between them.

*Move*, *stop* and *test* are a champion's mean net displacement, in body lengths, under the move
and the stop commands of its training and under the held-out stop word (the paper's figure 5). An
outcome in which the simulator exploded says nothing of the champion: it is left out and counted.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas as pd

from training.evolution.objectives import LARGEST_STEP_M
from training.report.published import TITLES, title
from training.report.statistics import Comparison, Sample
from w2b_core.behaviours import BEHAVIOURS, Bounds
from w2b_core.outcome import Motion

GROUPS = ('move', 'stop', 'test')
TREATMENTS = ('control', 'experimental')
#: How the paper's figures call the treatments.
LETTERS = {'control': 'C', 'experimental': 'E'}
#: Where else champions are tried under the held-out word: name -> condition in the store.
ELSEWHERE = {'perturbed starts': 'perturbed', 'PyBullet': 'pybullet'}
#: A share of the body's typical move: less than it is standing still, more is moving.
THRESHOLD_SHARE = 0.25

Panel = tuple[str, str]


def sound(rows: pd.DataFrame) -> pd.Series:
    """Return whether each outcome is finite and free of steps that no gait takes."""
    return ((rows.largest_step_m.astype(float) <= LARGEST_STEP_M)
            & np.isfinite(rows.final_x_m.astype(float))
            & np.isfinite(rows.displacement_m.astype(float)))


def per_run(runs: pd.DataFrame, outcomes: pd.DataFrame,
            robustness: pd.DataFrame | None = None) -> pd.DataFrame:
    """
    Return one row a run: `runs` with the columns move, stop and test, in body lengths.

    Added too: `stop_path` and `test_path` (mean path, body lengths), `forward_m` and `backward_m`
    (mean progress in the right direction, m), `forward_least_m` and `backward_least_m` (the same
    under the worst word; NaN if one of them has no sound outcome), and, of `robustness`,
    `test_perturbed` and `test_pybullet` (mean net displacement under the held-out word there, body
    lengths). NaN where a run has no sound outcome.
    """
    merged = outcomes[sound(outcomes)].merge(runs[['run', 'body_length_m']], on='run')
    merged['lengths'] = merged.displacement_m / merged.body_length_m
    merged['path'] = merged.path_m / merged.body_length_m
    moves = merged.behaviour != 'stop'
    groups = {'move': (merged.role == 'trained') & moves,
              'stop': (merged.role == 'trained') & ~moves,
              'test': merged.role == 'held_out'}
    table = runs.set_index('run')
    for name, mask in groups.items():
        table[name] = merged[mask].groupby('run').lengths.mean()
        if name != 'move':
            table[f'{name}_path'] = merged[mask].groupby('run').path.mean()
    for behaviour, sign in (('forward', 1.0), ('backward', -1.0)):
        mask = (merged.role == 'trained') & (merged.behaviour == behaviour)
        table[f'{behaviour}_m'] = sign * merged[mask].groupby('run').final_x_m.mean()
        # Of all outcomes: a word under which the simulator exploded is not one to pass over.
        every = outcomes[(outcomes.role == 'trained') & (outcomes.behaviour == behaviour)]
        progress = (sign * every.final_x_m.astype(float)).where(sound(every), -np.inf)
        table[f'{behaviour}_least_m'] = progress.groupby(every.run).min().replace(-np.inf, np.nan)
    for condition in ELSEWHERE.values():
        table[f'test_{condition}'] = np.nan
        if robustness is not None:
            rows = robustness[(robustness.condition == condition)
                              & (robustness.role == 'held_out')]
            rows = rows[sound(rows)]
            table[f'test_{condition}'] = (rows.groupby('run').displacement_m.mean()
                                          / table.body_length_m)
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
    Return every comparison of a study: the paper's eight a panel, and those on robustness.

    Robustness adds up to three a panel: E against C under the unheard word from perturbed starts
    and in PyBullet, and of the selectivity for stop words. A comparison without runs on either side
    is not made.

    Parameters
    ----------
    table
        As `per_run` returns it.
    selectivity
        As `behaviour.selectivity` returns it; None leaves its comparisons out.

    """
    return [comparison for panel in panels(table)
            for comparison in _of_panel(table, selectivity, panel)
            if len(comparison.first.values) and len(comparison.second.values)]


def _of_panel(table: pd.DataFrame, selectivity: pd.DataFrame | None,
              panel: Panel) -> Iterator[Comparison]:
    here = title(*panel)

    def sample(treatment: str, column: str, source: pd.DataFrame = table) -> Sample:
        values = select(source, panel, treatment)[column].to_numpy(float)
        return Sample(f'{LETTERS[treatment]} {column}', values[np.isfinite(values)])

    def between(question: str, column: str, source: pd.DataFrame = table) -> Comparison:
        return Comparison(here, f'{question}: E against C', sample('experimental', column, source),
                          sample('control', column, source))

    yield between('fitness', 'fitness')
    for group in GROUPS:
        yield between(group, group)
    for name in TREATMENTS:
        for first, second in (('move', 'stop'), ('test', 'stop')):
            yield Comparison(here, f'{LETTERS[name]}: {first} against {second}',
                             sample(name, first), sample(name, second))
    for name, condition in ELSEWHERE.items():
        yield between(f'test, {name}', f'test_{condition}')
    if selectivity is not None:
        yield between('lexicon selectivity for stop words', 'selectivity', selectivity)


def thresholds_m(table: pd.DataFrame, share: float = THRESHOLD_SHARE) -> dict[str, float]:
    """
    Return body -> displacement, m, that tells moving from standing still, in the paper's order.

    A share (a quarter) of the median move of all the body's champions, both treatments and all word
    sets together, so that the threshold favours neither treatment and no body's scale.
    """
    lengths = table.groupby('body')[['move', 'body_length_m']].median()
    return {body: float(share * lengths.move[body] * lengths.body_length_m[body])
            for body in dict.fromkeys(body for _, body in panels(table))}


def right(word_class: pd.Series, final_x_m: pd.Series, displacement_m: pd.Series,
          largest_step_m: pd.Series, threshold_m: pd.Series) -> pd.Series:
    """
    Return whether each outcome is what its word asks for.

    The threshold is that of a move and of standing still (`w2b_core.behaviours`). An
    outcome that is not finite, or in which the simulator exploded, is never right.
    """
    whole = ((largest_step_m <= LARGEST_STEP_M) & np.isfinite(final_x_m)
             & np.isfinite(displacement_m))
    motion = Motion(final_x_m.to_numpy(float), displacement_m.to_numpy(float))
    threshold = threshold_m.to_numpy(float)
    bounds = Bounds(move_m=threshold, still_m=threshold)
    obeyed = np.zeros(len(word_class), dtype=bool)
    for name in word_class.unique():
        asked = (word_class == name).to_numpy()
        obeyed |= asked & BEHAVIOURS.get(str(name)).obeyed(motion, bounds)
    return whole & obeyed
