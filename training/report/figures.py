"""Figures of the paper, redrawn from a study's store: displacement bars, fitness, effect sizes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from training.report import style
from training.report.comparisons import ELSEWHERE, GROUPS, LETTERS, TREATMENTS, Panel, select
from training.report.published import FITNESS, title
from training.report.statistics import Tested, median_interval
from training.report.style import COLOURS, GREY, TREATMENT_COLOURS

GROUP_NAMES = {'move': 'Move', 'stop': 'Stop', 'test': 'Test'}
#: Bars of one group stand this far from its middle.
OFFSET = {'control': -0.2, 'experimental': 0.2}
Index = dict[tuple[str, str], Tested]


def index_of(tested: Sequence[Tested]) -> Index:
    """Return (panel's title, question) -> outcome."""
    return {(one.comparison.panel, one.comparison.question): one for one in tested}


@style.styled
def bars(table: pd.DataFrame, tested: Sequence[Tested], shown: Sequence[Panel]) -> Figure:
    """
    Return the displacement bars of `shown` panels: the paper's figures 5 and 6.

    Bars are medians over champions, whiskers bootstrapped 95% confidence intervals of the median,
    dots the champions. The axis is linear to one body length and logarithmic above, or the stop
    commands' bars would be too low to read. Stars over black brackets: corrected significance
    within a treatment and between treatments; red: between treatments under the unheard word.
    """
    figure, panels, spare = style.panel_grid(shown, columns=3, height_in=2.35)
    index = index_of(tested)
    for axes, panel in zip(panels, shown, strict=True):
        _bar_panel(axes, table, index, panel)
    for axes in style.left_most(panels):
        axes.set_ylabel('net displacement (body lengths)')
    handles: list[Artist] = [Patch(facecolor=COLOURS[group],
                                   label=f'{GROUP_NAMES[group]}: {meaning}')
                             for group, meaning in (('move', 'trained move commands'),
                                                    ('stop', 'trained stop commands'),
                                                    ('test', 'the unheard stop word'))]
    style.legend(figure, handles + list(style.treatment_patches()), spare,
                 columns=3 if len(shown) > 2 else 2)
    return figure


def _bar_panel(axes: Axes, table: pd.DataFrame, index: Index, panel: Panel) -> None:
    rng = np.random.default_rng(0)
    counts, top = {}, 0.0
    for place, group in enumerate(GROUPS):
        for treatment in TREATMENTS:
            arm = select(table, panel, treatment)
            counts[treatment] = len(arm)
            values = arm[group].dropna().to_numpy(float)
            if not len(values):
                continue
            x = place + OFFSET[treatment]
            style.bar(axes, x, float(np.median(values)), median_interval(values), width=0.36,
                      colour=COLOURS[group], treatment=treatment)
            axes.plot(x + rng.uniform(-0.13, 0.13, len(values)), values, 'o', color=style.BLACK,
                      markersize=1.4, markeredgewidth=0, alpha=0.45, zorder=3)
            top = max(top, float(values.max()))
    axes.set_xlim(-0.6, 2.6)
    axes.set_xticks([place + offset for place in range(3) for offset in OFFSET.values()],
                    [LETTERS[name] for _ in range(3) for name in OFFSET])
    for place, group in enumerate(GROUPS):
        axes.text(place, -0.12, GROUP_NAMES[group], transform=axes.get_xaxis_transform(),
                  ha='center', va='top', fontweight='bold')
    style.squeeze(axes, top)
    axes.set_ylim(0, _brackets(axes, index, title(*panel), top))
    axes.text(1.0, 0.5, 'runs: ' + ', '.join(f'{counts[name]} {LETTERS[name]}'
                                             for name in TREATMENTS),
              transform=axes.transAxes, ha='left', va='center', rotation=270, fontsize=5.5,
              color=GREY)


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


def _brackets(axes: Axes, index: Index, panel: str, top: float) -> float:
    """Draw the significant comparisons' brackets; return the axis' upper end."""
    # Places on the squeezed axis, so that brackets stand evenly apart.
    step = 0.085 * max(float(style.squeezed(top)), 1e-9)
    height = float(style.squeezed(top)) + step
    for questions in _LEVELS:
        drawn = False
        for question in questions:
            one = index.get((panel, question))
            between_tests = question == 'test: E against C'
            if one is None or not (one.stars or between_tests):
                continue
            left, right = BRACKETS[question]
            colour = style.RED if between_tests else 'black'
            axes.plot([left, left, right, right],
                      style.unsqueezed([height - 0.25 * step, height, height,
                                        height - 0.25 * step]),
                      color=colour, linewidth=0.7, clip_on=False)
            # An asterisk hangs in the upper half of its line: lower it onto the bracket.
            axes.text((left + right) / 2,
                      float(style.unsqueezed(height - (0.3 if one.stars else 0.0) * step)),
                      one.stars or 'n.s.', color=colour, ha='center', va='bottom', fontsize=6.5)
            drawn = True
        if drawn:
            height += step
    return float(style.unsqueezed(height + 0.4 * step))


@style.styled
def fitness(history: pd.DataFrame, shown: Sequence[Panel]) -> Figure:
    """
    Return the best fitness over generations: median and middle half of the runs.

    Dashed lines: the medians of the paper's Table III, after its 6,000 generations.
    """
    figure, panels, spare = style.panel_grid(shown, columns=3, height_in=1.45)
    for axes, panel in zip(panels, shown, strict=True):
        for treatment in TREATMENTS:
            runs = select(history, panel, treatment)
            if runs.empty:
                continue
            groups = runs.groupby('generation').best_fitness
            middle, low, high = (groups.quantile(share) for share in (0.5, 0.25, 0.75))
            colour = TREATMENT_COLOURS[treatment]
            axes.fill_between(low.index, low, high, color=colour, alpha=0.25, linewidth=0)
            axes.plot(middle.index, middle, color=colour)
        if panel[0] == 'paper' and panel[1] in FITNESS:
            row = FITNESS[panel[1]]
            for value, treatment in ((row.control, 'control'), (row.word2vec, 'experimental')):
                axes.axhline(value, color=TREATMENT_COLOURS[treatment], linestyle='--',
                             linewidth=0.8)
        axes.set_ylim(bottom=0)
        axes.set_xlim(left=0)
    for axes in style.left_most(panels):
        axes.set_ylabel('fitness of the best (m)')
    for axes in style.lowest(panels):
        axes.set_xlabel('generation')
    solid = [Line2D([], [], color=TREATMENT_COLOURS[name], label=style.NAMES[name])
             for name in TREATMENTS]
    dashed = [Line2D([], [], color=TREATMENT_COLOURS[name], linestyle='--',
                     label=f'paper: {style.NAMES[name]}') for name in TREATMENTS]
    style.legend(figure, solid + dashed, spare)
    return figure


@style.styled
def effects(tested: Sequence[Tested], shown: Sequence[Panel]) -> Figure:
    """
    Return the effect of word2vec vectors on movement under the unheard stop word, everywhere.

    One row a panel: the rank-biserial correlation of E against C with its 95% confidence interval,
    as evolved, from perturbed starts and in PyBullet. Below 0: word2vec champions move less, as
    the paper has it. Filled marks: significant after correction.
    """
    index = index_of(tested)
    figure = Figure(figsize=(style.PAGE_IN * 0.75, 0.34 * len(shown) + 0.85), layout='constrained')
    axes = figure.subplots()
    for row, panel in enumerate(shown):
        for turn, (condition, question, colour, mark) in enumerate(MARKS):
            one = index.get((title(*panel), question))
            if one is None:
                continue
            y = row + (turn - 1) * 0.24
            low, high = one.interval
            axes.plot([low, high], [y, y], color=colour, linewidth=1.1)
            axes.plot(one.rank_biserial, y, mark, color=colour, markersize=4.2,
                      markerfacecolor=colour if one.stars else 'white', label=condition)
    axes.axvline(0, color=style.LIGHT, linewidth=0.8, zorder=0)
    axes.set_yticks(range(len(shown)), [title(*panel) for panel in shown])
    axes.set(xlim=(-1.03, 1.03), ylim=(len(shown) - 0.5, -0.5), xlabel=(
        'rank-biserial correlation of displacement under the unheard stop word\n'
        '← word2vec champions move less          word2vec champions move more →'))
    present = set(axes.get_legend_handles_labels()[1])
    handles: list[Artist] = [Line2D([], [], color=colour, marker=mark, markersize=4.2,
                                    label=condition)
                             for condition, _, colour, mark in MARKS if condition in present]
    handles.append(Line2D([], [], color=GREY, marker='o', markersize=4.2, linestyle='',
                          markerfacecolor='white', label='hollow: corrected p ≥ 0.01'))
    figure.legend(handles=handles, loc='outside lower center', ncols=4)
    return figure


#: Condition, the comparison that it shows, colour, mark.
MARKS = tuple((condition, question, colour, mark) for (condition, question), colour, mark in zip(
    (('as evolved', 'test: E against C'),
     *((name, f'test, {name}: E against C') for name in ELSEWHERE)),
    (style.BLACK, '#0072b2', '#d55e00'), ('o', 's', 'D'), strict=True))
