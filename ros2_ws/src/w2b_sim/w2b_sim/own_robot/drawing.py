"""
The drawings that a robot is built from, as SVG: `w2b robot draw`.

`views` has the body at its zero pose from five sides with dimensions in mm, every joint's name,
its output on the board and its positive direction, and a limb's lengths. The elements' ids say what
they are (`arrow:JOINT`, `dimension:NAME`). The same body gives the same bytes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from io import BytesIO
from math import degrees
from typing import Any

import numpy as np
from numpy.typing import NDArray

from w2b_core.bodies.model import Body, Joint
from w2b_core.bodies.robot_file.directions import motions
from w2b_core.bodies.wiring import Wiring
from w2b_sim.own_robot.geometry import JointChain, arc_m, extent_m, limbs
from w2b_sim.own_robot.outline import Flat, fill

Array = NDArray[np.float64]
ARROW, DIMENSION = '#8a0f6b', '#333333'
#: Title, the axes seen, the sign of the first, and the way to the viewer.
VIEWS = (('from the left (front: left)', (0, 2), -1.0, (0.0, 1.0, 0.0)),
         ('from above (front: up)', (1, 0), -1.0, (0.0, 0.0, 1.0)),
         ('from the right (front: right)', (0, 2), 1.0, (0.0, -1.0, 0.0)),
         ('from the front', (1, 2), 1.0, (1.0, 0.0, 0.0)),
         ('from behind', (1, 2), -1.0, (-1.0, 0.0, 0.0)))
#: Views that have dimensions: the others show the same from the other side.
_MEASURED = (0, 1, 3)
#: What a joint's side counts beside how well its turning is seen.
_HIDDEN = 0.3


def views(body: Body, wiring: Mapping[str, Wiring]) -> bytes:
    """Return the SVG of a body at its zero pose; `wiring` as `bodies.wiring` returns it."""
    figure, panels = sheet(['LAR', 'FBM', 'TTT'], (12.5, 11.5), (4.0, 4.0, 3.2))
    shown = {joint.name: _best_view(body, joint) for joint in body.joints}
    low, high = extent_m(body)
    size = float(np.linalg.norm(high - low))
    for number, (title, axes, sign, _way) in enumerate(VIEWS):
        plot, flat = panels['LARFB'[number]], Flat(axes, sign)
        fill(plot, body, flat, alpha=0.35)
        for joint in body.joints:
            if shown[joint.name] == number:
                _joint(plot, body, joint, flat, wiring[joint.name].channel, size)
        if number in _MEASURED:
            _overall(plot, body, axes, flat, number, size)
        _finish(plot, title)
    _limb(panels['M'], limbs(body))
    _table(panels['T'], body, wiring)
    figure.suptitle(
        f'{body.name}: zero pose (every joint at 0), dimensions in mm\nPurple: the positive '
        'direction of a joint, its name and its output (ch) on the servo board', fontsize=10)
    return as_svg(figure)


def sheet(mosaic: Sequence[str], size_in: tuple[float, float],
          heights: Sequence[float] | None = None) -> tuple[Any, dict[str, Any]]:
    """Return a figure and its plots, by their letters in the mosaic's rows."""
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    figure = Figure(figsize=size_in, layout='constrained')
    FigureCanvasSVG(figure)
    return figure, figure.subplot_mosaic([list(row) for row in mosaic], height_ratios=heights)


def as_svg(figure: Any) -> bytes:
    """Return a figure as SVG with its text as text; equal figures give equal bytes."""
    from matplotlib import rc_context

    buffer = BytesIO()
    with rc_context({'svg.fonttype': 'none', 'svg.hashsalt': 'w2b'}):
        figure.savefig(buffer, format='svg', metadata={'Date': None, 'Creator': 'w2b robot draw'})
    return buffer.getvalue()


