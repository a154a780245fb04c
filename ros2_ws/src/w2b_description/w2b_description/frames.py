"""The frames of a robot description: where each link is in its parent's frame (REP-103, SI)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import cos, sin
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from w2b_core.bodies.turning import from_rpy, quaternion_wxyz

Array = NDArray[np.float64]
#: Kinds of joints that have a position: turning ones, and sliding ones.
TURNING, SLIDING = ('revolute', 'continuous'), ('prismatic',)


class UrdfError(ValueError):
    """A robot description that has no tree of frames; one line says what is wrong."""


@dataclass(frozen=True)
class Transform:
    """Where the frame `child` is in `parent`: place (3,) in m, and turn (4,) as x, y, z, w."""

    parent: str
    child: str
    place_m: Array
    turn_xyzw: Array


@dataclass(frozen=True)
class _JointFrame:
    name: str
    kind: str
    parent: str
    child: str
    origin_m: Array
    origin_xyzw: Array
    axis: Array

    def at(self, position: float) -> Transform:
        """Return the child's frame at a position in rad or m."""
        place, turn = self.origin_m, self.origin_xyzw
        if self.kind in TURNING:
            turned = np.array([*(self.axis * sin(position / 2)), cos(position / 2)])
            turn = multiply(self.origin_xyzw, turned)
        elif self.kind in SLIDING:
            place = place + rotate(self.origin_xyzw, self.axis * position)
        return Transform(self.parent, self.child, place, turn)


class FrameTree:
    """
    The frames of a robot.

    Parameters
    ----------
    urdf
        A robot description.

    Raises
    ------
    UrdfError
        If it is no URDF, or its links are no tree.

    """

    def __init__(self, urdf: str) -> None:
        try:
            robot = ElementTree.fromstring(urdf.encode())
        except ElementTree.ParseError as error:
            raise UrdfError(f'robot_description: expected URDF, got {error}') from error
        joints = [_joint(element) for element in robot.findall('joint')]
        links = [str(element.get('name')) for element in robot.findall('link')]
        children = [joint.child for joint in joints]
        roots = [name for name in links if name not in children]
        if len(roots) != 1 or len(set(children)) != len(children):
            raise UrdfError('robot_description: expected one tree of links, got the roots '
                            f'{", ".join(roots) or "none"} of {len(links)} links')
        self.root = roots[0]
        self._moving = {joint.name: joint for joint in joints if joint.kind in TURNING + SLIDING}
        self.fixed = tuple(joint.at(0.0) for joint in joints if joint.name not in self._moving)

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints that move."""
        return tuple(self._moving)

    def moving(self, positions: Mapping[str, float]) -> list[Transform]:
        """Return the frames behind the joints at these positions (rad, m); others are left out."""
        return [self._moving[name].at(position) for name, position in positions.items()
                if name in self._moving]


def _joint(element: ElementTree.Element) -> _JointFrame:
    def link(tag: str) -> str:
        found = element.find(tag)
        if found is None or not found.get('link'):
            raise UrdfError(f'robot_description: joint {element.get("name")}: expected <{tag} '
                            'link="...">, got none')
        return str(found.get('link'))

    def vector(tag: str, attribute: str, default: str) -> Array:
        found = element.find(tag)
        text = default if found is None else found.get(attribute, default)
        try:
            values = np.array([float(word) for word in text.split()])
        except ValueError:
            values = np.zeros(0)
        if values.shape != (3,):
            raise UrdfError(f'robot_description: joint {element.get("name")}: {tag} {attribute}: '
                            f'expected three numbers, got {text!r}')
        return values
    axis = vector('axis', 'xyz', '1 0 0')
    w, x, y, z = quaternion_wxyz(from_rpy(vector('origin', 'rpy', '0 0 0').tolist()))
    return _JointFrame(str(element.get('name')), str(element.get('type')), link('parent'),
                       link('child'), vector('origin', 'xyz', '0 0 0'), np.array([x, y, z, w]),
                       axis / (np.linalg.norm(axis) or 1.0))


def multiply(first_xyzw: Array, second_xyzw: Array) -> Array:
    """Return the quaternion (4,) of the second turn within the frame of the first."""
    a, b = first_xyzw[:3], second_xyzw[:3]
    u, v = first_xyzw[3], second_xyzw[3]
    return np.array([*(u * b + v * a + np.cross(a, b)), u * v - a @ b])


def rotate(turn_xyzw: Array, vector: Array) -> Array:
    """Return a vector (3,) turned by a quaternion."""
    axis, w = turn_xyzw[:3], turn_xyzw[3]
    twice = 2.0 * np.cross(axis, vector)
    turned: Array = vector + w * twice + np.cross(axis, twice)
    return turned


def inverse(turn_xyzw: Array) -> Array:
    """Return the opposite turn."""
    return turn_xyzw * np.array([-1.0, -1.0, -1.0, 1.0])
