"""The paths as a plot: from above, with a close look at the words under which it stayed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from demo.film import COLOURS
from demo.robot import Motion
from demo.script import Seen
from w2b_core.behaviours import BEHAVIOURS


def plot_paths(shown: Sequence[tuple[Seen, Motion]], path: Path) -> None:
    """Draw the path of the base under each word: where it went, and how still it stood."""
    figure = Figure(figsize=(9.5, 4.4), layout='constrained')
    way, rest = figure.subplots(1, 2, width_ratios=(3, 1.6))
    still = 0
    for number, (seen, motion) in enumerate(shown):
        colour = COLOURS[number % len(COLOURS)]
        x, y = motion.positions_m[:, 0], motion.positions_m[:, 1]
        role = ('' if seen.trained else ' (never heard)') if seen.line.behaviour else ' (refused)'
        label = f'{seen.line.word}{role}'
        way.plot(x, y, '-' if seen.trained else '--', lw=2.0, color=colour, label=label)
        way.plot(x[-1], y[-1], 's' if seen.trained else 'D', color=colour, ms=6,
                 mfc=colour if seen.trained else 'none')
        if seen.line.behaviour and not BEHAVIOURS.get(seen.line.behaviour).moves:
            # Distance from where it came to rest: what one path over another would hide.
            drift = 1e3 * np.hypot(x - x[-1], y - y[-1])
            rest.plot(np.linspace(0, seen.line.seconds, len(drift)), drift, color=colour, lw=2.0,
                      ls='-' if seen.trained else '--', label=label)
            still += 1
    way.plot(*shown[0][1].positions_m[0, :2], 'k+', ms=14)
    way.set(xlabel='x (m)', ylabel='y (m)', aspect='equal', title='Where each word took it')
    way.margins(0.08)
    rest.set(xlabel='seconds since the word', ylabel='mm from where it rests',
             title='How it came to rest')
    rest.set_ylim(bottom=0)
    for axes in (way, rest):
        axes.grid(alpha=0.3)
    way.legend(loc='best', frameon=False, fontsize=8)
    if still:
        rest.legend(loc='best', frameon=False, fontsize=8)
    figure.savefig(path, dpi=130)