def _best_view(body: Body, joint: Joint) -> int:
    """Return the number of the view that shows a joint's turning best, on its own side if any."""
    axis = np.asarray(joint.axis) / np.linalg.norm(joint.axis)
    place = arc_m(body, joint, 1.0).mean(axis=0)

    def seen(number: int) -> tuple[float, int]:
        way = np.array(VIEWS[number][3])
        hidden = way[2] == 0 and float(way @ place) < -1e-9
        return round(abs(float(axis @ way)) - (_HIDDEN if hidden else 0.0), 6), -number

    return max(range(len(VIEWS)), key=seen)


def _joint(plot: Any, body: Body, joint: Joint, flat: Flat, channel: int, size: float) -> None:
    """Draw a joint: its axis as a dot, its positive sense as an arrow, its name and output."""
    arc = flat(arc_m(body, joint, 0.13 * size))
    plot.plot(*arc.T, color=ARROW, linewidth=1.4, gid=f'arrow:{joint.name}', zorder=7)
    arrow(plot, arc[-3], arc[-1] + (arc[-1] - arc[-2]), ARROW)
    # Beyond one end of the arrow, of neighbours in a limb not the same one.
    depth = next(limb.joints.index(joint) for limb in limbs(body) if joint in limb.joints)
    end, inner = (arc[-1], arc[-5]) if depth % 2 else (arc[0], arc[4])
    away = end - inner
    away *= (0.075 if depth % 2 else 0.05) * size / max(float(np.linalg.norm(away)), 1e-9)
    plot.text(*(end + away), f'{joint.name}\nch {channel}', fontsize=7, color=ARROW, ha='center',
              va='center', zorder=6, bbox={'facecolor': 'white', 'edgecolor': 'none',
                                           'alpha': 0.75, 'pad': 0.6})


def _overall(plot: Any, body: Body, axes: tuple[int, int], flat: Flat, number: int,
             size: float) -> None:
    """
    Draw the dimensions of a view: of the whole, and of the base where they are others.

    From above also how far the limbs' first axes lie apart.
    """
    corners = np.array(extent_m(body))
    base = np.array(extent_m(body, body.links[:1]))
    first = np.array([limb.places_m[0] for limb in limbs(body)])
    axles = np.array([first.min(axis=0), first.max(axis=0)])
    across, up = axes
    for axis in axes:
        parts = {'first axes': axles, 'base': base, 'overall': corners}
        if np.allclose(base[:, axis], corners[:, axis], atol=1e-6):
            del parts['base']
        if axes != (1, 0) or np.ptp(axles[:, axis]) < 1e-4:
            del parts['first axes']
        for step, (part, box) in enumerate(parts.items(), start=1):
            gap = (0.06 + 0.07 * step) * size
            ends = corners.copy()
            ends[:, axis] = box[:, axis]
            if axis == across:  # below the drawing
                ends[:, up] = corners[0][up]
                points, aside = flat(ends), np.array([0.0, -gap])
            else:  # at its right
                edge = max(flat(corners)[:, 0])
                points = np.column_stack([[edge, edge], flat(ends)[:, 1]])
                aside = np.array([gap, 0.0])
            length = ('length', 'width', 'height')[axis]
            dimension(plot, points, aside, 1000 * float(np.ptp(box[:, axis])),
                      f'{number}:{part} {length}')


def dimension(plot: Any, points: Array, aside: Array, length_mm: float, name: str) -> None:
    """Draw a dimension line beside two points (2, 2) of a plot in metres."""
    line = points + aside
    for point, end in zip(points, line, strict=True):
        plot.plot(*np.array([point, end]).T, color=DIMENSION, linewidth=0.4)
    plot.plot(*line.T, color=DIMENSION, linewidth=0.7, gid=f'dimension:{name}')
    arrow(plot, line[0], line[1], DIMENSION, '<|-|>')
    way = line[1] - line[0]
    upright = abs(way[1]) > abs(way[0])
    plot.text(*line.mean(axis=0), f'{round(length_mm, 1):g}', fontsize=7.5, ha='center',
              va='center', color=DIMENSION, rotation=90 if upright else 0, gid=f'number:{name}',
              zorder=8, bbox={'facecolor': 'white', 'edgecolor': 'none', 'pad': 0.5})


