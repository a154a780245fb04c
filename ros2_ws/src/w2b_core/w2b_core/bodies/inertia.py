"""Moments of inertia of solid shapes of uniform density."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from w2b_core.bodies.model import Box, Capsule, Link, Shape, Vector


def link_inertia(link: Link) -> NDArray[np.float64]:
    """Return a link's inertia tensor (3, 3) in kg m^2 about its centre, in the link's axes."""
    return inertia(link.shape, link.mass_kg, link.inertia_axis)


def inertia(shape: Shape, mass_kg: float, capsule_axis: Vector | None = None
            ) -> NDArray[np.float64]:
    """
    Return the inertia tensor (3, 3) in kg m^2 about the shape's centre, in the link's axes.

    `capsule_axis` stands in for a capsule's own axis (see `Link.inertia_axis`).
    """
    if isinstance(shape, Box):
        x, y, z = (edge**2 for edge in shape.size_m)
        return np.diag([y + z, x + z, x + y]) * (mass_kg / 12)
    if isinstance(shape, Capsule):
        axial, transverse = _capsule(shape, mass_kg)
        axis = np.asarray(capsule_axis or shape.axis)
        return transverse * np.eye(3) + (axial - transverse) * np.outer(axis, axis)
    return np.eye(3) * (0.4 * mass_kg * shape.radius_m**2)


def _capsule(shape: Capsule, mass_kg: float) -> tuple[float, float]:
    """Moments about the axis and across it: a cylinder, and two hemispheres as one sphere."""
    radius, length = shape.radius_m, shape.length_m
    cylinder = mass_kg * length / (length + 4 / 3 * radius)
    sphere = mass_kg - cylinder
    axial = radius**2 * (cylinder / 2 + 0.4 * sphere)
    transverse = (cylinder * (radius**2 / 4 + length**2 / 12)
                  + sphere * (0.4 * radius**2 + 0.375 * radius * length + length**2 / 4))
    return axial, transverse
