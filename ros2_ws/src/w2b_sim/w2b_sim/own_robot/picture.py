"""A robot drawn from three sides: feet, centre of mass, support polygon, joint directions."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from w2b_core.bodies.model import Body
from w2b_core.bodies.robot_file.directions import motions
from w2b_core.bodies.robot_file.stance import Stance
from w2b_core.files import write_atomically
from w2b_sim.own_robot.outline import Flat, fill

Array = NDArray[np.float64]
#: Title, the two axes seen, and the sign of the first: from the left, from the front, from above.
VIEWS = (('from the left: it faces left', (0, 2), -1.0), ('from the front', (1, 2), 1.0),
         ('from above: it faces up', (1, 0), -1.0))


def draw(body: Body, stance: Stance, path: Path) -> None:
    """Draw a body at its stance into a PNG, whole or not at all (OSError)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(15, 6.5), layout='constrained')
    FigureCanvasAgg(figure)
    moves = motions(body)
    for number, (title, axes, sign) in enumerate(VIEWS):
        plot: Any = figure.add_subplot(1, 3, number + 1)
        flat = Flat(axes, sign)
        fill(plot, body, flat)
        if axes == (1, 0):
            corners = flat(_corners(stance))
            plot.fill(*corners.T, facecolor='none', edgecolor='green', linestyle='--',
                      label='support polygon')
        for name, foot in stance.feet.items():
            at = flat(foot.bottom_m)
            plot.plot(*at, 'k^', markersize=5)
            if not _near(axes, foot.bottom_m):
                continue
            plot.annotate(f'{name}\n({foot.link})', at, fontsize=7, ha='center', va='top',
                          xytext=(0, -6), textcoords='offset points')
        plot.plot(*flat(stance.centre_m), 'rX', markersize=9, label='centre of mass')
        for joint_name, motion in moves.items():
            start, way = flat(motion.tip_m), flat(motion.way_m)
            seen = np.linalg.norm(way) > 0.35 * np.linalg.norm(motion.way_m)
            if seen and _near(axes, motion.tip_m):
                plot.annotate('', start + 1.5 * way, start, arrowprops={
                    'arrowstyle': '->', 'color': 'purple'})
                plot.annotate(joint_name, start + 1.5 * way, fontsize=5.5, color='purple')
        plot.set_title(title, fontsize=10)
        plot.set_aspect('equal')
        plot.margins(0.15)
        plot.tick_params(labelsize=7)
        plot.legend(fontsize=7, loc='upper right')
    figure.suptitle(f'{body.name}: {stance.mass_kg:.3f} kg, {1000 * body.height_m:.0f} mm high. '
                    'Purple: where +10 degrees of a joint moves the end of its leg (x 1.5); metres')
    buffer = BytesIO()
    figure.savefig(buffer, format='png', dpi=110)
    write_atomically(path, buffer.getvalue())


def _near(axes: tuple[int, int], point: Array) -> bool:
    """Return whether a point (3,) is on the viewer's side; from above all are."""
    return bool(axes == (1, 0) or point[1 if axes == (0, 2) else 0] > 0)


def _corners(stance: Stance) -> Array:
    """Return the corners (4, 3) of the support polygon."""
    return np.column_stack([stance.polygon_m, np.zeros(len(stance.polygon_m))])
