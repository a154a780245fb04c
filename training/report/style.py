"""
How the report's figures look: sizes of a two-column journal page, type, colours.

Figures are drawn at the width at which they are printed (`COLUMN_IN`, `PAGE_IN`), so that type of 6
to 8 points stays that size. Colours are Okabe and Ito's, which colour-blind readers tell apart;
treatments differ in hatching as well. No figure touches matplotlib's global state.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import wraps
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import ArrayLike, NDArray

from training.report.comparisons import Panel
from training.report.published import title

#: Widths of a column and of a page's text in an IEEE two-column paper, inches.
COLUMN_IN, PAGE_IN = 3.5, 7.16
BLACK, GREY, LIGHT = '#222222', '#555555', '#c4c4c4'
#: What a bar shows: displacement under the paper's three groups of commands.
COLOURS = {'move': '#009e73', 'stop': '#e69f00', 'test': '#0072b2'}
TREATMENT_COLOURS = {'control': '#7a7a7a', 'experimental': '#0072b2'}
NAMES = {'control': 'control (C)', 'experimental': 'word2vec (E)'}
HATCH = '//////'
#: Brackets of word2vec against control under the unheard word, red as in the paper.
RED = '#c1121f'
#: Axes of displacement are linear to so many body lengths, logarithmic above.
LINEAR_TO = 1.0
TICKS = (0, 0.25, 0.5, 0.75, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
LETTERS = 'abcdefghijklmnopqrstuvwxyz'
SETTINGS: dict[str, Any] = {
    'font.size': 7, 'axes.titlesize': 7.5, 'axes.labelsize': 7, 'xtick.labelsize': 6.5,
    'ytick.labelsize': 6.5, 'legend.fontsize': 6.5, 'axes.linewidth': 0.6, 'lines.linewidth': 1.0,
    'xtick.major.width': 0.6, 'ytick.major.width': 0.6, 'xtick.major.size': 2.5,
    'ytick.major.size': 2.5, 'xtick.major.pad': 2.0, 'ytick.major.pad': 2.0,
    'axes.labelpad': 2.0, 'axes.titlepad': 4.0, 'hatch.linewidth': 0.5, 'axes.spines.top': False,
    'axes.spines.right': False, 'legend.frameon': False, 'legend.handlelength': 1.6,
    # Type that journals accept: TrueType outlines instead of Type 3 fonts.
    'pdf.fonttype': 42,
}


def squeeze(axes: Axes, top: float) -> None:
    """
    Make a displacement axis linear to `LINEAR_TO` and logarithmic above, with ticks up to `top`.

    Bars of half a body length and of thirty can then be read beside each other.
    """
    axes.set_yscale('function', functions=(squeezed, unsqueezed))
    axes.set_yticks([tick for tick in TICKS if tick <= max(top, LINEAR_TO)],
                    [f'{tick:g}' for tick in TICKS if tick <= max(top, LINEAR_TO)])
    axes.axhline(LINEAR_TO, color=LIGHT, linewidth=0.5, linestyle=':', zorder=0)


def squeezed(lengths: ArrayLike) -> NDArray[np.float64]:
    """Return where on the axis displacements of so many body lengths stand, 0 to 1 as they are."""
    values = np.asarray(lengths, dtype=np.float64)
    return np.where(values > LINEAR_TO,
                    LINEAR_TO + np.log10(np.maximum(values, LINEAR_TO) / LINEAR_TO), values)


def unsqueezed(places: ArrayLike) -> NDArray[np.float64]:
    """Return the displacements at places on the axis: the inverse of `squeezed`."""
    values = np.asarray(places, dtype=np.float64)
    return np.where(values > LINEAR_TO,
                    LINEAR_TO * 10 ** np.clip(values - LINEAR_TO, 0, 300), values)


@contextmanager
def settings() -> Iterator[None]:
    """Draw and save with `SETTINGS` meanwhile."""
    with rc_context(SETTINGS):  # type: ignore[arg-type]
        yield


def styled(draw: Callable[..., Figure]) -> Callable[..., Figure]:
    """Return `draw` so that its figure is drawn with `SETTINGS`, whatever the caller's are."""
    @wraps(draw)
    def drawn(*arguments: Any, **options: Any) -> Figure:
        with settings():
            return draw(*arguments, **options)
    return drawn


def panel_grid(shown: Sequence[Panel], *, columns: int, height_in: float,
               width_in: float = PAGE_IN) -> tuple[Figure, list[Axes], list[Axes]]:
    """
    Return (figure, one axes a panel with its letter and title, the axes left over).

    Rows are `height_in` high. Axes left over are empty: a legend may stand there.
    """
    columns = min(len(shown), columns)
    rows = -(-len(shown) // columns)
    figure = Figure(figsize=(width_in * (columns / 3 if columns < 3 else 1),
                             height_in * rows + 0.3), layout='constrained')
    grid = list(figure.subplots(rows, columns, squeeze=False).flat)
    for number, (axes, panel) in enumerate(zip(grid, shown, strict=False)):
        head = title(*panel)
        axes.set_title(f'{LETTERS[number]}  {head}' if len(shown) > 1 else head, loc='left')
    for axes in grid[len(shown):]:
        axes.set_axis_off()
    return figure, grid[:len(shown)], grid[len(shown):]


def left_most(axes: Sequence[Axes]) -> list[Axes]:
    """Return those of `axes` that begin a row of their grid."""
    return [one for one in axes
            if (spec := one.get_subplotspec()) is not None and spec.colspan.start == 0]


def lowest(axes: Sequence[Axes]) -> list[Axes]:
    """Return those of `axes` that have no other one of them below."""
    last = {spec.colspan.start: one for one in axes
            if (spec := one.get_subplotspec()) is not None}
    return list(last.values())


def legend(figure: Figure, handles: Sequence[Artist], spare: Sequence[Axes], *,
           columns: int = 4) -> None:
    """Put a legend into an empty place of the grid, or below it if there is none."""
    if spare:
        spare[0].legend(handles=list(handles), loc='center left')
    else:
        figure.legend(handles=list(handles), loc='outside lower center', ncols=columns)


def treatment_patches(*, control: str = 'C: permuted vectors',
                      experimental: str = 'E: word2vec vectors') -> list[Patch]:
    """Return the legend's entries for hatched (control) and plain (word2vec) bars."""
    return [Patch(facecolor='white', edgecolor=GREY, hatch=HATCH, linewidth=0.6, label=control),
            Patch(facecolor='white', edgecolor=GREY, linewidth=0.6, label=experimental)]


def bar(axes: Axes, x: float, height: float, ends: tuple[float, float], *, width: float,
        colour: str, treatment: str) -> None:
    """Draw a bar with its interval; control's bars are hatched."""
    axes.bar(x, height, width, facecolor=colour, edgecolor='white', linewidth=0.3, zorder=2,
             hatch=HATCH if treatment == 'control' else None)
    axes.errorbar(x, height, [[max(height - ends[0], 0.0)], [max(ends[1] - height, 0.0)]],
                  color='black', capsize=1.6, linewidth=0.8, capthick=0.8, zorder=4)
