"""Whether the finding holds elsewhere: other starts, another engine, words that no run heard."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray
from scipy.stats import bootstrap

from training.report.comparisons import LETTERS, TREATMENTS, Panel, select
from training.report.figures import COLOURS, GREY, NAMES, TREATMENT_COLOURS
from training.report.published import title

CONDITIONS = ('as evolved', 'perturbed', 'pybullet')
QUESTIONS = ('forward', 'backward', 'stop', 'held out')
SHADES = {'as evolved': '#2b2b2b', 'perturbed': '#7a7a7a', 'pybullet': '#c3a15a'}


def conditions(rates: pd.DataFrame, shown: Sequence[Panel]) -> Figure:
    """
    Return the rate of right behaviour under the runs' own words, by condition.

    Bars: mean over champions; whiskers: bootstrapped 95% confidence interval of that mean.
    """
    present = [name for name in CONDITIONS if (rates.condition == name).any()]
    figure, grid = _grid(shown, 4.3, 2.6)
    for number, panel in enumerate(shown):
        axes = grid[number]
        for place, question in enumerate(QUESTIONS):
            for side, treatment in enumerate(TREATMENTS):
                rows = select(rates, panel, treatment)
                for turn, condition in enumerate(present):
                    values = rows[(rows.question == question)
                                  & (rows.condition == condition)].rate.to_numpy(float)
                    if not len(values):
                        continue
                    x = place + (side - 0.5) * 0.44 + (turn - (len(present) - 1) / 2) * 0.13
                    mean, low, high = mean_interval(values)
                    axes.bar(x, mean, 0.12, facecolor=SHADES[condition], edgecolor='white',
                             hatch='/////' if treatment == 'control' else None, linewidth=0.3)
                    axes.errorbar(x, mean, [[mean - low], [high - mean]], color='black',
                                  linewidth=0.8, capsize=1.5)
        ticks = [(place + (side - 0.5) * 0.44, LETTERS[name])
                 for place in range(4) for side, name in enumerate(TREATMENTS)]
        axes.set_xticks([x for x, _ in ticks], [label for _, label in ticks], fontsize=8)
        for place, question in enumerate(QUESTIONS):
            axes.text(place, -0.14, question, transform=axes.get_xaxis_transform(), ha='center',
                      va='top', fontsize=8)
        _rate_axes(axes, panel)
    handles = [Patch(facecolor=SHADES[name], label=name) for name in present]
    handles.append(Patch(facecolor='white', edgecolor=GREY, hatch='////', label='hatched: C'))
    figure.legend(handles=handles, loc='outside lower center', ncols=4, frameon=False, fontsize=8)
    return figure


def lexicon(rates: pd.DataFrame, shown: Sequence[Panel]) -> Figure:
    """
    Return the rate of each behaviour under its synonyms and under unrelated words.

    A pair of equal bars means that the champions do not hear the difference.
    """
    figure, grid = _grid(shown, 3.6, 2.6)
    for number, panel in enumerate(shown):
        axes = grid[number]
        for place, behaviour in enumerate(('forward', 'backward', 'stop')):
            for side, treatment in enumerate(TREATMENTS):
                rows = select(rates, panel, treatment)
                rows = rows[rows.behaviour == behaviour]
                for turn, column in enumerate(('synonyms', 'unrelated')):
                    if rows.empty:
                        continue
                    x = place + (side - 0.5) * 0.44 + (turn - 0.5) * 0.18
                    mean, low, high = mean_interval(rows[column].to_numpy(float))
                    colour = COLOURS['stop' if behaviour == 'stop' else 'move']
                    axes.bar(x, mean, 0.17, facecolor=colour if turn == 0 else '#d0d0d0',
                             edgecolor='white', linewidth=0.3,
                             hatch='/////' if treatment == 'control' else None)
                    axes.errorbar(x, mean, [[mean - low], [high - mean]], color='black',
                                  linewidth=0.8, capsize=1.5)
        ticks = [(place + (side - 0.5) * 0.44, LETTERS[name])
                 for place in range(3) for side, name in enumerate(TREATMENTS)]
        axes.set_xticks([x for x, _ in ticks], [label for _, label in ticks], fontsize=8)
        for place, behaviour in enumerate(('forward', 'backward', 'stop')):
            axes.text(place, -0.14, behaviour, transform=axes.get_xaxis_transform(), ha='center',
                      va='top', fontsize=8)
        _rate_axes(axes, panel)
    handles = [Patch(facecolor=COLOURS['move'], label='synonyms of forward, backward'),
               Patch(facecolor=COLOURS['stop'], label='synonyms of stop'),
               Patch(facecolor='#d0d0d0', label='unrelated words'),
               Patch(facecolor='white', edgecolor=GREY, hatch='////', label='hatched: C')]
    figure.legend(handles=handles, loc='outside lower center', ncols=4, frameon=False, fontsize=8)
    return figure


def similarity(words: pd.DataFrame, cosines: dict[str, float], panel: Panel) -> Figure:
    """
    Return how the share of champions that stop grows with a word's cosine to the stop commands.

    `words` as `behaviour.by_word` returns it; `cosines`: word -> largest cosine to a stop command.
    Lines: least-squares fits, to lead the eye.
    """
    figure = Figure(figsize=(5.6, 3.6), layout='constrained')
    axes = figure.subplots()
    for treatment in TREATMENTS:
        rows = select(words, panel, treatment)
        rows = rows[rows.word.isin(list(cosines))]
        if len(rows) < 2:
            continue
        x, y = rows.word.map(cosines).to_numpy(float), rows.stop.to_numpy(float)
        colour = TREATMENT_COLOURS[treatment]
        axes.plot(x, y, '.', color=colour, markersize=5, alpha=0.5, markeredgewidth=0)
        slope, level = np.polyfit(x, y, 1)
        ends = np.array([x.min(), x.max()])
        axes.plot(ends, level + slope * ends, color=colour, label=NAMES[treatment])
    axes.set(xlabel="the word's largest cosine to a stop command", ylim=(-0.02, 1.02),
             ylabel='share of champions that stop')
    axes.set_title(title(*panel), loc='left', fontsize=10)
    axes.legend(frameon=False, fontsize=8)
    axes.spines[['top', 'right']].set_visible(False)
    return figure


def mean_interval(values: NDArray[np.float64], seed: int = 0) -> tuple[float, float, float]:
    """Return the mean of `values` and its bootstrapped 95% confidence interval."""
    mean = float(np.mean(values))
    if np.ptp(values) == 0:
        return mean, mean, mean
    interval = bootstrap((values,), np.mean, n_resamples=5000, method='percentile',
                         vectorized=True, rng=np.random.default_rng(seed)).confidence_interval
    return mean, float(interval.low), float(interval.high)


def _grid(shown: Sequence[Panel], width: float, height: float) -> tuple[Figure, list[Axes]]:
    columns = min(len(shown), 3)
    lines = -(-len(shown) // columns)
    figure = Figure(figsize=(width * columns, height * lines + 0.4), layout='constrained')
    grid = list(figure.subplots(lines, columns, squeeze=False).flat)
    for axes in grid[len(shown):]:
        axes.set_axis_off()
    for axes in grid[:len(shown):columns]:
        axes.set_ylabel('rate of right behaviour', fontsize=8)
    return figure, grid


def _rate_axes(axes: Axes, panel: Panel) -> None:
    axes.set_ylim(0, 1.03)
    axes.set_title(title(*panel), loc='left', fontsize=9)
    axes.tick_params(axis='y', labelsize=8)
    axes.spines[['top', 'right']].set_visible(False)
