"""Guesses about an unknown URDF: which chains are legs, where feet are, where the front is."""

from __future__ import annotations

import re
from dataclasses import dataclass
from math import pi
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from w2b_core.bodies.robot_file.findings import Findings
from w2b_core.bodies.robot_file.posed import Posed, pose
from w2b_core.bodies.robot_file.settings import FEET, FORWARD, Settings
from w2b_core.bodies.robot_file.urdf_reader import MOVING, SLIDING, Urdf, UrdfJoint
from w2b_core.bodies.turning import from_rpy

Array = NDArray[np.float64]
_FOOT = re.compile(r'foot|toe|paw|tip|contact', re.IGNORECASE)
_ENDS = {'front': 'front', 'fore': 'front', 'rear': 'back', 'back': 'back', 'hind': 'back'}
_SHORT = {'fl': 'front_left', 'lf': 'front_left', 'fr': 'front_right', 'rf': 'front_right',
          'bl': 'back_left', 'lb': 'back_left', 'rl': 'back_left', 'lr': 'back_left',
          'hl': 'back_left', 'lh': 'back_left', 'br': 'back_right', 'rb': 'back_right',
          'rr': 'back_right', 'hr': 'back_right', 'rh': 'back_right'}


@dataclass(frozen=True)
class Legs:
    """Name of `FEET` -> joints of the leg from the hip on, and its foot's link; the others."""

    joints: dict[str, tuple[UrdfJoint, ...]]
    feet: dict[str, str]
    locked: tuple[str, ...]
    forward: str


def find(urdf: Urdf, found: Findings) -> Legs:
    """Return the four legs of a robot (RobotFileError if there are none)."""
    still = tuple(joint.name for joint in urdf.joints if joint.kind in SLIDING)
    free = Settings(Path(found.path), 'robot', None, locked=still, stand_rad=within_limits(urdf))
    posed = pose(urdf, free, found)
    chains = _chains(posed)
    legs = [chain for chain in chains if 2 <= len(chain) <= 3]
    if len(legs) < 4:
        longest = sorted((len(chain) for chain in chains), reverse=True)
        raise found.refuse('', f'expected four chains of 2 or 3 hinges, got chains of '
                           f'{longest[:8]}', 'is it a four-legged robot? Fix a joint in the URDF '
                           'that a leg does not have')
    tips = {number: _tip(urdf, posed, legs[number][-1]) for number in range(len(legs))}
    lowest = sorted(tips, key=lambda number: posed.places[tips[number]].at_m[2])[:4]
    chosen = {number: legs[number] for number in sorted(lowest)}
    places = {number: posed.places[tips[number]].at_m for number in chosen}
    names = {number: _name([tips[number],
                            *(_joint(posed, part).name for part in chain),
                            *(link for part in chain for link in posed.parts[part].links)])
             for number, chain in chosen.items()}
    forward, feet = _named(places, names, found)
    legs_joints = {foot: tuple(_joint(posed, part) for part in chosen[number])
                   for foot, number in feet.items()}
    used = {joint.name for leg in legs_joints.values() for joint in leg}
    locked = tuple(joint.name for joint in urdf.joints
                   if joint.kind in (*MOVING, *SLIDING) and joint.name not in used)
    for joint in urdf.joints:
        if joint.kind in SLIDING:
            found.warn(f'joint {joint.name}', f'is {joint.kind}: held still, as only hinges are '
                       'modelled', 'is that the robot?')
    return Legs(legs_joints, {foot: tips[number] for foot, number in feet.items()}, locked,
                forward)


def within_limits(urdf: Urdf) -> dict[str, float]:
    """Return the middle of the limits (rad) of each joint for which zero lies outside of them."""
    return {joint.name: (joint.lower_rad + joint.upper_rad) / 2 for joint in urdf.joints
            if joint.kind in MOVING and not joint.lower_rad <= 0 <= joint.upper_rad}


def _chains(posed: Posed) -> list[list[int]]:
    """Return the parts from the base to each last one."""
    parents = {number: posed.owner[part.joint.parent] for number, part in enumerate(posed.parts)
               if part.joint is not None}
    chains = []
    for number in parents:
        if number not in parents.values():
            chain = [number]
            while parents[chain[0]] in parents:
                chain.insert(0, parents[chain[0]])
            chains.append(chain)
    return chains


def _joint(posed: Posed, number: int) -> UrdfJoint:
    joint = posed.parts[number].joint
    assert joint is not None
    return joint


def _tip(urdf: Urdf, posed: Posed, part: int) -> str:
    """Return the foot's link of a leg's last part: by name, else the one that ends it."""
    links = posed.parts[part].links
    named = [link for link in links if _FOOT.search(link) and urdf.links[link].pieces]
    if named:
        return named[-1]
    shaped = [link for link in links if urdf.links[link].pieces] or list(links)
    origin = posed.places[links[0]].at_m
    return max(shaped, key=lambda link: float(np.linalg.norm(posed.places[link].at_m - origin)))


def _name(names: list[str]) -> str:
    """Return which of `FEET` the first of a leg's names that says so means; '' if none does."""
    for name in names:
        spaced = re.sub(r'([a-z])([A-Z])', r'\1_\2', name).lower()
        words = [word for word in re.split(r'[^a-z]+', spaced) if word]
        ends = [_ENDS[word] for word in words if word in _ENDS]
        sides = [word for word in words if word in ('left', 'right')]
        short = [_SHORT[word] for word in words if word in _SHORT]
        if ends and sides:
            return f'{ends[0]}_{sides[0]}'
        if short:
            return short[0]
        glued = re.search(r'(front|fore|rear|back|hind)[^a-z]*(left|right)', spaced)
        if glued:
            return f'{_ENDS[glued[1]]}_{glued[2]}'
        turned = re.search(r'(left|right)[^a-z]*(front|fore|rear|back|hind)', spaced)
        if turned:
            return f'{_ENDS[turned[2]]}_{turned[1]}'
    return ''


def _named(places: dict[int, Array], names: dict[int, str], found: Findings
           ) -> tuple[str, dict[str, int]]:
    """Return where the front is, and which leg is which foot."""
    if sorted(names.values()) == sorted(FEET):
        feet = {name: number for number, name in names.items()}
        for forward in FORWARD:
            if _by_place(places, forward) == feet:
                return forward, feet
        found.warn('feet', 'names of the legs do not fit where they lie: taken from their places',
                   'check feet and forward')
    else:
        found.warn('feet', 'names of the legs do not say which is front left ...: taken from their '
                   'places, with the front at +x', 'check feet and forward')
    return '+x', _by_place(places, '+x') or dict(zip(FEET, places, strict=True))


def _by_place(places: dict[int, Array], forward: str) -> dict[str, int] | None:
    middle = np.mean(list(places.values()), axis=0)
    turn = from_rpy((0.0, 0.0, FORWARD[forward] * pi / 2))

    def of(number: int) -> str:
        x, y, _z = turn @ (places[number] - middle)
        return f'{"front" if x > 0 else "back"}_{"left" if y > 0 else "right"}'

    feet = {of(number): number for number in places}
    return feet if len(feet) == 4 else None

