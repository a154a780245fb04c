"""Moments of inertia of links: as given, or of their shapes at uniform density."""

from __future__ import annotations

from math import pi

import numpy as np
from numpy.typing import NDArray

from w2b_core.bodies.model import Box, Capsule, Cylinder, Link, Placed, Shape, Vector
from w2b_core.bodies.turning import from_rpy

Array = NDArray[np.float64]


def link_inertia(link: Link) -> Array:
    """
    Return a link's inertia tensor (3, 3) in kg m^2 about its centre of mass, in the link's axes.

    Without a tensor of its own it is that of the link's shapes at one density, about the centre of
    the shapes.
    """
    if link.inertia_kg_m2 is not None:
        return np.array(link.inertia_kg_m2, dtype=np.float64)
    if not isinstance(link.shape, tuple):
        return inertia(link.shape, link.mass_kg, link.inertia_axis)
    volumes = np.array([volume_m3(placed.shape) for placed in link.shape])
    masses = link.mass_kg * volumes / volumes.sum()
    centres = np.array([placed.centre_m for placed in link.shape])
    arms = centres - masses @ centres / link.mass_kg
    total = np.zeros((3, 3))
    for placed, mass_kg, arm in zip(link.shape, masses, arms, strict=True):
        total += _turned(placed, float(mass_kg))
        total += mass_kg * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return total


def _turned(placed: Placed, mass_kg: float) -> Array:
    """Return a placed shape's tensor about its own centre, in the link's axes."""
    turn = from_rpy(placed.rpy_rad)
    tensor: Array = turn @ inertia(placed.shape, mass_kg) @ turn.T
    return tensor


def inertia(shape: Shape, mass_kg: float, capsule_axis: Vector | None = None) -> Array:
    """
    Return the inertia tensor (3, 3) in kg m^2 about the shape's centre, in the shape's axes.

    `capsule_axis` stands in for a capsule's own axis (see `Link.inertia_axis`).
    """
    if isinstance(shape, Box):
        x, y, z = (edge**2 for edge in shape.size_m)
        return np.diag([y + z, x + z, x + y]) * (mass_kg / 12)
    if isinstance(shape, Capsule):
        axial, transverse = _capsule(shape, mass_kg)
        axis = np.asarray(capsule_axis or shape.axis)
        return transverse * np.eye(3) + (axial - transverse) * np.outer(axis, axis)
    if isinstance(shape, Cylinder):
        axial = mass_kg * shape.radius_m**2 / 2
        transverse = axial / 2 + mass_kg * shape.length_m**2 / 12
        axis = np.asarray(shape.axis) / np.linalg.norm(shape.axis)
        return transverse * np.eye(3) + (axial - transverse) * np.outer(axis, axis)
    return np.eye(3) * (0.4 * mass_kg * shape.radius_m**2)


def volume_m3(shape: Shape) -> float:
    """Return the volume of a shape."""
    if isinstance(shape, Box):
        x, y, z = shape.size_m
        return x * y * z
    if isinstance(shape, Cylinder):
        return pi * shape.radius_m**2 * shape.length_m
    ball = 4 / 3 * pi * shape.radius_m**3
    return ball + pi * shape.radius_m**2 * shape.length_m if isinstance(shape, Capsule) else ball


def _capsule(shape: Capsule, mass_kg: float) -> tuple[float, float]:
    """Moments about the axis and across it: a cylinder, and two hemispheres as one sphere."""
    radius, length = shape.radius_m, shape.length_m
    cylinder = mass_kg * length / (length + 4 / 3 * radius)
    sphere = mass_kg - cylinder
    axial = radius**2 * (cylinder / 2 + 0.4 * sphere)
    transverse = (cylinder * (radius**2 / 4 + length**2 / 12)
                  + sphere * (0.4 * radius**2 + 0.375 * radius * length + length**2 / 4))
    return axial, transverse
