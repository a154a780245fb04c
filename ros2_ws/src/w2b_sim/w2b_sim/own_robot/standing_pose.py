"""A stance for legs whose URDF stands straight, or nowhere: feet under hips, knees bent."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from math import pi

import numpy as np
from numpy.typing import NDArray

from w2b_core.bodies.model import Link, Placed, Vector
from w2b_core.bodies.points import spheres
from w2b_core.bodies.robot_file.settings import FORWARD
from w2b_core.bodies.robot_file.urdf_reader import Mesh, Place, Urdf, UrdfJoint
from w2b_core.bodies.turning import from_axis_angle, from_rpy, to_rpy
from w2b_sim.own_robot.legs import Legs

Array = NDArray[np.float64]
#: A stance stays so far inside the limits.
INSET_RAD = 0.3
#: Angles of a joint that are tried, and about the best of them.
STEPS, FINE = 61, 21
#: A dog stands at this share of its legs' reach.
REACH = 0.85
#: A sprawler's femur is raised so much, its tibia upright.
FEMUR_RAD = 0.15


def find(urdf: Urdf, legs: Legs, shapes: Mapping[str, Sequence[Placed]]) -> dict[str, float]:
    """
    Return the angle of each leg's joints at a stance, rad, as the URDF counts them.

    `shapes` stand in for meshes: link -> shapes in its frame.
    """
    tables = {foot: _Leg(urdf, joints, legs.feet[foot], legs.forward,
                         _tip(urdf, joints[-1], legs.feet[foot], shapes))
              for foot, joints in legs.joints.items()}
    # All legs stand equally high, or the robot is tilted.
    height_m = REACH * min(leg.reach_m for leg in tables.values())
    return {name: angle for leg in tables.values()
            for name, angle in leg.stance(height_m).items()}


def _tip(urdf: Urdf, knee: UrdfJoint, foot: str, shapes: Mapping[str, Sequence[Placed]]) -> Array:
    """Return the end (3,) of a foot's link in its frame: of its shapes, far from the last joint."""
    parts = list(shapes.get(foot, ())) or [
        Placed(piece.shape, _vector(piece.place.at_m), to_rpy(piece.place.turn))
        for piece in urdf.links[foot].pieces if not isinstance(piece.shape, Mesh)]
    if not parts or foot != knee.child:  # a foot of its own is small
        return np.zeros(3)
    ends = [place for place, _radius in spheres(Link('', tuple(parts)))]
    return max(ends, key=lambda end: float(np.linalg.norm(end)))


def _vector(values: Array) -> Vector:
    x, y, z = (float(value) for value in values)
    return x, y, z


class _Leg:
    """Where a leg's last two joints put its foot."""

    def __init__(self, urdf: Urdf, joints: tuple[UrdfJoint, ...], foot: str, forward: str,
                 tip_m: Array) -> None:
        self._joints = joints
        root = Place(from_rpy((0.0, 0.0, FORWARD[forward] * pi / 2)), np.zeros(3))
        above = {joint.child: joint for joint in urdf.joints}
        self._path: list[UrdfJoint] = []
        link = foot
        while link in above:
            self._path.insert(0, above[link])
            link = above[link].parent
        self._root, self._tip = root, tip_m
        first = joints[0]
        self._still = {} if len(joints) == 2 else {first.name: _middle(first)}
        self._grids = [_grid(joint) for joint in joints[-2:]]
        self._found = [(angles, *self._places(angles)) for angles in product(*self._grids)]
        hip_axis = self._axis(first)
        self.sprawls = len(joints) == 3 and abs(hip_axis[2]) > 0.7
        self.reach_m = max(float(hip[2] - tip[2]) for _a, hip, _knee, tip in self._found)

    def _places(self, angles: tuple[float, ...]) -> tuple[Array, Array, Array]:
        """Return the second but last joint, the last joint and the foot (3,)."""
        given = {**self._still, **{joint.name: angle for joint, angle in zip(
            self._joints[-2:], angles, strict=True)}}
        place, found = self._root, {}
        for joint in self._path:
            place = place.then(joint.place)
            found[joint.name] = place.at_m
            turn = from_axis_angle(np.array(joint.axis), given.get(joint.name, 0.0))
            place = Place(place.turn @ turn, place.at_m)
        tip: Array = place.at_m + place.turn @ self._tip
        return found[self._joints[-2].name], found[self._joints[-1].name], tip

    def _axis(self, wanted: UrdfJoint) -> Array:
        place = self._root
        for joint in self._path:
            place = place.then(joint.place)
            if joint is wanted:
                break
        axis: Array = place.turn @ np.array(wanted.axis)
        return axis

    def stance(self, height_m: float) -> dict[str, float]:
        """Return the angles that stand best."""
        cost = self._sprawler if self.sprawls else lambda *where: self._dog(height_m, *where)
        angles = min(self._found, key=lambda one: cost(*one[1:]))[0]
        near = (np.linspace(max(grid[0], angle - step), min(grid[-1], angle + step), FINE)
                for grid, angle in zip(self._grids, angles, strict=True)
                for step in [grid[1] - grid[0]])
        angles = min(product(*near), key=lambda angles: cost(*self._places(angles)))
        return {**{name: round(angle, 2) for name, angle in self._still.items()},
                **{joint.name: round(float(angle), 3) for joint, angle in zip(
                    self._joints[-2:], angles, strict=True)}}

    @staticmethod
    def _dog(height_m: float, hip: Array, knee: Array, tip: Array) -> float:
        """The foot under the hip at the height; of two such the one with its knee behind."""
        size = float(np.linalg.norm(knee - hip) + np.linalg.norm(tip - knee))
        off = (abs(hip[2] - tip[2] - height_m) + abs(tip[0] - hip[0])) / size
        return off + 0.02 * float(np.sign(knee[0] - hip[0]))

    @staticmethod
    def _sprawler(hip: Array, knee: Array, tip: Array) -> float:
        """The tibia upright, the femur a little raised."""
        femur, tibia = knee - hip, tip - knee
        raised = float(np.arctan2(femur[2], np.hypot(femur[0], femur[1])))
        leaning = float(np.arctan2(np.hypot(tibia[0], tibia[1]), -tibia[2]))
        return abs(raised - FEMUR_RAD) + abs(leaning)


def _limits(joint: UrdfJoint) -> tuple[float, float]:
    return max(joint.lower_rad, -pi), min(joint.upper_rad, pi)


def _middle(joint: UrdfJoint) -> float:
    low, high = _limits(joint)
    return 0.0 if low + INSET_RAD <= 0 <= high - INSET_RAD else (low + high) / 2


def _grid(joint: UrdfJoint) -> Array:
    low, high = _limits(joint)
    inset = min(INSET_RAD, 0.3 * (high - low))
    return np.linspace(low + inset, high - inset, STEPS)
