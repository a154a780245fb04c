"""Masses and tensors of rigid parts; what descriptions get wrong is judged and mended."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from w2b_core.bodies.inertia import link_inertia, volume_m3
from w2b_core.bodies.model import Link, Placed
from w2b_core.bodies.points import spheres
from w2b_core.bodies.robot_file.findings import Findings
from w2b_core.bodies.robot_file.urdf_reader import Place, UrdfLink

Array = NDArray[np.float64]
#: Radius of gyration, of a link's size: beyond these a tensor is a placeholder.
GYRATION = (0.02, 2.0)
#: A centre of mass so far outside its link's shape, of the link's size, is a mistake.
OUTSIDE = 0.5
#: What a link without a shape is taken for.
SMALL_M = 0.01


@dataclass(frozen=True)
class Mass:
    """Mass, centre of mass (3,) and tensor (3, 3) about it, in the world at the stance."""

    mass_kg: float
    centre_m: Array
    tensor_kg_m2: Array


def link_mass(link: UrdfLink, place: Place, shapes: Sequence[Placed], ends: Sequence[Array],
              given_kg: float | None, found: Findings) -> Mass | None:
    """
    Return a link's mass at its `place` in the world; None if it has none.

    `shapes` and the joints (3,) at its `ends` are in the world, `given_kg` is a mass that the
    maker's file gives.
    """
    where, inertial = f'link {link.name}', link.inertial
    mass_kg = given_kg if given_kg is not None else inertial.mass_kg if inertial else 0.0
    if not mass_kg > 0:
        if inertial is not None and (shapes or inertial.tensor_kg_m2 is not None):
            found.warn(where, 'mass of 0 kg: it weighs nothing here',
                       f'give masses_kg: {{{link.name}: ...}} if it does', 'mass of 0')
        elif shapes:
            found.warn(where, 'no inertial; other simulators assume 1 kg, here it weighs nothing',
                       f'give masses_kg: {{{link.name}: ...}} if it does', 'no inertial')
        return None
    centre = _centre(shapes, place.at_m)
    if inertial is not None and inertial.mass_kg > 0:
        at = place.then(inertial.place)
        # A collision shape may be a part of the link, which reaches from joint to joint. A centre
        # of mass at the very origin says nothing: nobody gave it.
        near = ends if inertial.place.at_m.any() else ()
        off_m, size_m = _outside(shapes, near, at.at_m)
        if off_m > max(OUTSIDE * size_m, SMALL_M):
            found.warn(where, f'its centre of mass lies {1000 * off_m:.0f} mm outside its shape',
                       "correct the inertial's origin; the shape's centre is taken", 'outside')
        else:
            centre = at.at_m
        tensor = _judged(where, inertial.tensor_kg_m2, inertial.mass_kg, shapes, found)
        if tensor is not None:
            scale = mass_kg / inertial.mass_kg
            return Mass(mass_kg, centre, at.turn @ tensor @ at.turn.T * scale)
    return Mass(mass_kg, centre, _of_shapes(shapes, mass_kg))


def _judged(where: str, tensor: Array | None, mass_kg: float, shapes: Sequence[Placed],
            found: Findings) -> Array | None:
    """Return the tensor if a solid of this size can have it; None, and a warning, if not."""
    if tensor is None or not tensor.any():
        found.warn(where, 'no moments of inertia: computed from its shape')
        return None
    moments = np.linalg.eigvalsh(tensor)
    if moments[0] <= 0 or moments[2] > 1.01 * (moments[0] + moments[1]):
        found.warn(where, f'moments of {_shown(moments)} kg m2, which no solid has: computed from '
                   'its shape', 'correct the inertial', 'impossible')
        return None
    size_m = _size(shapes) or SMALL_M * 10
    gyration = np.sqrt(moments.sum() / 2 / mass_kg) / size_m
    if not GYRATION[0] <= gyration <= GYRATION[1]:
        found.warn(where, f'{moments[2]:.3g} kg m2 for {mass_kg:.3g} kg: placeholder; computed '
                   'from its shape', 'correct the inertial if that is wrong', 'placeholder')
        return None
    return tensor


def _shown(moments: NDArray[np.floating[Any]]) -> str:
    return ', '.join(f'{moment:.2g}' for moment in moments)


def _of_shapes(shapes: Sequence[Placed], mass_kg: float) -> Array:
    if not shapes:
        return np.eye(3) * (0.4 * mass_kg * SMALL_M**2)
    return link_inertia(Link('', tuple(shapes), mass_kg))


def _centre(shapes: Sequence[Placed], origin: Array) -> Array:
    if not shapes:
        return origin
    volumes = np.array([volume_m3(placed.shape) for placed in shapes])
    centre: Array = volumes @ np.array([placed.centre_m for placed in shapes]) / volumes.sum()
    return centre


def bounds(shapes: Sequence[Placed]) -> tuple[Array, Array]:
    """Return the lowest and highest coordinates (3,) of shapes, in their frame."""
    points = spheres(Link('', tuple(shapes)))
    low = np.min([centre - radius for centre, radius in points], axis=0)
    high = np.max([centre + radius for centre, radius in points], axis=0)
    return low, high


def _size(shapes: Sequence[Placed]) -> float:
    if not shapes:
        return 0.0
    low, high = bounds(shapes)
    return float(np.linalg.norm(high - low))


def _outside(shapes: Sequence[Placed], ends: Sequence[Array], point: Array
             ) -> tuple[float, float]:
    """Return how far a point is outside the box around shapes and ends, and its diagonal, m."""
    if not shapes:
        return 0.0, 1.0
    low, high = bounds(shapes)
    low, high = np.min([low, *ends], axis=0), np.max([high, *ends], axis=0)
    return (float(np.linalg.norm(np.maximum(0, np.maximum(low - point, point - high)))),
            float(np.linalg.norm(high - low)))


def together(masses: Sequence[Mass]) -> Mass:
    """Return one mass of several that are rigid together."""
    total = sum(mass.mass_kg for mass in masses)
    centre = sum(mass.mass_kg * mass.centre_m for mass in masses) / total
    tensor = np.zeros((3, 3))
    for mass in masses:
        arm = mass.centre_m - centre
        tensor += mass.tensor_kg_m2
        tensor += mass.mass_kg * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return Mass(total, np.asarray(centre), tensor)
