"""The tables of the report, as data frames of ready text; the paper's values stand beside ours."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from training.evolution.treatments import treated
from training.report.comparisons import GROUPS, LETTERS, TREATMENTS, Panel, panels, select
from training.report.equivalence import of_effect
from training.report.published import (
    COMMANDS,
    COSINES,
    FITNESS,
    GENERATIONS,
    PERMUTED_COSINES,
    RUNS_AN_ARM,
    title,
)
from training.report.statistics import Tested, median_error, median_interval

Array = NDArray[np.float64]


def cosines(vectors: Mapping[str, ArrayLike], words: Sequence[str]) -> Array:
    """Return the cosines (W, W) between the vectors of `words`."""
    rows = np.array([np.asarray(vectors[word], dtype=np.float64) for word in words])
    rows /= np.linalg.norm(rows, axis=1, keepdims=True)
    product: Array = rows @ rows.T
    return product


def permuted_cosines(vectors: Mapping[str, ArrayLike], seeds: Sequence[int]) -> Array:
    """Return the cosines (R, W, W) between the permuted commands of the control runs `seeds`."""
    return np.array([cosines(dict(zip(COMMANDS, treated(vectors, COMMANDS, 'control', seed),
                                      strict=True)), COMMANDS) for seed in seeds])


def table_1(vectors: Mapping[str, ArrayLike]) -> tuple[pd.DataFrame, float]:
    """Return the paper's Table I, ours (published), and the largest difference of the rounded."""
    ours = cosines(vectors, COMMANDS)
    return _triangle(ours, COSINES), _largest_difference(ours, COSINES)


def table_2(vectors: Mapping[str, ArrayLike], seeds: Sequence[int]) -> tuple[pd.DataFrame, str]:
    """Return the paper's Table II for the first of `seeds`, and a line on all of them."""
    every = permuted_cosines(vectors, seeds)
    upper = every[:, *np.triu_indices(len(COMMANDS), 1)]
    published = np.array([value for row in PERMUTED_COSINES for value in row])
    runs = 'the one control run' if len(seeds) == 1 else f'all {len(seeds)} control runs'
    line = (f'Over {runs}: mean {upper.mean():+.3f}, standard deviation {upper.std():.3f}, '
            f'from {upper.min():+.2f} to {upper.max():+.2f}; the paper’s sample: '
            f'mean {published.mean():+.3f}, standard deviation {published.std():.3f}.')
    return _triangle(every[0], PERMUTED_COSINES), line


def _triangle(ours: Array, published: Sequence[Sequence[float]]) -> pd.DataFrame:
    table = pd.DataFrame('', index=list(COMMANDS), columns=list(COMMANDS))
    for row, first in enumerate(COMMANDS):
        table.loc[first, first] = '1'
        for offset, second in enumerate(COMMANDS[row + 1:]):
            table.loc[first, second] = (f'{ours[row, row + 1 + offset]:.2f} '
                                        f'({published[row][offset]:.2f})')
    return table


def _largest_difference(ours: Array, published: Sequence[Sequence[float]]) -> float:
    return max(abs(round(float(ours[row, row + 1 + offset]), 2) - value)
               for row, values in enumerate(published) for offset, value in enumerate(values))


def table_3(table: pd.DataFrame, tested: Sequence[Tested]) -> pd.DataFrame:
    """
    Return the paper's Table III, ours and published: median fitness (SD), and p.

    `table` as `comparisons.per_run` returns it.
    """
    index = {one.comparison.panel: one for one in tested
             if one.comparison.question == 'fitness: E against C'}
    rows = []
    for panel in panels(table):
        arms = {name: select(table, panel, name).fitness.to_numpy(float) for name in TREATMENTS}
        published = FITNESS.get(panel[1]) if panel[0] == 'paper' else None
        row = {'robot': title(*panel)}
        for name in TREATMENTS:
            row[f'{LETTERS[name]}, here'] = _median_sd(arms[name])
        row['p, corrected'] = p_text(index[title(*panel)].p_holm) if title(*panel) in index else ''
        row |= {'C, paper': '', 'E, paper': '', 'p, paper': ''}
        if published is not None:
            row['C, paper'] = f'{published.control:.2f} ({published.control_sd:.2f})'
            row['E, paper'] = f'{published.word2vec:.2f} ({published.word2vec_sd:.2f})'
            row['p, paper'] = '< 0.05' if published.significant else '> 0.05'
        row['runs C, E'] = ', '.join(str(len(arms[name])) for name in TREATMENTS)
        rows.append(row)
    return pd.DataFrame(rows)


def _median_sd(values: Array) -> str:
    if not len(values):
        return ''
    deviation = f'{values.std(ddof=1):.2f}' if len(values) > 1 else '–'
    return f'{np.median(values):.2f} ({deviation}; {median_error(values):.2f})'


