"""
Figures of the paper, redrawn from a study's store: displacement bars and fitness over generations.

All figures are made without a display and without global state. Colours are the paper's (move
green, stop orange, test blue) in tones that colour-blind readers tell apart; control bars are
hatched.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from training.report.comparisons import GROUPS, LETTERS, TREATMENTS, Panel, select
from training.report.published import FITNESS, title
from training.report.statistics import Tested, median_interval

COLOURS = {'move': '#2a9d60', 'stop': '#e08214', 'test': '#3b78b8'}
TREATMENT_COLOURS = {'control': '#8c8c8c', 'experimental': '#2166ac'}
NAMES = {'control': 'control (C)', 'experimental': 'word2vec (E)'}
GROUP_NAMES = {'move': 'Move', 'stop': 'Stop', 'test': 'Test'}
GREY = '#444444'
#: Bars of one group stand this far from its middle.
OFFSET = {'control': -0.2, 'experimental': 0.2}


def bars(table: pd.DataFrame, tested: Sequence[Tested], shown: Sequence[Panel]) -> Figure:
    """
    Return the displacement bars of `shown` panels: the paper's figures 5 and 6.

    Bars are medians over champions, whiskers bootstrapped 95% confidence intervals of the median,
    dots the champions. Stars over black brackets: corrected significance within a treatment and
    between treatments; red: between treatments under the unheard word.
    """
    columns = min(len(shown), 3)
    lines = -(-len(shown) // columns)
    figure = Figure(figsize=(4.1 * columns, 4.0 * lines + 0.5), layout='constrained')
    grid = figure.subplots(lines, columns, squeeze=False)
    index = {(one.comparison.panel, one.comparison.question): one for one in tested}
    for number, axes in enumerate(grid.flat):
        if number >= len(shown):
            axes.set_axis_off()
            continue
        _bar_panel(axes, table, index, shown[number], 'abcdefghijkl'[number])
    for row in grid:
        row[0].set_ylabel('net displacement (body lengths)')
    legend = [Patch(facecolor=COLOURS[group], label=f'{GROUP_NAMES[group]}: {meaning}')
              for group, meaning in (('move', 'trained move commands'),
                                     ('stop', 'trained stop commands'),
                                     ('test', 'the unheard stop word'))]
    legend += [Patch(facecolor='white', edgecolor=GREY, hatch='////', label='C: permuted vectors'),
               Patch(facecolor='white', edgecolor=GREY, label='E: word2vec vectors')]
    figure.legend(handles=legend, loc='outside lower center', ncols=(2, 3, 5)[columns - 1],
                  frameon=False, fontsize=8)
    return figure


def _bar_panel(axes: Axes, table: pd.DataFrame, index: dict[tuple[str, str], Tested],
               panel: Panel, letter: str) -> None:
    rng = np.random.default_rng(0)
    counts, top = {}, 0.0
    for place, group in enumerate(GROUPS):
        for treatment in TREATMENTS:
            values = select(table, panel, treatment)[group].to_numpy(float)
            counts[treatment] = len(values)
            if not len(values):
                continue
            x = place + OFFSET[treatment]
            median, (low, high) = float(np.median(values)), median_interval(values)
            axes.bar(x, median, 0.36, facecolor=COLOURS[group], edgecolor='white',
                     hatch='////' if treatment == 'control' else None, linewidth=0.5, zorder=2,
                     alpha=0.9)
            axes.plot(x + rng.uniform(-0.12, 0.12, len(values)), values, '.', color=GREY,
                      markersize=4, alpha=0.5, markeredgewidth=0, zorder=3)
            axes.errorbar(x, median, [[median - low], [high - median]], color='black',
                          capsize=3, linewidth=1.3, zorder=4)
            top = max(top, high, float(np.percentile(values, 95)))
    axes.set_xlim(-0.6, 2.6)
    axes.set_xticks([place + offset for place in range(3) for offset in OFFSET.values()],
                    [LETTERS[name] for _ in range(3) for name in OFFSET])
    for place, group in enumerate(GROUPS):
        axes.text(place, -0.11, GROUP_NAMES[group], transform=axes.get_xaxis_transform(),
                  ha='center', va='top', fontsize=9, color=COLOURS[group], fontweight='bold')
    height = _brackets(axes, index, title(*panel), top)
    axes.set_ylim(0, height)
    axes.set_title(f'{letter}  {title(*panel)}', loc='left', fontsize=10)
    axes.text(1.0, 1.02, 'n = ' + ', '.join(f'{counts[name]} {LETTERS[name]}'
                                            for name in TREATMENTS),
              transform=axes.transAxes, ha='right', fontsize=7, color=GREY)
    axes.spines[['top', 'right']].set_visible(False)


#: Question -> ends of its bracket, from left to right on the axis.
BRACKETS = {
    'move: E against C': (-0.2, 0.2), 'stop: E against C': (0.8, 1.2),
    'test: E against C': (1.8, 2.2),
    'C: move against stop': (-0.2, 0.8), 'E: move against stop': (0.2, 1.2),
    'C: test against stop': (0.8, 1.8), 'E: test against stop': (1.2, 2.2),
}
_LEVELS = (('move: E against C', 'stop: E against C', 'test: E against C'),
           ('C: move against stop',), ('E: move against stop',),
           ('C: test against stop',), ('E: test against stop',))


def _brackets(axes: Axes, index: dict[tuple[str, str], Tested], panel: str, top: float) -> float:
    """Draw the significant comparisons' brackets; return the axis' upper end."""
    step = 0.085 * max(top, 1e-9)
    height = top + step
    for questions in _LEVELS:
        drawn = False
        for question in questions:
            one = index.get((panel, question))
            between_tests = question == 'test: E against C'
            if one is None or not (one.stars or between_tests):
                continue
            left, right = BRACKETS[question]
            colour = '#c1121f' if between_tests else 'black'
            axes.plot([left, left, right, right],
                      [height - 0.25 * step, height, height, height - 0.25 * step],
                      color=colour, linewidth=1.0, clip_on=False)
            # An asterisk hangs in the upper half of its line: lower it onto the bracket.
            axes.text((left + right) / 2, height - (0.3 if one.stars else 0.0) * step,
                      one.stars or 'n.s.', color=colour, ha='center', va='bottom', fontsize=8)
            drawn = True
        if drawn:
            height += step
    return height + 0.4 * step


def fitness(history: pd.DataFrame, shown: Sequence[Panel]) -> Figure:
    """
    Return the best fitness over generations: median and middle half of the runs.

    Dashed lines: the medians of the paper's Table III, after its 6,000 generations.
    """
    columns = min(len(shown), 4)
    lines = -(-len(shown) // columns)
    figure = Figure(figsize=(3.3 * columns, 2.7 * lines + 0.4), layout='constrained')
    grid = figure.subplots(lines, columns, squeeze=False)
    for number, axes in enumerate(grid.flat):
        if number >= len(shown):
            axes.set_axis_off()
            continue
        panel = shown[number]
        for treatment in TREATMENTS:
            runs = select(history, panel, treatment)
            if runs.empty:
                continue
            groups = runs.groupby('generation').best_fitness
            middle, low, high = (groups.quantile(share) for share in (0.5, 0.25, 0.75))
            colour = TREATMENT_COLOURS[treatment]
            axes.fill_between(low.index, low, high, color=colour, alpha=0.2, linewidth=0)
            axes.plot(middle.index, middle, color=colour, label=NAMES[treatment], linewidth=1.5)
        if panel[0] == 'paper' and panel[1] in FITNESS:
            row = FITNESS[panel[1]]
            for value, treatment in ((row.control, 'control'), (row.word2vec, 'experimental')):
                axes.axhline(value, color=TREATMENT_COLOURS[treatment], linestyle='--',
                             linewidth=0.9, label=f'paper, {NAMES[treatment]}')
        axes.set_title(title(*panel), loc='left', fontsize=9)
        axes.set_ylim(bottom=0)
        axes.set_xlim(left=0)
        axes.spines[['top', 'right']].set_visible(False)
        axes.tick_params(labelsize=8)
    for row_axes in grid:
        row_axes[0].set_ylabel('fitness of the best (m)', fontsize=8)
    for axes in grid[-1]:
        axes.set_xlabel('generation', fontsize=8)
    entries: dict[str, Artist] = {}
    for axes in grid.flat:
        entries.update(zip(*reversed(axes.get_legend_handles_labels()), strict=True))
    figure.legend(list(entries.values()), list(entries), loc='outside lower center', ncols=4,
                  frameon=False, fontsize=8)
    return figure
