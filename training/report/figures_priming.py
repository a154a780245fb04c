"""How words prime the hidden neurons, and where they send the body: the paper's figure 4."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import wrap

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from training.evolution.treatments import WORD_SETS
from training.report.exemplars import Exemplar, Shown

#: A colour a behaviour; stop words differ in lightness, the held-out one is drawn dashed.
COLOURS = {'forward': ('#d6604d', '#f4a582'), 'backward': ('#1b7837', '#7fbf7b'),
           'stop': ('#08306b', '#2171b5', '#6baed6', '#9ecae1')}


def priming(exemplars: Sequence[Exemplar], shown: Sequence[Shown], *, length_m: float) -> Figure:
    """
    Return heat-maps of the hidden neurons during priming, with the trajectories beside them.

    One column an exemplar: above, a heat-map a word (neurons 0 to 4 by elements of the vector, the
    state that the body starts with at the right edge); below, the ways of the body.
    """
    words = len(shown[0].words)
    figure = Figure(figsize=(4.6 * len(shown), 0.72 * words + 4.6), layout='constrained')
    grid = figure.subplots(words + 1, len(shown), squeeze=False,
                           height_ratios=[1.0] * words + [5.2])
    image = None
    for column, (exemplar, one) in enumerate(zip(exemplars, shown, strict=True)):
        for row, word in enumerate(one.words):
            axes = grid[row][column]
            image = axes.imshow(one.hidden[row].T, aspect='auto', cmap='RdBu_r', vmin=-1, vmax=1,
                                interpolation='nearest')
            axes.set_yticks([0, one.hidden.shape[2] - 1])
            axes.tick_params(labelsize=6)
            if row < words - 1:
                axes.set_xticks([])
            else:
                axes.set_xlabel('element of the word vector', fontsize=8)
            unheard = row == words - 1
            axes.set_ylabel(word, rotation=0, ha='right', va='center', fontsize=9,
                            fontweight='bold' if unheard else 'normal',
                            color=_colours(one.words)[word])
        grid[0][column].set_title(f'{"abc"[column]}  {_wrapped(exemplar)}', loc='left', fontsize=8)
        _trajectories(grid[words][column], one, length_m)
    if image is not None:
        figure.colorbar(image, ax=grid[:words, :], location='right', shrink=0.6, aspect=30,
                        label='value of a hidden neuron (0 to 4, top to bottom)')
    return figure


def _trajectories(axes: Axes, one: Shown, length_m: float) -> None:
    colours = _colours(one.words)
    for index, word in enumerate(one.words):
        way = one.trajectories[index] / length_m
        unheard = index == len(one.words) - 1
        axes.plot(way[:, 0], way[:, 1], color=colours[word],
                  linewidth=2.0 if unheard else 1.3, linestyle='--' if unheard else '-',
                  label=f'{word} (unheard)' if unheard else word, zorder=3 if unheard else 2)
        axes.plot(*way[-1], 's', color=colours[word], markersize=5,
                  zorder=4)
    reach = max(1.0, 1.08 * float(np.abs(one.trajectories / length_m).max()))
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach),
             xlabel='x (body lengths), forward to the right', ylabel='y (body lengths)')
    axes.set_aspect('equal')
    axes.axhline(0, color='#cccccc', linewidth=0.6, zorder=0)
    axes.axvline(0, color='#cccccc', linewidth=0.6, zorder=0)
    axes.legend(fontsize=7, frameon=False, loc='best')


def _colours(words: Sequence[str]) -> dict[str, str]:
    behaviours = {word: behaviour for always, stops in WORD_SETS.values()
                  for word, behaviour in always + stops}
    used: dict[str, int] = {}
    colours = {}
    for word in words:
        behaviour = behaviours[word]
        number = used[behaviour] = used.get(behaviour, -1) + 1
        colours[word] = COLOURS[behaviour][number % len(COLOURS[behaviour])]
    # The last word is the held-out one.
    return {**colours, words[-1]: '#e08214'}


def _wrapped(exemplar: Exemplar) -> str:
    note = '' if exemplar.met else ' (no such champion: the fittest other one is shown)'
    return '\n'.join(wrap(exemplar.kind + note, 52))
