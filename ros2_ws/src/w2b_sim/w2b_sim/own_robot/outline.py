"""A body's outline, seen from a side: what pictures and drawings of it share."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from w2b_core.bodies.model import Body, Box, Capsule, Cylinder, Placed, Sphere
from w2b_core.bodies.robot_file.stance import origins_m
from w2b_core.bodies.turning import from_rpy

Array = NDArray[np.float64]
#: Points on a ball: as many as its outline is smooth with.
_POINTS = 1500
_BASE, _LEGS = '#c9772b', ('#3572b0', '#7aa6d6', '#1f3c5c')


class Flat:
    """Points (..., 3) as they are seen (..., 2): two of their axes, the first one signed."""

    def __init__(self, axes: tuple[int, int], sign: float) -> None:
        self._axes, self._sign = axes, sign

    def __call__(self, points: Array) -> Array:
        """Return points as they are seen."""
        seen: Array = np.asarray(points)[..., list(self._axes)] * np.array([self._sign, 1.0])
        return seen


def fill(plot: Any, body: Body, flat: Flat, alpha: float = 0.75) -> None:
    """Fill the outlines of all links in the rest pose, those far from the base first."""
    origins = origins_m(body)
    depth = {body.links[0].name: 0}
    for joint in body.joints:
        depth[joint.child] = depth[joint.parent] + 1
    for link in sorted(body.links, key=lambda link: -depth[link.name]):
        colour = _BASE if depth[link.name] == 0 else _LEGS[(depth[link.name] - 1) % 3]
        for placed in link.shapes:
            corners = _hull(flat(_surface(placed) + origins[link.name]))
            plot.fill(*corners.T, facecolor=colour, edgecolor='black', linewidth=0.5, alpha=alpha)


def _hull(points: Array) -> Array:
    from scipy.spatial import ConvexHull, QhullError

    try:
        corners: Array = points[ConvexHull(points).vertices]
    except QhullError:  # seen edge-on
        return points
    return corners


def _surface(placed: Placed) -> Array:
    """Return points (N, 3) on a shape whose hull is the shape, in the link's frame."""
    shape, turn = placed.shape, from_rpy(placed.rpy_rad)
    if isinstance(shape, Box):
        points = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
                          ) * np.asarray(shape.size_m) / 2
    elif isinstance(shape, Sphere):
        points = _ball() * shape.radius_m
    else:
        assert isinstance(shape, Capsule | Cylinder)
        axis = np.asarray(shape.axis) / np.linalg.norm(shape.axis)
        half = axis * shape.length_m / 2
        ring = _ball() * shape.radius_m
        if isinstance(shape, Cylinder):
            ring = ring - np.outer(ring @ axis, axis)
        points = np.concatenate([ring + half, ring - half])
    placed_points: Array = np.asarray(placed.centre_m) + points @ turn.T
    return placed_points


def _ball() -> Array:
    """Return points (N, 3) spread over the unit sphere (Fibonacci's lattice)."""
    index = np.arange(_POINTS)
    z = 1 - (2 * index + 1) / _POINTS
    angle = np.pi * (1 + 5**0.5) * index
    return np.column_stack([np.cos(angle) * np.sqrt(1 - z**2), np.sin(angle) * np.sqrt(1 - z**2),
                            z])
