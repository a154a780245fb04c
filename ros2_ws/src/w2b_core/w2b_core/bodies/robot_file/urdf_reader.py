"""
A maker's URDF, read safely: links, joints, masses and primitive shapes, with every number checked.

Nothing outside the file is read: entities and document types are refused (XML bombs), meshes are
only named. Source of the format: wiki.ros.org/urdf/XML.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite, pi
from pathlib import Path
from xml.etree.ElementTree import Element, ParseError

import numpy as np
from numpy.typing import NDArray

from w2b_core.bodies.model import Box, Capsule, Cylinder, Shape, Sphere, Vector, Z
from w2b_core.bodies.robot_file.findings import Findings, shown
from w2b_core.bodies.turning import from_rpy

Array = NDArray[np.float64]
MAX_BYTES = 10_000_000
#: Lengths beyond this are no small robot's: the file is in millimetres.
LARGEST_M = 5.0
MOVING = ('revolute', 'continuous')
SLIDING = ('prismatic', 'floating', 'planar')
_TYPES = (*MOVING, 'fixed', *SLIDING)


@dataclass(frozen=True)
class Place:
    """A frame in another: `turn` (3, 3) and `at_m` (3,)."""

    turn: Array
    at_m: Array

    def then(self, other: Place) -> Place:
        """Return the place of `other`, which is placed in this one."""
        return Place(self.turn @ other.turn, self.at_m + self.turn @ other.at_m)


@dataclass(frozen=True)
class Inertial:
    """A link's mass, centre of mass (a place) and tensor (3, 3) in that place's axes, as given."""

    mass_kg: float
    place: Place
    tensor_kg_m2: Array | None


@dataclass(frozen=True)
class Mesh:
    """A mesh that a file names."""

    file: str
    scale: Vector


@dataclass(frozen=True)
class Piece:
    """A shape or mesh at its place in a link's frame."""

    shape: Shape | Mesh
    place: Place


@dataclass(frozen=True)
class UrdfLink:
    """A link; `pieces` are its collision shapes, or the visual ones if it has no others."""

    name: str
    inertial: Inertial | None
    pieces: tuple[Piece, ...]
    only_visual: bool


@dataclass(frozen=True)
class UrdfJoint:
    """A joint; limits are infinite where there are none."""

    name: str
    kind: str
    parent: str
    child: str
    place: Place
    axis: Vector
    lower_rad: float
    upper_rad: float
    effort_nm: float
    speed_rad_s: float
    mimics: str


@dataclass(frozen=True)
class Urdf:
    """A robot description: links by name, joints with parents before children, and the root."""

    name: str
    links: dict[str, UrdfLink]
    joints: tuple[UrdfJoint, ...]
    root: str


def read_urdf(path: Path, found: Findings) -> Urdf:
    """
    Return what a URDF describes.

    Raises
    ------
    RobotFileError
        If it is missing, too large, no URDF, unsafe, or not a tree of links; warnings and errors
        that do not end the reading are added to `found`.

    """
    robot = _parse(path, found)
    name = robot.get('name', '') or path.stem
    links: dict[str, UrdfLink] = {}
    for element in robot.findall('link'):
        link = _Reader(element, 'link', found).link()
        if link.name in links:
            found.error(f'link {link.name}', 'is described twice', 'rename or delete one of them')
        links[link.name] = link
    joints: dict[str, UrdfJoint] = {}
    for element in robot.findall('joint'):
        joint = _Reader(element, 'joint', found).joint()
        if joint.name in joints:
            found.error(f'joint {joint.name}', 'is described twice', 'rename or delete one of them')
        joints[joint.name] = joint
    found.stop_at_errors()
    if not joints:
        raise found.refuse('', 'no joints: expected four legs of two or three joints',
                           'export the whole robot')
    return Urdf(name, links, *_tree(links, list(joints.values()), found))


