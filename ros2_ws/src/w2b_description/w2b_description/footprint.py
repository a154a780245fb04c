"""
`base_footprint`: the robot's place on the floor (REP-120), a level frame below its base.

It is a child of the base, so that `odom` -> `base_link` stays as the odometry has it. Its z axis
points up and its x axis where the base looks.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from w2b_core.bodies.model import Body
from w2b_core.bodies.points import spheres
from w2b_description.frames import FrameTree, Transform, inverse, multiply, rotate

Array = NDArray[np.float64]
FOOTPRINT = 'base_footprint'


def footprint(base: str, turn_xyzw: Array, height_m: float) -> Transform:
    """
    Return the footprint in the frame of the base.

    Parameters
    ----------
    base
        Name of the base's frame.
    turn_xyzw
        Attitude (4,) of the base in a level frame; its heading does not matter.
    height_m
        Of the base's origin above the floor.

    """
    back = inverse(turn_xyzw)
    x, y, z, w = turn_xyzw
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    heading = np.array([0.0, 0.0, np.sin(yaw / 2), np.cos(yaw / 2)])
    return Transform(base, FOOTPRINT, rotate(back, np.array([0.0, 0.0, -height_m])),
                     multiply(back, heading))


class Clearance:
    """
    Height of the base above a floor that the lowest point touches, where no odometry tells it.

    Parameters
    ----------
    body
        The robot; its collision shapes touch the floor.
    tree
        Its frames.

    """

    def __init__(self, body: Body, tree: FrameTree) -> None:
        self._tree = tree
        self._points: dict[str, tuple[Array, Array]] = {}
        for link in body.links:
            found = spheres(link)
            self._points[link.name] = (
                np.array([np.asarray(link.centre_m) + centre for centre, _radius in found]),
                np.array([radius for _centre, radius in found]))

    def height_m(self, positions: Mapping[str, float], turn_xyzw: Array) -> float:
        """Return the height of the base's origin, at joint positions (rad) and an attitude (4,)."""
        places = {self._tree.root: (np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))}
        at_rest = {name: positions.get(name, 0.0) for name in self._tree.joints}
        for transform in (*self._tree.moving(at_rest), *self._tree.fixed):
            place, turn = places[transform.parent]
            places[transform.child] = (place + rotate(turn, transform.place_m),
                                       multiply(turn, transform.turn_xyzw))
        up = rotate(inverse(turn_xyzw), np.array([0.0, 0.0, 1.0]))
        lowest = 0.0
        for name, (centres, radii) in self._points.items():
            place, turn = places[name]
            heights = place @ up + centres @ rotate(inverse(turn), up) - radii
            lowest = min(lowest, float(heights.min()))
        return -lowest
