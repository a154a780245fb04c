"""A URDF at its stance: where every link is, and which links are one rigid part of the robot."""

from __future__ import annotations

from dataclasses import dataclass
from fnmatch import fnmatchcase
from math import pi

import numpy as np
from numpy.typing import NDArray

from w2b_core.bodies.robot_file.findings import Findings
from w2b_core.bodies.robot_file.settings import FORWARD, Settings, of_pattern
from w2b_core.bodies.robot_file.urdf_reader import MOVING, SLIDING, Place, Urdf, UrdfJoint
from w2b_core.bodies.turning import from_axis_angle, from_rpy

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Part:
    """A rigid part: the joint that moves it (None: the base), and its links, the first at it."""

    joint: UrdfJoint | None
    links: tuple[str, ...]


@dataclass(frozen=True)
class Posed:
    """
    A robot at its stance, in a world whose x is where it faces and whose z is up.

    Attributes
    ----------
    places
        Link -> its frame in the world; the root's is the origin.
    axes
        Moving joint -> its axis (3,) in the world.
    stand_rad
        Moving joint -> the URDF's angle at which it stands.
    parts
        Base first, parents before children.
    owner
        Link -> number of its part.

    """

    places: dict[str, Place]
    axes: dict[str, Array]
    stand_rad: dict[str, float]
    parts: tuple[Part, ...]
    owner: dict[str, int]


def pose(urdf: Urdf, settings: Settings, found: Findings) -> Posed:
    """Return the robot as it stands (RobotFileError if a joint cannot be moved, or not so)."""
    for joint in urdf.joints:
        if joint.kind in SLIDING and not _locked(joint, settings):
            found.error(f'joint {joint.name}', f'is {joint.kind}: only hinges are modelled',
                        f'lock it: locked: [{joint.name}]', joint.kind)
    found.stop_at_errors()
    _check_patterns(urdf, settings, found)
    places = {urdf.root: Place(from_rpy((0.0, 0.0, FORWARD[settings.forward] * pi / 2)).round(),
                               np.zeros(3))}
    axes: dict[str, Array] = {}
    stand: dict[str, float] = {}
    owner = {urdf.root: 0}
    members: list[list[str]] = [[urdf.root]]
    moved_by: list[UrdfJoint | None] = [None]
    for joint in urdf.joints:
        angle = of_pattern(settings.stand_rad, joint.name) or 0.0
        place = places[joint.parent].then(joint.place)
        if joint.kind in MOVING:
            axis = place.turn @ np.array(joint.axis)
            place = Place(place.turn @ from_axis_angle(np.array(joint.axis), angle), place.at_m)
        places[joint.child] = place
        if moves(joint, settings):
            axes[joint.name], stand[joint.name] = axis, angle
            owner[joint.child] = len(members)
            members.append([joint.child])
            moved_by.append(joint)
            _check_moving(joint, angle, found)
        else:
            owner[joint.child] = owner[joint.parent]
            members[owner[joint.parent]].append(joint.child)
    found.stop_at_errors()
    return Posed(places, axes, stand, tuple(
        Part(joint, tuple(links)) for joint, links in zip(moved_by, members, strict=True)), owner)


def moves(joint: UrdfJoint, settings: Settings) -> bool:
    """Return whether a servo turns this joint."""
    return joint.kind in MOVING and not _locked(joint, settings)


def _locked(joint: UrdfJoint, settings: Settings) -> bool:
    return any(fnmatchcase(joint.name, pattern) for pattern in settings.locked)


def _check_moving(joint: UrdfJoint, angle: float, found: Findings) -> None:
    where = f'joint {joint.name}'
    if joint.mimics:
        found.error(where, f'mimics {joint.mimics}: linkages are not modelled',
                    'lock it (locked: [...]) or describe the servo alone')
    if not joint.lower_rad <= angle <= joint.upper_rad:
        found.error(where, f'stands at {angle:.2f}, outside {joint.lower_rad:.2f}..'
                    f'{joint.upper_rad:.2f}', f'give stand: {{{joint.name}: ANGLE}} within it')


def _check_patterns(urdf: Urdf, settings: Settings, found: Findings) -> None:
    """Note patterns that fit nothing: they are misspelt."""
    moving = [joint.name for joint in urdf.joints if joint.kind in MOVING]
    lockable = [joint.name for joint in urdf.joints if joint.kind in (*MOVING, *SLIDING)]
    driven = [joint.name for joint in urdf.joints if moves(joint, settings)]
    for field, patterns, among, kind in (
            ('locked', settings.locked, lockable, 'joint'),
            ('stand', settings.stand_rad, moving, 'joint'),
            ('swing_rad', [one for one in settings.swing_rad if one != '*'], driven, 'joint'),
            ('servos', settings.wiring, driven, 'joint'),
            ('masses_kg', settings.masses_kg, list(urdf.links), 'link'),
            ('shapes', settings.shapes, list(urdf.links), 'link')):
        for pattern in patterns:
            if not any(fnmatchcase(name, pattern) for name in among):
                found.error(f'{field}.{pattern}', f'fits no {kind} of the robot',
                            f'the {kind}s are {", ".join(among[:16])}')
    found.stop_at_errors()