def displacement(table: pd.DataFrame) -> pd.DataFrame:
    """Return the medians and intervals behind the bars of figure 5, in body lengths."""
    rows = []
    for panel, treatment, arm in arms(table):
        row = {'robot': title(*panel), 'treatment': LETTERS[treatment], 'runs': str(len(arm))}
        for group in GROUPS:
            values = arm[group].dropna().to_numpy(float)
            low, high = median_interval(values)
            row[group] = f'{np.median(values):.2f} [{low:.2f}, {high:.2f}]' if len(values) else ''
        for group in ('stop', 'test'):
            row[f'path, {group}'] = _number(arm[f'{group}_path'].median())
        for behaviour in ('forward', 'backward'):
            row[f'{behaviour}, m'] = _number(arm[f'{behaviour}_m'].median())
        rows.append(row)
    return pd.DataFrame(rows)


def by_held_out(table: pd.DataFrame) -> pd.DataFrame:
    """Return the median displacement under each held-out word, in body lengths, and its runs."""
    words = list(dict.fromkeys(table.sort_values('seed').held_out))
    rows = []
    for panel, treatment, arm in arms(table):
        row = {'robot': title(*panel), 'treatment': LETTERS[treatment]}
        for word in words:
            values = arm[arm.held_out == word].test.dropna()
            row[word] = f'{values.median():.2f} ({len(values)})' if len(values) else ''
        rows.append(row)
    return pd.DataFrame(rows)


def arms(table: pd.DataFrame) -> Iterator[tuple[Panel, str, pd.DataFrame]]:
    """Yield (panel, treatment, its rows) of `table`, in the report's order, empty ones left out."""
    for panel in panels(table):
        for treatment in TREATMENTS:
            arm = select(table, panel, treatment)
            if len(arm):
                yield panel, treatment, arm


def _number(value: float) -> str:
    return f'{value:.2f}' if np.isfinite(value) else ''


def all_comparisons(tested: Sequence[Tested]) -> pd.DataFrame:
    """Return every comparison made as text, with exact p-values and effect sizes."""
    return pd.DataFrame([{
        'robot': one.comparison.panel,
        'comparison': one.comparison.question,
        'n': f'{len(one.comparison.first.values)}, {len(one.comparison.second.values)}',
        'medians': f'{one.comparison.first.median:.3g}, {one.comparison.second.median:.3g}',
        'U': f'{one.u:g}',
        'p': p_text(one.p) + ('' if one.method == 'exact' else ' (asymptotic)'),
        'p, Holm': p_text(one.p_holm),
        'stars': one.stars,
        'common language': f'{one.common_language:.2f}',
        'rank-biserial [95%]': f'{one.rank_biserial:+.2f} '
                               f'[{one.interval[0]:+.2f}, {one.interval[1]:+.2f}]',
        'that is': of_effect(one),
    } for one in tested])


def comparisons_csv(tested: Sequence[Tested]) -> pd.DataFrame:
    """Return every comparison made as numbers in full precision, for other programs to read."""
    return pd.DataFrame([{
        'robot': one.comparison.panel,
        'comparison': one.comparison.question,
        'n_first': len(one.comparison.first.values),
        'n_second': len(one.comparison.second.values),
        'median_first': one.comparison.first.median,
        'median_second': one.comparison.second.median,
        'u': one.u, 'p': one.p, 'method': one.method, 'p_holm': one.p_holm, 'stars': one.stars,
        'common_language': one.common_language, 'rank_biserial': one.rank_biserial,
        'rank_biserial_low': one.interval[0], 'rank_biserial_high': one.interval[1],
        'equivalence': of_effect(one),
    } for one in tested])


def p_text(p: float) -> str:
    """Return a p-value with three significant digits."""
    return '1' if p >= 0.9995 else f'{p:.3f}' if p >= 0.001 else f'{p:.2e}'


def timing(runs: pd.DataFrame) -> tuple[pd.DataFrame, float | None]:
    """
    Return measured times by body, and the whole study's projected core hours, if known.

    Medians: the first run of a body on a worker also compiles the engine.
    """
    rows = []
    per_generation = {}
    for panel in panels(runs):
        part = select(runs, panel)
        seconds = part.cpu_s.fillna(part.wall_s)
        per_generation[panel] = float((seconds / part.generations).median())
        rows.append({
            'robot': title(*panel), 'runs': str(len(part)),
            'generations': f'{part.generations.iloc[0]:,}',
            'wall s a run, median': f'{part.wall_s.median():.1f}',
            'CPU s a run, median': f'{seconds.median():.1f}',
            'evaluations a CPU s': f'{(part.evaluations / seconds).median():,.0f}',
            'in the engine': f'{part.engine_s.sum() / part.wall_s.sum():.0%}',
            f'CPU s for {GENERATIONS:,} generations': f'{GENERATIONS * per_generation[panel]:.0f}',
        })
    wanted = [('paper', body) for body in FITNESS] + [('balanced', 'quadruped')]
    if not all(panel in per_generation for panel in wanted):
        return pd.DataFrame(rows), None
    hours = sum(2 * RUNS_AN_ARM * GENERATIONS * per_generation[panel] / 3600 for panel in wanted)
    return pd.DataFrame(rows), float(np.round(hours, 2))
