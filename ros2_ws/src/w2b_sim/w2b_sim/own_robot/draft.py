"""`w2b robot init`: the maker's YAML drafted from a URDF, with what to check marked in it."""

from __future__ import annotations

import contextlib
from pathlib import Path

from w2b_core.bodies.inertia import volume_m3
from w2b_core.bodies.model import Box, Capsule, Cylinder, Placed
from w2b_core.bodies.robot_file.build import build
from w2b_core.bodies.robot_file.findings import Findings, RobotFileError
from w2b_core.bodies.robot_file.posed import pose
from w2b_core.bodies.robot_file.settings import Settings, read_settings
from w2b_core.bodies.robot_file.urdf_reader import Mesh, Urdf, read_urdf
from w2b_sim.own_robot import approximate, legs, standing_pose

#: A printed part, its servo and its screws, where a description has no masses.
DENSITY_KG_M3 = 600.0
SWING_RAD, ROLL_SWING_RAD = 0.4, 0.25
#: Mass of a robot up to which servos of a class are usual: torque in N m, what they are.
SERVOS = ((0.6, 0.18, 'a metal gear micro servo of 14 g at 5 V'),
          (1.5, 0.9, 'a servo of 10 kg cm'), (6.0, 2.0, 'a servo of 20 to 25 kg cm'),
          (1000.0, 20.0, 'a geared brushless motor'))


def draft(path: Path, urdf: Path, meshes: Path | None) -> tuple[str, Findings]:
    """
    Return the text of the YAML for `path`, and what was found on the way.

    Parameters
    ----------
    path
        Where the text is to be written: beside the URDF.
    urdf
        The description.
    meshes
        Folder of meshes to approximate; None: meshes are left to the maker.

    Raises
    ------
    RobotFileError
        If the URDF cannot be read, or has not four legs. What is only lacking in the draft is an
        error among the findings.

    """
    found = Findings(urdf)
    described = read_urdf(urdf, found)
    guess = legs.find(described, found)
    shapes, left = _shapes(described, guess, meshes, found)
    found.stop_at_errors()
    stand = _stand(described, guess, shapes)
    masses = _masses(described, guess, stand, shapes, path)
    text = _text(urdf.name, described, guess, stand, shapes, masses, left)
    read = Findings(path)
    with contextlib.suppress(RobotFileError):  # said by the findings: the maker goes on from here
        build(described, read_settings(path, read, text), read)
    for finding in read:
        found.add(finding)
    return text, found


def _stand(urdf: Urdf, guess: legs.Legs, shapes: dict[str, tuple[Placed, ...]]
           ) -> dict[str, float]:
    held = {name: round(angle, 2) for name, angle in legs.within_limits(urdf).items()
            if name in guess.locked}
    return standing_pose.find(urdf, guess, shapes) | held


def _shapes(urdf: Urdf, guess: legs.Legs, meshes: Path | None, found: Findings
            ) -> tuple[dict[str, tuple[Placed, ...]], list[str]]:
    """
    Return stand-ins for links with meshes, and the links whose meshes are left.

    Covers, which are seen only and weigh nothing, need none where their part has other links.
    """
    held = Settings(found.path, 'robot', None, locked=guess.locked,
                    stand_rad=legs.within_limits(urdf))
    covers = set()
    for part in pose(urdf, held, Findings(found.path)).parts:
        seen_only = {name for name in part.links
                     if urdf.links[name].only_visual and urdf.links[name].inertial is None}
        if any(urdf.links[name].pieces for name in set(part.links) - seen_only):
            covers |= seen_only
    made, left = {}, []
    for link in urdf.links.values():
        if link.name in covers or not any(isinstance(piece.shape, Mesh) for piece in link.pieces):
            continue
        if meshes is None:
            left.append(link.name)
        else:
            made[link.name] = approximate.stand_ins(link, meshes, found)
    return made, left


def _masses(urdf: Urdf, guess: legs.Legs, stand: dict[str, float],
            shapes: dict[str, tuple[Placed, ...]], path: Path) -> dict[str, float]:
    """Return masses by volume for moving parts that the URDF gives none."""
    posed = pose(urdf, Settings(path, 'robot', None, locked=guess.locked,
                                stand_rad=stand), Findings(path))
    masses = {}
    for part in posed.parts:
        links = [urdf.links[name] for name in part.links]
        if any(link.inertial is not None and link.inertial.mass_kg > 0 for link in links):
            continue
        for link in links:
            own = shapes.get(link.name) or tuple(
                Placed(piece.shape) for piece in link.pieces if not isinstance(piece.shape, Mesh))
            if own:
                volume = sum(volume_m3(placed.shape) for placed in own)
                masses[link.name] = max(round(volume * DENSITY_KG_M3, 4), 0.003)
    return masses


