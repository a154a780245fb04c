"""What a joint's positive direction does, in words: a person says whether the real one does."""

from __future__ import annotations

from dataclasses import dataclass
from math import radians

import numpy as np
from numpy.typing import NDArray

from w2b_core.bodies.model import Body, Vector
from w2b_core.bodies.points import spheres
from w2b_core.bodies.robot_file.stance import origins_m
from w2b_core.bodies.turning import from_axis_angle

Array = NDArray[np.float64]
#: By so much a joint is moved to ask.
STEP_RAD = radians(10)
_WORDS = (('forward', 'backward'), ('to the left', 'to the right'), ('up', 'down'))
#: A component counts if it is at least this share of the whole way.
_SHARE = 0.4
#: Nobody sees a shorter way.
_SEEN_M = 0.0005


@dataclass(frozen=True)
class TipMotion:
    """The tip of a joint's limb at the stance (3,), from the base, and its way (3,) by the step."""

    tip_m: Array
    way_m: Array

    @property
    def words(self) -> str:
        """How the tip moves, such as `12 mm forward and 5 mm up`."""
        return in_words(self.way_m)

    @property
    def way(self) -> Vector:
        """How the tip moves, as plain numbers, m."""
        x, y, z = map(float, self.way_m)
        return x, y, z


def in_words(way_m: Array) -> str:
    """Return a way (3,) in the base's axes in words, its small components left out."""
    longest = float(np.linalg.norm(way_m))
    if longest < _SEEN_M:
        return 'nowhere: it turns on the spot'
    parts = sorted(((abs(float(part)), names[0] if part > 0 else names[1])
                    for part, names in zip(way_m, _WORDS, strict=True)), reverse=True)
    return ' and '.join(f'{1000 * length:.0f} mm {name}' for length, name in parts
                        if length >= _SHARE * longest)


def motions(body: Body) -> dict[str, TipMotion]:
    """Return what a step of each joint in its positive direction does: joint -> motion."""
    origins = origins_m(body)
    children: dict[str, list[str]] = {}
    for joint in body.joints:
        children.setdefault(joint.parent, []).append(joint.child)
    found = {}
    for joint in body.joints:
        origin = origins[joint.child]
        limb, waiting = [], [joint.child]
        while waiting:
            limb.append(waiting.pop())
            waiting += children.get(limb[-1], [])
        points = [origins[name] + np.asarray(body.link(name).centre_m) + place
                  for name in limb for place, _radius in spheres(body.link(name))]
        axis = np.asarray(joint.axis) / np.linalg.norm(joint.axis)
        # The tip is what moves farthest: beside the axis, not along it.
        tip = max(points, key=lambda point: float(np.linalg.norm(np.cross(axis, point - origin))))
        way = from_axis_angle(axis, STEP_RAD) @ (tip - origin) - (tip - origin)
        found[joint.name] = TipMotion(tip, way)
    return found