def arrow(plot: Any, tail: Array, head: Array, colour: str, style: str = '-|>') -> None:
    """Draw an arrow between two points (2,) of a plot, also where it leaves the plot."""
    plot.annotate('', head, tail, annotation_clip=False, zorder=7, arrowprops={
        'arrowstyle': style, 'color': colour, 'linewidth': 0.6, 'mutation_scale': 11,
        'shrinkA': 0, 'shrinkB': 0})


def _limb(plot: Any, found: Sequence[JointChain]) -> None:
    """Draw the first limb in its own plane with its lengths, and say what the others have."""
    limb = found[0]
    places = limb.places_m - limb.places_m[0]
    away = places[-1][:2]
    forward = away / np.linalg.norm(away) if np.linalg.norm(away) > 1e-6 else np.array([1.0, 0.0])
    flat = np.column_stack([places[:, :2] @ forward, places[:, 2]])
    plot.plot(*flat.T, color='#3572b0', linewidth=5, alpha=0.4, solid_capstyle='round')
    names = [joint.name for joint in limb.joints]
    labels: dict[tuple[float, ...], list[str]] = {}
    for name, point in zip([*names, f'end (radius {1000 * limb.end_radius_m:.4g})'], flat,
                           strict=True):
        labels.setdefault(tuple(point.round(6)), []).append(name)
    size, middle = float(np.ptp(flat, axis=0).max()), flat.mean(axis=0)
    for number, (place, texts) in enumerate(labels.items()):
        inwards = middle - place
        # Every second one farther away: names are longer than short links.
        inwards *= (0.06 + 0.05 * (number % 2)) * size / max(float(np.linalg.norm(inwards)), 1e-9)
        plot.plot(*place, 'o', color='black', markersize=4)
        plot.text(*(place + inwards), ',\n'.join(texts), fontsize=7, va='center',
                  ha='right' if inwards[0] < -0.02 * size else 'left')
    for number, length_mm in enumerate(limb.lengths_mm):
        points = flat[number:number + 2]
        way = points[1] - points[0]
        if np.linalg.norm(way) < 1e-4:
            continue
        aside = np.array([way[1], -way[0]]) / np.linalg.norm(way) * 0.1 * size
        # What is out of this plane is drawn shorter: the number is the true distance.
        dimension(plot, points, aside if aside @ (points.mean(axis=0) - middle) > 0 else -aside,
                  length_mm, f'limb:{names[number]}')
    alike = sum(other.lengths_mm == limb.lengths_mm for other in found)
    others = '' if alike == len(found) else '; others: ' + ', '.join(
        f'{other.joints[0].name}: ' + ' + '.join(f'{length:g}' for length in other.lengths_mm)
        for other in found if other.lengths_mm != limb.lengths_mm)
    _finish(plot, f'a limb, between its axes; {alike} of {len(found)} are like it{others}')


def _table(plot: Any, body: Body, wiring: Mapping[str, Wiring]) -> None:
    """Write every joint's output, limits and what its positive direction does."""
    plot.set_axis_off()
    moves = motions(body)
    rows = [[str(wiring[joint.name].channel), joint.name,
             f'{degrees(joint.lower_rad):.0f}..{degrees(joint.upper_rad):.0f}',
             moves[joint.name].words] for joint in body.joints]
    table = plot.table(cellText=rows, colLabels=['ch', 'joint', 'degrees', '+10 degrees moves'],
                       colWidths=[0.06, 0.28, 0.14, 0.52], loc='upper center', cellLoc='left')
    table.auto_set_font_size(False)
    table.set_fontsize(7.5)
    table.scale(1.0, 1.3)
    plot.set_title('joints', fontsize=9)


def _finish(plot: Any, title: str) -> None:
    plot.set_title(title, fontsize=9, pad=26)
    plot.set_aspect('equal')
    plot.margins(0.1)
    plot.set_axis_off()
