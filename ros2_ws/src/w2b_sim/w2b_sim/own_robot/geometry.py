"""What a drawing of a body measures in it: extents, limbs, and arcs in joints' positive sense."""

from __future__ import annotations

from dataclasses import dataclass
from math import radians

import numpy as np
from numpy.typing import NDArray

from w2b_core.bodies.model import Body, Joint, Link
from w2b_core.bodies.points import spheres
from w2b_core.bodies.robot_file.stance import origins_m
from w2b_core.bodies.turning import from_axis_angle

Array = NDArray[np.float64]
#: An arrow runs from so far before to so far after the middle of its limb.
_HALF_ARC_RAD = radians(38)


def extent_m(body: Body, links: tuple[Link, ...] = ()) -> tuple[Array, Array]:
    """Return the corners (3,), (3,) of the box around `links` (none: all) in the rest pose."""
    origins = origins_m(body)
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for link in links or body.links:
        for place, radius in spheres(link):
            point = origins[link.name] + np.asarray(link.centre_m) + place
            low, high = np.minimum(low, point - radius), np.maximum(high, point + radius)
    return low, high


@dataclass(frozen=True)
class JointChain:
    """
    Joints one after the other, from the base outwards.

    `places_m` (J + 1, 3): the joints' places in the rest pose, and the limb's end: the centre of
    its last sphere (a foot's). `end_radius_m` is that sphere's radius.
    """

    joints: tuple[Joint, ...]
    places_m: Array
    end_radius_m: float

    @property
    def lengths_mm(self) -> tuple[float, ...]:
        """Distances (J,) between the joints, and of the end from the last, to a tenth."""
        steps = np.linalg.norm(np.diff(self.places_m, axis=0), axis=1)
        return tuple(round(1000 * float(step), 1) for step in steps)


def limbs(body: Body) -> list[JointChain]:
    """Return a body's limbs, in the order of their first joints."""
    origins = origins_m(body)
    below: dict[str, list[Joint]] = {}
    for joint in body.joints:
        below.setdefault(joint.parent, []).append(joint)
    found = []
    first = below.get(body.links[0].name, [])
    waiting: list[tuple[Joint, ...]] = [(joint,) for joint in reversed(first)]
    while waiting:
        chain = waiting.pop()
        more = below.get(chain[-1].child, [])
        waiting += [(*chain, joint) for joint in reversed(more)]
        if more:
            continue
        link, start = body.link(chain[-1].child), origins[chain[-1].child]
        ends = [(start + np.asarray(link.centre_m) + place, radius)
                for place, radius in spheres(link)]
        # The lowest of those that are farthest: a foot, not the corner above it.
        end, radius = max(ends, key=lambda one: (round(float(np.linalg.norm(one[0] - start)), 6),
                                                 -one[0][2]))
        found.append(JointChain(chain, np.array([*(origins[joint.child] for joint in chain), end]),
                          radius))
    return found


def arc_m(body: Body, joint: Joint, largest_m: float, points: int = 24) -> Array:
    """
    Return the arc (points, 3) about a joint's axis in its positive sense, from its start on.

    Its middle is where the joint's link is; its radius is at most `largest_m`, at least 0.6 of it.
    """
    origins = origins_m(body)
    origin = origins[joint.child]
    axis = np.asarray(joint.axis, dtype=np.float64) / np.linalg.norm(joint.axis)
    beside = np.zeros(3)
    for place in _outwards(body, joint):
        away = (place - origin) - axis * float(axis @ (place - origin))
        if np.linalg.norm(away) > 1e-6:
            beside = away
            break
    reach = float(np.linalg.norm(beside))
    if reach < 1e-6:  # all of it is on the axis
        beside = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
        reach = largest_m
    spoke = beside / np.linalg.norm(beside) * min(max(0.62 * reach, 0.6 * largest_m), largest_m)
    return np.array([origin + from_axis_angle(axis, angle) @ spoke
                     for angle in np.linspace(-_HALF_ARC_RAD, _HALF_ARC_RAD, points)])


def _outwards(body: Body, joint: Joint) -> list[Array]:
    """Return places (3,) of what a joint turns, from the next joint on; last its link's centre."""
    places = [place for limb in limbs(body) if joint in limb.joints
              for place in limb.places_m[limb.joints.index(joint) + 1:]]
    return [*places, origins_m(body)[joint.child] + np.asarray(body.link(joint.child).centre_m)]
