"""A `Body` of a URDF and a maker's YAML: fixed joints merged, frames re-expressed at the stance."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fnmatch import fnmatchcase

import numpy as np
from numpy.typing import NDArray

from w2b_core.bodies.inertia import volume_m3
from w2b_core.bodies.model import (
    Body,
    Capsule,
    Cylinder,
    Joint,
    Link,
    Placed,
    Servo,
    Sphere,
    Tensor,
    Vector,
)
from w2b_core.bodies.robot_file import judge
from w2b_core.bodies.robot_file.findings import Findings
from w2b_core.bodies.robot_file.masses import Mass, bounds, link_mass, together
from w2b_core.bodies.robot_file.names import plain_names
from w2b_core.bodies.robot_file.posed import Part, Posed, pose
from w2b_core.bodies.robot_file.settings import DEFAULT_SWING_RAD, FEET, Settings, of_pattern
from w2b_core.bodies.robot_file.stance import Stance
from w2b_core.bodies.robot_file.urdf_reader import Mesh, Place, Urdf, UrdfJoint
from w2b_core.bodies.turning import from_rpy, to_rpy

Array = NDArray[np.float64]
#: Digits that are kept of lengths and directions: beyond them is rounding of turns.
DIGITS = 10
#: Less swing than this is no gait.
LEAST_SWING_RAD = 0.05
DENSITY_OF_A_STAND_IN = 1000.0
WORLD = 'earth'


@dataclass(frozen=True)
class _Made:
    """A part of the robot while it is built: where its frame is, what it weighs, its shapes."""

    part: Part
    frame_m: Array
    mass: Mass
    shapes: tuple[Placed, ...]


def build(urdf: Urdf, settings: Settings, found: Findings) -> tuple[Body, Stance]:
    """Return the body and how it stands (RobotFileError; warnings are added to `found`)."""
    posed = pose(urdf, settings, found)
    judge.legs(posed, settings, urdf, found)
    links = plain_names('link', urdf.links, found)
    joints = plain_names('joint', posed.stand_rad, found)
    masses, shapes = _masses_and_shapes(urdf, posed, settings, found)
    found.stop_at_errors()
    made = [_made(urdf, part, number, posed, masses, shapes, found)
            for number, part in enumerate(posed.parts)]
    found.stop_at_errors()
    total_kg = sum(one.mass.mass_kg for one in made)
    scale = (settings.weigh_kg or total_kg) / total_kg
    volume = sum(volume_m3(shape.shape) for one in made for shape in one.shapes)
    judge.weights(total_kg, volume, settings, {one.part.links[0]: one.mass.mass_kg * scale
                                       for one in made}, found)
    body = Body(
        name=settings.name,
        description=f'{len(joints)} servos on four legs, from {urdf.name}',
        links=tuple(_link(one, links, scale) for one in made),
        joints=tuple(_joint(one, made, posed, settings, (links, joints), found)
                     for one in _leg_by_leg(made, posed, settings)),
        sensors=(), height_m=0.0, length_m=_length(settings, posed, made[0].shapes),
        world=WORLD)
    stance = Stance.of(body, {name: links[posed.parts[posed.owner[foot.link]].links[0]]
                              for name, foot in settings.feet.items()})
    lowest = min(foot.bottom_m[2] for foot in stance.feet.values())
    body = replace(body, height_m=_round(-lowest))
    judge.stance(stance, settings, body, found)
    found.stop_at_errors()
    return body, stance


def _leg_by_leg(made: list[_Made], posed: Posed, settings: Settings) -> list[_Made]:
    """
    Return the moving parts: hips first, in the order of `FEET`, then what hangs on them.

    Limb 0 of every maker's robot is thus its front left leg: recipes count on it.
    """
    place: dict[int, tuple[int, int]] = {}
    for leg, name in enumerate(FEET):
        for depth, number in enumerate(judge.parts_of_leg(posed, settings.feet[name].link)):
            place[number] = depth, leg
    return [made[number] for number in sorted(place, key=lambda number: place[number])]


def _masses_and_shapes(urdf: Urdf, posed: Posed, settings: Settings, found: Findings
                       ) -> tuple[dict[str, Mass], dict[str, tuple[Placed, ...]]]:
    masses, shapes = {}, {}
    feet = {foot.link: foot for foot in settings.feet.values() if foot.radius_m is not None}
    for link in urdf.links.values():
        place = posed.places[link.name]
        given = next((parts for name, parts in settings.shapes.items()
                      if fnmatchcase(link.name, name)), None)
        if link.name in feet:
            radius = feet[link.name].radius_m
            assert radius is not None
            parts: tuple[Placed, ...] = (Placed(Sphere(radius)),)
        elif given is not None:
            parts = given
        else:
            mesh = next((piece.shape for piece in link.pieces if isinstance(piece.shape, Mesh)),
                        None)
            if mesh is not None and not (link.only_visual and link.inertial is None):
                found.error(f'link {link.name}', f'mesh {_short(mesh.file)}: the engines know '
                            'boxes, capsules, cylinders and spheres',
                            f'give a primitive (shapes: {{{link.name}: [...]}}) or run `w2b robot '
                            'init --approximate`', 'mesh')
            parts = tuple(Placed(piece.shape, _vector(piece.place.at_m), to_rpy(piece.place.turn))
                          for piece in link.pieces if not isinstance(piece.shape, Mesh))
            if parts and link.only_visual:
                found.warn(f'link {link.name}', 'has no collision shape: its visual one is taken')
        shapes[link.name] = tuple(placed_in(place, one) for one in parts)
        ends = [place.at_m, *(posed.places[joint.child].at_m for joint in urdf.joints
                              if joint.parent == link.name)]
        mass = link_mass(link, place, shapes[link.name], ends,
                         of_pattern(settings.masses_kg, link.name), found)
        if mass is not None:
            masses[link.name] = mass
    return masses, shapes


def placed_in(place: Place, placed: Placed) -> Placed:
    """Return a shape of a frame that is at `place`, in the frame around it."""
    turn, shape = place.turn @ from_rpy(placed.rpy_rad), placed.shape
    at = _vector(place.at_m + place.turn @ np.asarray(placed.centre_m))
    if isinstance(shape, Sphere):
        return Placed(shape, at)
    if isinstance(shape, Capsule | Cylinder):
        # Only the direction counts: no turn is left, and mirrored legs come out alike.
        return Placed(replace(shape, axis=_vector(turn @ np.asarray(shape.axis))), at)
    return Placed(shape, at, _vector(np.array(to_rpy(turn))))


def _made(urdf: Urdf, part: Part, number: int, posed: Posed, masses: dict[str, Mass],
          shapes: dict[str, tuple[Placed, ...]], found: Findings) -> _Made:
    own = [masses[link] for link in part.links if link in masses]
    name = part.links[0]
    if not own:
        found.error(f'link {name}', 'weighs nothing, and no link that is fixed to it does',
                    f'give masses_kg: {{{name}: ...}}', 'weighs nothing')
        return _Made(part, posed.places[name].at_m, Mass(1.0, np.zeros(3), np.eye(3)), ())
    mass = together(own)
    frame = mass.centre_m if number == 0 else posed.places[name].at_m
    all_shapes = tuple(shape for link in part.links for shape in shapes[link])
    if not all_shapes:
        radius = float(np.cbrt(mass.mass_kg / DENSITY_OF_A_STAND_IN * 3 / 4 / np.pi))
        found.warn(f'link {name}', f'has no shape: a ball of {1000 * radius:.0f} mm stands in')
        all_shapes = (Placed(Sphere(round(radius, 4)), _vector(mass.centre_m)),)
    return _Made(part, frame, mass, all_shapes)


def _link(made: _Made, names: dict[str, str], scale: float) -> Link:
    tensor = made.mass.tensor_kg_m2 * scale
    rows: Tensor = (_vector(tensor[0], 16), _vector(tensor[1], 16), _vector(tensor[2], 16))
    return Link(
        names[made.part.links[0]],
        tuple(replace(one, centre_m=_vector(np.asarray(one.centre_m) - made.frame_m))
              for one in made.shapes),
        _round(made.mass.mass_kg * scale), _vector(made.mass.centre_m - made.frame_m), None, rows)


def _joint(made: _Made, all_made: list[_Made], posed: Posed, settings: Settings,
           names: tuple[dict[str, str], dict[str, str]], found: Findings) -> Joint:
    joint = made.part.joint
    assert joint is not None
    assert settings.servo is not None
    parent = all_made[posed.owner[joint.parent]]
    servo = settings.servo
    swing = _swing(joint, posed.stand_rad[joint.name], settings, found)
    links, joints = names
    return Joint(
        joints[joint.name], links[parent.part.links[0]], links[joint.child],
        _vector(made.frame_m - parent.frame_m), _vector(posed.axes[joint.name]), -swing, swing,
        Servo(servo.gain_per_s, servo.speed_rad_s, servo.speed_rad_s, servo.torque_nm))


def _swing(joint: UrdfJoint, stand_rad: float, settings: Settings, found: Findings) -> float:
    """Return how far a joint swings about its stance, to either side alike."""
    wanted = of_pattern(settings.swing_rad, joint.name)
    wanted = DEFAULT_SWING_RAD if wanted is None else wanted
    room = min(joint.upper_rad - stand_rad, stand_rad - joint.lower_rad)
    if room < LEAST_SWING_RAD:
        found.error(f'joint {joint.name}', f'stands at {stand_rad:.2f}, at the end of '
                    f'{joint.lower_rad:.2f}..{joint.upper_rad:.2f}: it cannot swing',
                    'let it stand further inside')
    elif room < wanted - 1e-9:
        found.warn(f'joint {joint.name}', f'swings by {room:.2f} rad, not {wanted:.2f}: its limits '
                   'are near', 'let it stand further inside, or swing less')
    return _round(min(wanted, max(room, LEAST_SWING_RAD)))


def _length(settings: Settings, posed: Posed, base_shapes: tuple[Placed, ...]) -> float:
    """Return the body length: as given, else of the base from back to front."""
    if settings.length_m is not None:
        return settings.length_m
    low, high = bounds(base_shapes)
    feet = [posed.places[foot.link].at_m[0] for foot in settings.feet.values()]
    return _round(max(float(high[0] - low[0]), (max(feet) - min(feet)) / 2), 4)


def _round(value: float, digits: int = DIGITS) -> float:
    return round(float(value), digits) + 0.0


def _vector(values: Array, digits: int = DIGITS) -> Vector:
    x, y, z = (_round(value, digits) for value in values)
    return x, y, z


def _short(path: str) -> str:
    """Return the end of a file's path: its folder and its name."""
    return '/'.join(path.split('/')[-2:])[-60:]
