"""A shape as spheres: the points of it that can meet a flat floor, each with a radius."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from w2b_core.bodies.model import Box, Capsule, Cylinder, Link, Placed
from w2b_core.bodies.turning import from_rpy

Array = NDArray[np.float64]
_CORNERS = np.array([[1 if corner & bit else -1 for bit in (1, 2, 4)] for corner in range(8)])


def spheres(link: Link) -> list[tuple[Array, float]]:
    """Return the spheres of a link: centres (3,) from its centre of mass, and radii, m."""
    if not isinstance(link.shape, tuple):
        return _of(Placed(link.shape))
    found = []
    for placed in link.shape:
        turn = from_rpy(placed.rpy_rad)
        place = np.asarray(placed.centre_m) - np.asarray(link.centre_m)
        found += [(place + turn @ offset, radius) for offset, radius in _of(placed)]
    return found


def _of(placed: Placed) -> list[tuple[Array, float]]:
    """Return a shape's spheres about its centre, in its own axes."""
    shape = placed.shape
    if isinstance(shape, Box):
        half = np.asarray(shape.size_m) / 2
        return [(half * corner, 0.0) for corner in _CORNERS]
    if isinstance(shape, Capsule):
        end = _unit(shape.axis) * (shape.length_m / 2)
        return [(-end, shape.radius_m), (end, shape.radius_m)]
    if isinstance(shape, Cylinder):
        return _cylinder(shape)
    return [(np.zeros(3), shape.radius_m)]


def _cylinder(shape: Cylinder) -> list[tuple[Array, float]]:
    """A long cylinder is the capsule inside it, a flat one the four corners of each end."""
    axis = _unit(shape.axis)
    inner = shape.length_m / 2 - shape.radius_m
    if inner >= 0:
        return [(-inner * axis, shape.radius_m), (inner * axis, shape.radius_m)]
    across = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    across *= shape.radius_m / np.linalg.norm(across)
    rim = [across, np.cross(axis, across), -across, -np.cross(axis, across)]
    return [(side * shape.length_m / 2 * axis + point, 0.0) for side in (-1, 1) for point in rim]


def _unit(vector: tuple[float, float, float]) -> Array:
    unit: Array = np.asarray(vector, dtype=np.float64)
    return unit / np.linalg.norm(unit)