def _parse(path: Path, found: Findings) -> Element:
    from defusedxml import DefusedXmlException
    from defusedxml.ElementTree import fromstring

    if path.suffix == '.xacro':
        raise found.refuse(path.name, 'is a xacro file, which describes how to make a URDF',
                           f'expand it: `xacro {path.name} > {path.stem}.urdf`')
    try:
        size = path.stat().st_size
        if size > MAX_BYTES:
            raise found.refuse(path.name, f'{size:,} bytes: expected at most {MAX_BYTES:,}',
                               'a URDF holds no meshes')
        data = path.read_bytes()
    except OSError as error:
        raise found.refuse(path.name, f'expected a URDF, got nothing readable ({error.strerror})',
                           'give its path from where the YAML is') from None
    try:
        robot: Element = fromstring(data, forbid_dtd=True)
    except DefusedXmlException as error:
        raise found.refuse(path.name, 'declares a document type or entities '
                           f'({type(error).__name__}), which can make a file explode',
                           'delete the <!DOCTYPE ...> part') from None
    except (ParseError, ValueError, LookupError) as error:
        raise found.refuse(path.name, f'is no XML ({" ".join(str(error).split())})',
                           'export it again') from None
    except RecursionError:
        raise found.refuse(path.name, 'has thousands of elements in each other',
                           'export it again') from None
    if robot.tag != 'robot':
        raise found.refuse(path.name, f'expected <robot>, got <{shown(robot.tag)[1:-1]}>',
                           'convert it to URDF')
    if any(map(_of_xacro, robot.iter())):
        raise found.refuse(path.name, 'holds xacro macros that were not expanded',
                           f'expand it: `xacro {path.name} > {path.stem}.expanded.urdf`')
    return robot


def _of_xacro(element: Element) -> bool:
    """Return whether an element is left for xacro to expand; comments are not looked at."""
    return 'xacro' in element.tag or any(
        mark in text for text in (element.text or '', *element.attrib.values())
        for mark in ('${', '$('))


def _tree(links: dict[str, UrdfLink], joints: list[UrdfJoint], found: Findings
          ) -> tuple[tuple[UrdfJoint, ...], str]:
    """Return the joints with parents before children, and the root (RobotFileError)."""
    above: dict[str, str] = {}
    for joint in joints:
        for role, link in (('parent', joint.parent), ('child', joint.child)):
            if link not in links:
                found.error(f'joint {joint.name}', f'{role} {shown(link)} is no link of the robot',
                            'name one of its links')
        if joint.child in above:
            found.error(f'link {joint.child}', f'hangs on two joints, {above[joint.child]} and '
                        f'{joint.name}: loops are not modelled', 'delete one of the joints')
        above[joint.child] = joint.name
    found.stop_at_errors()
    roots = [name for name in links if name not in above]
    if len(roots) != 1:
        raise found.refuse(
            '', f'expected one root link, got {len(roots)}'
            + (f' ({", ".join(roots[:4])}): joints do not hold them together' if roots
               else ': the joints go round in a circle'), 'correct the parents of the joints')
    ordered: list[UrdfJoint] = []
    reached, left = {roots[0]}, joints
    while left:
        near = [joint for joint in left if joint.parent in reached]
        if not near:
            raise found.refuse(f'joint {left[0].name}', 'goes round in a circle with others',
                               'correct the parents of the joints')
        ordered += near
        reached |= {joint.child for joint in near}
        left = [joint for joint in left if joint.child not in reached]
    return tuple(ordered), roots[0]


