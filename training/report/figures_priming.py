"""How words prime the hidden neurons, and where they send the body: the paper's figure 4."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import wrap

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from training.evolution.treatments import WORD_SETS
from training.report import style
from training.report.exemplars import Exemplar, Shown

#: Colours a behaviour; its words differ in lightness. The unheard word is black and dashed.
COLOURS = {'forward': ('#d55e00', '#f0a35e'), 'backward': ('#009e73', '#7fd1b9'),
           'stop': ('#0b3d91', '#0072b2', '#56b4e9', '#9fd3f2')}
UNHEARD = 'black'


@style.styled
def priming(exemplars: Sequence[Exemplar], shown: Sequence[Shown], *, length_m: float) -> Figure:
    """
    Return heat-maps of the hidden neurons during priming, with the trajectories beside them.

    One column an exemplar: above, a heat-map a word (neurons 0 to 4 by elements of the vector, the
    state that the body starts with at the right edge); below, the ways of the body.
    """
    words = len(shown[0].words)
    figure = Figure(figsize=(style.PAGE_IN * max(len(shown), 2) / 3, 0.36 * words + 2.95),
                    layout=ConstrainedLayoutEngine(h_pad=0.02, w_pad=0.03))
    grid = figure.subplots(words + 1, len(shown), squeeze=False,
                           height_ratios=[1.0] * words + [5.6])
    image = None
    for column, (exemplar, one) in enumerate(zip(exemplars, shown, strict=True)):
        for row, word in enumerate(one.words):
            axes = grid[row][column]
            image = axes.imshow(one.hidden[row].T, aspect='auto', cmap='RdBu_r', vmin=-1, vmax=1,
                                interpolation='nearest')
            axes.spines[['top', 'right']].set_visible(True)
            axes.set_yticks([0, one.hidden.shape[2] - 1])
            axes.tick_params(labelsize=5)
            if row < words - 1:
                axes.set_xticks([])
            else:
                axes.set_xlabel('element of the word vector')
            unheard = row == words - 1
            axes.set_ylabel(word, rotation=0, ha='right', va='center',
                            fontweight='bold' if unheard else 'normal',
                            color=_colours(one.words)[word])
        grid[0][column].set_title(f'{style.LETTERS[column]}  {_wrapped(exemplar)}', loc='left',
                                  fontsize=6)
        _trajectories(grid[words][column], one, length_m)
    if image is not None:
        bar = figure.colorbar(image, ax=grid[:words, :], location='right', shrink=0.7, aspect=30,
                              pad=0.01, ticks=[-1, 0, 1])
        bar.set_label('hidden neuron’s value\n(neurons 0 to 4, top to bottom)')
    return figure


def _trajectories(axes: Axes, one: Shown, length_m: float) -> None:
    colours = _colours(one.words)
    last = len(one.words) - 1
    for index, word in enumerate(one.words):
        way = one.trajectories[index] / length_m
        unheard = index == last
        axes.plot(way[:, 0], way[:, 1], color=colours[word], linewidth=1.2 if unheard else 0.9,
                  linestyle=(0, (2, 1.2)) if unheard else '-', zorder=3 if unheard else 2,
                  label=f'{word} (unheard)' if unheard else word)
        # Hollow and larger, so that it does not hide the trained words' ends below it.
        axes.plot(*way[-1], 's', color=colours[word], markersize=5.5 if unheard else 3.2,
                  markerfacecolor='none' if unheard else colours[word], zorder=5 if unheard else 4)
    reach = max(1.0, 1.08 * float(np.abs(one.trajectories / length_m).max()))
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach),
             xlabel='x (body lengths), forward to the right', ylabel='y (body lengths)')
    axes.set_aspect('equal')
    axes.axhline(0, color=style.LIGHT, linewidth=0.4, zorder=0)
    axes.axvline(0, color=style.LIGHT, linewidth=0.4, zorder=0)
    axes.legend(fontsize=5.5, loc='best', labelspacing=0.2)


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
    return {**colours, words[-1]: UNHEARD}


def _wrapped(exemplar: Exemplar) -> str:
    note = '' if exemplar.met else ' (no such champion: the fittest other one is shown)'
    return '\n'.join(wrap(exemplar.kind + note, 40))