def _text(urdf_name: str, urdf: Urdf, guess: legs.Legs, stand: dict[str, float],
          shapes: dict[str, tuple[Placed, ...]], masses: dict[str, float], left: list[str]) -> str:
    described_kg = sum(masses.values()) + sum(
        max(link.inertial.mass_kg, 0.0) for link in urdf.links.values() if link.inertial)
    torque, what = next((torque, what) for most, torque, what in SERVOS if described_kg <= most)
    lines = [f'# Drafted from {urdf_name} by `w2b robot init`. CHECK what says so, then run',
             '# `w2b robot check` on this file. Angles are those of the URDF, rad.',
             f'urdf: {_quoted(urdf_name)}',
             f'forward: {guess.forward}',
             f'locked: [{", ".join(map(_quoted, guess.locked))}]',
             'stand:  # CHECK: how the robot stands']
    lines += [f'  {_quoted(name)}: {_number(angle)}' for name, angle in stand.items()]
    lines += ['feet:']
    for foot, link in guess.feet.items():
        pieces = urdf.links[link].pieces
        bare = not pieces and link not in shapes
        lines.append(f'  {foot}: {{link: {_quoted(link)}'
                     + (', radius_m: 0.008' if bare else '') + '}'
                     + ('  # CHECK: the radius' if bare else ''))
    lines += [f'servo: {{torque_nm: {torque}, speed_rad_s: 5.0}}  # CHECK: {what}; the URDF says '
              + _efforts(urdf, guess),
              f'swing_rad:\n  default: {SWING_RAD}']
    lines += [f'  {_quoted(leg[0].name)}: {ROLL_SWING_RAD}' for leg in guess.joints.values()
              if len(leg) == 3]
    lines += [f'# weigh_kg: {described_kg:.3f}  # CHECK: put it on a scale; all masses are scaled']
    if masses:
        lines += ['masses_kg:  # CHECK: the URDF gives none; by volume']
        lines += [f'  {_quoted(name)}: {_number(mass)}' for name, mass in masses.items()]
    if shapes:
        lines += ['shapes:  # CHECK: one capsule or box around each mesh']
        for name, parts in shapes.items():
            lines.append(f'  {_quoted(name)}:')
            lines += [f'    - {_shape(part)}' for part in parts]
    if left:
        lines += [f'# Meshes without a stand-in: {", ".join(left)}. Give shapes, or run init again '
                  'with --approximate.']
    lines += ['# servos:  # outputs of the servo board, as in',
              f'#   {next(iter(stand))}: {{channel: 0, direction: 1, zero_us: 1500, '
              'us_per_rad: 637}']
    return '\n'.join(lines) + '\n'


def _efforts(urdf: Urdf, guess: legs.Legs) -> str:
    efforts = {(joint.effort_nm, joint.speed_rad_s) for leg in guess.joints.values()
               for joint in leg}
    return ', '.join(f'effort {effort:g} and velocity {speed:g}'
                     for effort, speed in sorted(efforts)[:2])


def _shape(placed: Placed) -> str:
    shape = placed.shape
    at = '' if not any(placed.centre_m) else f', at_m: {_vector(placed.centre_m)}'
    turn = '' if not any(placed.rpy_rad) else f', rpy_rad: {_vector(placed.rpy_rad)}'
    if isinstance(shape, Box):
        return f'{{box: {{size_m: {_vector(shape.size_m)}}}{at}{turn}}}'
    if isinstance(shape, Capsule | Cylinder):
        kind = 'capsule' if isinstance(shape, Capsule) else 'cylinder'
        return (f'{{{kind}: {{radius_m: {_number(shape.radius_m)}, length_m: '
                f'{_number(shape.length_m)}, axis: {_vector(shape.axis)}}}{at}{turn}}}')
    return f'{{sphere: {{radius_m: {_number(shape.radius_m)}}}{at}}}'


def _vector(values: tuple[float, ...]) -> str:
    return f'[{", ".join(map(_number, values))}]'


def _number(value: float) -> str:
    """Return a number as `plain_yaml` reads it: no exponent."""
    text = f'{value:.5f}'.rstrip('0')
    return text + '0' if text.endswith('.') else text


def _quoted(name: str) -> str:
    return "'" + name.replace("'", "''") + "'"