class _Reader:
    """Reads one link or joint; what is wrong with it is an error among the findings."""

    def __init__(self, element: Element, kind: str, found: Findings) -> None:
        self._element, self._found = element, found
        self._name = ' '.join(element.get('name', '').split())
        self._where = f'{kind} {self._name}'[:100]
        if not self._name:
            found.error(kind, 'has no name', 'give it one')

    def _numbers(self, element: Element | None, attribute: str, count: int, default: str
                 ) -> tuple[float, ...]:
        text = default if element is None else element.get(attribute, default)
        try:
            values = tuple(float(part) for part in text.split())
        except ValueError:
            values = ()
        if len(values) != count or not all(map(isfinite, values)):
            expected = 'a finite number' if count == 1 else f'{count} finite numbers'
            self._found.error(self._where, f'{attribute}: expected {expected}, got {shown(text)}',
                              'correct it in the URDF')
            return (0.0,) * count
        return values

    def _number(self, element: Element | None, attribute: str, default: float) -> float:
        (value,) = self._numbers(element, attribute, 1, repr(default))
        return value

    def _place(self, element: Element | None) -> Place:
        origin = None if element is None else element.find('origin')
        at_m = np.array(self._numbers(origin, 'xyz', 3, '0 0 0'))
        if np.abs(at_m).max() > LARGEST_M:
            self._found.error(self._where, f'lies {np.abs(at_m).max():g} m from its origin: is the '
                              'file in millimetres?', 'export it in metres')
        return Place(from_rpy(self._numbers(origin, 'rpy', 3, '0 0 0')), at_m)

    def link(self) -> UrdfLink:
        element = self._element
        pieces = self._pieces('collision')
        only_visual = not pieces
        return UrdfLink(self._name, self._inertial(element.find('inertial')),
                        pieces or self._pieces('visual'), only_visual)

    def _inertial(self, element: Element | None) -> Inertial | None:
        if element is None:
            return None
        mass_kg = self._number(element.find('mass'), 'value', 0.0)
        if mass_kg < 0:
            self._found.error(self._where, f'mass of {mass_kg:g} kg', 'weigh it')
        tensor = None
        if (given := element.find('inertia')) is not None:
            xx, xy, xz, yy, yz, zz = (self._number(given, name, 0.0) for name in (
                'ixx', 'ixy', 'ixz', 'iyy', 'iyz', 'izz'))
            tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        return Inertial(mass_kg, self._place(element), tensor)

    def _pieces(self, kind: str) -> tuple[Piece, ...]:
        found = []
        for element in self._element.findall(kind):
            geometry = element.find('geometry')
            shapes = [] if geometry is None else list(geometry)
            if len(shapes) != 1:
                self._found.error(self._where, f'{kind}: expected one geometry, got {len(shapes)}',
                                  'correct it in the URDF')
                continue
            shape = self._shape(shapes[0])
            if shape is not None:
                found.append(Piece(shape, self._place(element)))
        return tuple(found)

    def _shape(self, element: Element) -> Shape | Mesh | None:
        match element.tag:
            case 'box':
                x, y, z = self._sizes(element, 'size', 3)
                return Box((x, y, z))
            case 'sphere':
                return Sphere(self._sizes(element, 'radius', 1)[0])
            case 'cylinder' | 'capsule':
                radius_m, length_m = (self._sizes(element, name, 1)[0]
                                      for name in ('radius', 'length'))
                kind = Cylinder if element.tag == 'cylinder' else Capsule
                return kind(length_m, radius_m, Z)
            case 'mesh':
                x, y, z = self._numbers(element, 'scale', 3, '1 1 1')
                return Mesh(element.get('filename', ''), (x, y, z))
        self._found.error(self._where, f'geometry {shown(element.tag)}: expected box, cylinder, '
                          'sphere, capsule or mesh', 'replace it')
        return None

    def _sizes(self, element: Element, attribute: str, count: int) -> tuple[float, ...]:
        values = self._numbers(element, attribute, count, '')
        if any(value <= 0 for value in values) and element.get(attribute):
            self._found.error(self._where, f'{element.tag} {attribute} of {shown(values)[:40]}: '
                              'expected more than 0 m', 'correct it in the URDF')
        elif max(values) > LARGEST_M:
            self._found.error(self._where, f'{element.tag} of {max(values):g} m: is the file in '
                              'millimetres?', 'export it in metres')
        return values

    def joint(self) -> UrdfJoint:
        element, kind = self._element, self._element.get('type', '')
        if kind not in _TYPES:
            self._found.error(self._where, f'type {shown(kind)}: expected revolute, continuous or '
                              'fixed', 'correct it in the URDF')
        ends = [(part.get('link', '') if (part := element.find(role)) is not None else '')
                for role in ('parent', 'child')]
        x, y, z = self._numbers(element.find('axis'), 'xyz', 3, '1 0 0')
        norm = float(np.linalg.norm((x, y, z)))
        if kind in MOVING and not norm > 1e-6:
            self._found.error(self._where, f'axis {x:g} {y:g} {z:g}: expected a direction',
                              'correct it in the URDF')
            norm = 1.0
        limit, mimic = element.find('limit'), element.find('mimic')
        lower, upper = self._limits(kind, limit)
        return UrdfJoint(
            self._name, kind, ' '.join(ends[0].split()), ' '.join(ends[1].split()),
            self._place(element), (x / (norm or 1), y / (norm or 1), z / (norm or 1)), lower, upper,
            self._number(limit, 'effort', 0.0), self._number(limit, 'velocity', 0.0),
            '' if mimic is None else mimic.get('joint', '?'))

    def _limits(self, kind: str, limit: Element | None) -> tuple[float, float]:
        if kind != 'revolute':
            return -inf, inf
        if limit is None or (limit.get('lower') is None and limit.get('upper') is None):
            self._found.error(self._where, 'revolute without limits',
                              'give <limit lower=... upper=...> in rad')
            return -pi, pi
        lower, upper = (self._number(limit, name, 0.0) for name in ('lower', 'upper'))
        if not lower < upper:
            self._found.error(self._where, f'limits {lower:g}..{upper:g}: expected the lower one '
                              'first', 'exchange or correct them')
        elif max(abs(lower), abs(upper)) > 2 * pi + 0.01:
            self._found.error(self._where, f'limits {lower:g}..{upper:g} rad: are they in degrees?',
                              'give rad')
        return lower, upper
