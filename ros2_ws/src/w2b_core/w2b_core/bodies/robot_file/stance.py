"""How a body stands: its feet, centre of mass, support polygon, and what its servos must hold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from w2b_core.bodies.model import Body
from w2b_core.bodies.points import spheres

Array = NDArray[np.float64]
GRAVITY_M_S2 = 9.81


@dataclass(frozen=True)
class FootPlace:
    """A foot's link, and its lowest point (3,) from the base's frame."""

    link: str
    bottom_m: Array


@dataclass(frozen=True)
class Stance:
    """
    A body at its stance, seen from the base's frame.

    Attributes
    ----------
    feet
        Name -> foot.
    origins_m
        Link -> origin (3,) of its frame.
    centre_m
        The whole body's centre of mass (3,).
    mass_kg
        Of the whole body.
    torque_nm
        Joint -> torque that holds the stance, if the feet slide freely sideways.
    margin_m
        Distance of the centre of mass from the nearest edge of the support polygon, in x-y;
        negative outside.

    """

    feet: dict[str, FootPlace]
    origins_m: dict[str, Array]
    centre_m: Array
    mass_kg: float
    torque_nm: dict[str, float]
    margin_m: float

    @classmethod
    def of(cls, body: Body, feet: dict[str, str]) -> Stance:
        """Return how a body stands on its `feet`, name -> link."""
        origins = origins_m(body)
        places = {name: FootPlace(link, _bottom(body, link, origins[link]))
                  for name, link in feet.items()}
        masses = np.array([link.mass_kg for link in body.links])
        centres = np.array([origins[link.name] + np.asarray(link.centre_m) for link in body.links])
        centre = masses @ centres / masses.sum()
        margin = _margin(centre[:2], np.array([foot.bottom_m[:2] for foot in places.values()]))
        return cls(places, origins, centre, float(masses.sum()),
                   _holding(body, origins, places, centre, float(masses.sum())), margin)

    @property
    def polygon_m(self) -> Array:
        """Corners (4, 2) of the support polygon, counter-clockwise."""
        return _around(np.array([foot.bottom_m[:2] for foot in self.feet.values()]))


def origins_m(body: Body) -> dict[str, Array]:
    """Return where each link's frame is in the rest pose, from the base's: link -> (3,)."""
    origins = {body.links[0].name: np.zeros(3)}
    for joint in body.joints:
        origins[joint.child] = origins[joint.parent] + np.asarray(joint.origin_m)
    return origins


def _bottom(body: Body, link: str, origin: Array) -> Array:
    """Return the lowest point (3,) of a link."""
    described = body.link(link)
    points = [(origin + np.asarray(described.centre_m) + place, radius)
              for place, radius in spheres(described)]
    place, radius = min(points, key=lambda point: point[0][2] - point[1])
    bottom: Array = place - np.array([0.0, 0.0, radius])
    return bottom


def _around(points: Array) -> Array:
    middle = points.mean(axis=0)
    return points[np.argsort(np.arctan2(*(points - middle).T[::-1]))]


def _margin(point: Array, feet: Array) -> float:
    corners = _around(feet)
    edges = np.roll(corners, -1, axis=0) - corners
    lengths = np.maximum(np.linalg.norm(edges, axis=1), 1e-9)
    to_point = point - corners
    inside = (edges[:, 0] * to_point[:, 1] - edges[:, 1] * to_point[:, 0]) / lengths
    return float(inside.min())


def _holding(body: Body, origins: dict[str, Array], feet: dict[str, FootPlace], centre: Array,
             mass_kg: float) -> dict[str, float]:
    """Return the torques that balance the weight of links and vertical forces at the feet."""
    places = np.array([foot.bottom_m for foot in feet.values()])
    weight = mass_kg * GRAVITY_M_S2
    # Of all vertical forces that balance the weight, those of least squares.
    balance = np.vstack([np.ones(len(places)), places[:, 0], places[:, 1]])
    forces = np.maximum(0.0, np.linalg.pinv(balance) @ (
        weight * np.array([1.0, centre[0], centre[1]])))
    above = {joint.child: joint for joint in body.joints}

    def carries(link: str, name: str) -> bool:
        while link in above and above[link].name != name:
            link = above[link].parent
        return link in above

    torques = {}
    for joint in body.joints:
        origin, axis = origins[joint.child], np.asarray(joint.axis)
        total = 0.0
        for foot, place, force in zip(feet.values(), places, forces, strict=True):
            if carries(foot.link, joint.name):
                total += float(axis @ np.cross(place - origin, [0.0, 0.0, force]))
        for link in body.links:
            if carries(link.name, joint.name):
                arm = origins[link.name] + np.asarray(link.centre_m) - origin
                total -= float(axis @ np.cross(arm, [0.0, 0.0, link.mass_kg * GRAVITY_M_S2]))
        torques[joint.name] = abs(total)
    return torques
