"""Whether the finding holds elsewhere: other starts, another engine, words that no run heard."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray
from scipy.stats import bootstrap

from training.report import style
from training.report.behaviour import BEHAVIOURS
from training.report.comparisons import LETTERS, TREATMENTS, Panel, select
from training.report.style import COLOURS, TREATMENT_COLOURS

QUESTIONS = ('forward', 'backward', 'stop', 'held out')
#: Condition in the store -> how figures and tables call it, and its colour.
CONDITIONS = {'as evolved': 'as evolved', 'perturbed': 'perturbed starts', 'pybullet': 'PyBullet'}
SHADES = {'as evolved': '#8a8a8a', 'perturbed': '#56b4e9', 'pybullet': '#d55e00'}
#: Bars of one treatment stand this far from their group's middle.
SIDE = {'control': -0.22, 'experimental': 0.22}
#: A lower bar cannot be seen: a 0 stands in its place.
LEAST = 0.005


@style.styled
def conditions(rates: pd.DataFrame, shown: Sequence[Panel]) -> Figure:
    """
    Return the rate of right behaviour under the runs' own words, by condition.

    Bars: mean over champions; whiskers: bootstrapped 95% confidence interval of that mean.
    """
    present = [name for name in CONDITIONS if (rates.condition == name).any()]
    figure, panels, spare = style.panel_grid(shown, columns=3, height_in=1.6)
    for axes, panel in zip(panels, shown, strict=True):
        for place, question in enumerate(QUESTIONS):
            for treatment in TREATMENTS:
                rows = select(rates, panel, treatment)
                rows = rows[rows.question == question]
                for turn, condition in enumerate(present):
                    values = rows[rows.condition == condition].rate.to_numpy(float)
                    x = place + SIDE[treatment] + (turn - (len(present) - 1) / 2) * 0.135
                    _rate_bar(axes, x, values, 0.125, SHADES[condition], treatment)
        _rate_axes(axes, QUESTIONS)
    for axes in style.left_most(panels):
        axes.set_ylabel('rate of right behaviour')
    handles = [Patch(facecolor=SHADES[name], label=CONDITIONS[name]) for name in present]
    style.legend(figure, handles + style.treatment_patches(), spare, columns=3)
    return figure


@style.styled
def lexicon(rates: pd.DataFrame, own: pd.DataFrame, shown: Sequence[Panel]) -> Figure:
    """
    Return the rate of each behaviour under its synonyms and, grey, under unrelated words.

    A pair of equal bars means that the champions do not hear the difference. Beside the synonyms of
    stop stands the paper's own test, the held-out stop command. `own` as `behaviour.own_words`
    returns it.
    """
    figure, panels, spare = style.panel_grid(shown, columns=3, height_in=1.6)
    tested = own[(own.condition == 'as evolved') & (own.question == 'held out')]
    for axes, panel in zip(panels, shown, strict=True):
        for place, behaviour in enumerate(BEHAVIOURS):
            for treatment in TREATMENTS:
                rows = select(rates, panel, treatment)
                rows = rows[rows.behaviour == behaviour]
                stop = behaviour == 'stop'
                values = [(select(tested, panel, treatment).rate, COLOURS['test'])] if stop else []
                values += [(rows.synonyms, COLOURS['stop' if stop else 'move']),
                           (rows.unrelated, style.LIGHT)]
                for turn, (one, colour) in enumerate(values):
                    x = place + SIDE[treatment] + (turn - (len(values) - 1) / 2) * 0.135
                    _rate_bar(axes, x, one.dropna().to_numpy(float), 0.125, colour, treatment)
        _rate_axes(axes, BEHAVIOURS)
    for axes in style.left_most(panels):
        axes.set_ylabel('rate of the behaviour')
    handles = [Patch(facecolor=colour, label=label) for colour, label in (
        (COLOURS['move'], 'unheard synonyms of forward, backward'),
        (COLOURS['test'], 'the held-out stop command'),
        (COLOURS['stop'], 'unheard synonyms of stop'), (style.LIGHT, 'unrelated words'))]
    style.legend(figure, handles + style.treatment_patches(), spare, columns=3)
    return figure


@style.styled
def by_cosine(shares: pd.DataFrame, shown: Sequence[Panel]) -> Figure:
    """
    Return how the share of words that stop a champion grows with their cosine to stop commands.

    `shares` as `behaviour.by_cosine` returns it. Lines: mean over champions, at the mean cosine of
    a bin's words; whiskers: bootstrapped 95% confidence interval of the mean.
    """
    figure, panels, spare = style.panel_grid(shown, columns=3, height_in=1.5)
    for axes, panel in zip(panels, shown, strict=True):
        for treatment, shift in (('control', -0.006), ('experimental', 0.006)):
            rows = select(shares, panel, treatment)
            if rows.empty:
                continue
            points = [(cosine, *mean_interval(values.to_numpy(float)))
                      for cosine, values in rows.groupby('cosine').stopped]
            x, y, low, high = np.array(points).T
            axes.errorbar(x + shift, y, [np.maximum(y - low, 0), np.maximum(high - y, 0)],
                          color=TREATMENT_COLOURS[treatment], marker='o', markersize=2.5,
                          capsize=1.5, elinewidth=0.7,
                          linestyle='--' if treatment == 'control' else '-')
        axes.set_ylim(0, 1.03)
    for axes in style.left_most(panels):
        axes.set_ylabel('share of words that stop')
    for axes in style.lowest(panels):
        axes.set_xlabel('cosine to the nearest stop command')
    handles: list[Artist] = [Line2D([], [], color=TREATMENT_COLOURS[name], marker='o',
                                    markersize=2.5, label=style.NAMES[name],
                                    linestyle='--' if name == 'control' else '-')
                             for name in TREATMENTS]
    style.legend(figure, handles, spare)
    return figure


def mean_interval(values: NDArray[np.float64], seed: int = 0) -> tuple[float, float, float]:
    """Return the mean of `values` and its bootstrapped 95% confidence interval."""
    mean = float(np.mean(values))
    if np.ptp(values) == 0:
        return mean, mean, mean
    interval = bootstrap((values,), np.mean, n_resamples=5000, method='percentile',
                         vectorized=True, rng=np.random.default_rng(seed)).confidence_interval
    return mean, float(interval.low), float(interval.high)


def _rate_bar(axes: Axes, x: float, values: NDArray[np.float64], width: float, colour: str,
              treatment: str) -> None:
    if len(values):
        mean, low, high = mean_interval(values)
        style.bar(axes, x, mean, (low, high), width=width, colour=colour, treatment=treatment)
        if mean < LEAST:
            # Without it, measured and never right looks like not measured.
            axes.text(x, 0.012, '0', ha='center', va='bottom', fontsize=5.5)


def _rate_axes(axes: Axes, groups: Sequence[str]) -> None:
    ticks = [(place + side, LETTERS[name]) for place in range(len(groups))
             for name, side in SIDE.items()]
    axes.set_xticks([x for x, _ in ticks], [label for _, label in ticks])
    axes.set_xlim(-0.5, len(groups) - 0.5)
    for place, group in enumerate(groups):
        axes.text(place, -0.17, group, transform=axes.get_xaxis_transform(), ha='center', va='top')
    axes.set_ylim(0, 1.03)
