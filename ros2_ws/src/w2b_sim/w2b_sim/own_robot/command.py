"""`w2b robot`: a robot of one's own, from its URDF to a body that can be trained."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from w2b_core import bodies
from w2b_core.bodies import robot_file
from w2b_core.bodies.robot_file import Finding, Grade, RobotFile, RobotFileError
from w2b_core.bodies.robot_file.directions import motions
from w2b_core.bodies.urdf import to_urdf
from w2b_core.command_process import command
from w2b_core.files import write_atomically
from w2b_core.network.symmetry import NotSymmetricError, find_mirror, find_mirrors

ABOUT = """\
A robot of your own: one URDF and one YAML in, a body that can be trained out.

  w2b robot init my.urdf            draft my.yaml: chains, feet, stance, forward
  w2b robot check my.yaml           validate it, draw it from three sides, let it stand for 5 s
  w2b robot export my.yaml --out D  the cleaned URDF and MJCF, for other simulators
  w2b robot draw BODY --out F.svg   drawings to build it from: views, wiring, horns

Then train it: docs/robots.md.
"""
ENGINES = ('pybullet', 'mujoco')


@command
def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return the exit code: 0, 1 if the robot cannot be used, 2 for usage."""
    parser = argparse.ArgumentParser(prog='w2b robot', description=ABOUT,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    verbs = parser.add_subparsers(dest='verb', required=True)
    init = verbs.add_parser('init', help="draft a robot's YAML from its URDF")
    init.add_argument('urdf', type=Path)
    init.add_argument('--out', type=Path, help='YAML to write (default: beside the URDF)')
    init.add_argument('--approximate', action='store_true',
                      help='one capsule or box in place of each mesh')
    init.add_argument('--meshes', type=Path, metavar='DIR',
                      help="folder of the meshes (default: the URDF's)")
    check = verbs.add_parser('check', help='validate a robot, draw it, let it stand')
    check.add_argument('robot', type=Path, help='YAML file')
    check.add_argument('--picture', type=Path, metavar='PNG',
                       help='where to draw it (default: beside the YAML)')
    check.add_argument('--no-engines', action='store_true', help='do not let it stand')
    export = verbs.add_parser('export', help='write the cleaned URDF and MJCF')
    export.add_argument('robot', type=Path, help='YAML file')
    export.add_argument('--out', type=Path, required=True, metavar='DIR')
    draw = verbs.add_parser('draw', help='drawings to build a robot from')
    draw.add_argument('body', help='YAML file, or name of a registered body')
    draw.add_argument('--out', type=Path, required=True, metavar='SVG')
    draw.add_argument('--sheet', choices=('views', 'wiring', 'horns'), default='views',
                      help='views: dimensions, joints and their positive directions; wiring: the '
                      'servo board, IMU, supply; horns: pulses at zero and at the limits '
                      '(default: %(default)s)')
    options = parser.parse_args(arguments)
    try:
        return {'init': _init, 'check': _check, 'export': _export, 'draw': _draw}[
            options.verb](options)
    except RobotFileError as error:
        _print(error.findings, sys.stderr)
        print(f'w2b robot: {error.path} cannot be used', file=sys.stderr)
        return 1
    except (OSError, ValueError) as error:
        print(f'w2b robot: {" ".join(str(error).split())}', file=sys.stderr)
        return 1


def _init(options: argparse.Namespace) -> int:
    from w2b_sim.own_robot.draft import draft

    out = options.out or options.urdf.with_suffix('.yaml')
    if out.exists():
        raise ValueError(f'{out}: is there already; delete it, or give another --out')
    if out.parent.resolve() != options.urdf.parent.resolve():
        raise ValueError(f'{out}: expected a file beside {options.urdf}, which it names')
    text, found = draft(out, options.urdf, (options.meshes or options.urdf.parent)
                        if options.approximate else None)
    write_atomically(out, text.encode())
    _print(found, sys.stdout)
    print(f'{out}: drafted; check what it marks, then `w2b robot check {out}`')
    return 0


def _check(options: argparse.Namespace) -> int:
    robot = robot_file.read(options.robot)
    body, stance = robot.body, robot.stance
    if body is None or stance is None:
        print(f'{options.robot}: names the body {robot.settings.body}; its wiring is in order')
        return 0
    _print(robot.findings, sys.stdout)
    try:
        find_mirror(body, 'left_right')
    except NotSymmetricError as error:
        print(f'warning: {error}: each leg is trained for itself; correct the URDF if the robot is '
              'symmetric')
    print(_about(robot))
    print('+10 degrees of each joint moves the end of its leg:')
    for name, motion in motions(body).items():
        print(f'  {name:24} {motion.words}')
    bad = 0
    if not options.no_engines:
        bad = _in_engines(robot)
    from w2b_sim.own_robot.picture import draw

    picture = options.picture or options.robot.with_suffix('.png')
    draw(body, stance, picture)
    print(f'{picture}: look at it: are feet, front and directions as on your robot?')
    print(f'{options.robot}: ' + (f'{bad} to fix' if bad else 'in order'))
    return 1 if bad else 0


def _about(robot: RobotFile) -> str:
    body, stance = robot.body, robot.stance
    assert body is not None
    assert stance is not None
    mirrors = ', '.join(mirror.name for mirror in find_mirrors(body)) or 'none'
    joint = max(stance.torque_nm, key=lambda name: stance.torque_nm[name])
    servo = body.joint(joint).servo
    return (f'{body.name}: {len(body.joints)} servos, {stance.mass_kg:.3f} kg, stands '
            f'{1000 * body.height_m:.0f} mm high, {1000 * body.length_m:.0f} mm long, mirrors: '
            f'{mirrors}\nholding the stance needs {stance.torque_nm[joint]:.3f} N m ({joint}) of '
            f'{servo.max_torque_nm:g}; the centre of mass is {1000 * stance.margin_m:.0f} mm '
            'inside the support polygon')


def _in_engines(robot: RobotFile) -> int:
    from w2b_sim.own_robot import standing

    body = robot.body
    assert body is not None
    bad = 0
    at_rest, swinging = standing.overlaps(body)
    for pair in at_rest:
        print(f'error: {pair} run into each other at the stance; move them apart (stand, shapes)')
        bad += 1
    for pair in swinging:
        print(f'warning: {pair} run into each other within the swing, which training does not '
              'notice; give them a smaller swing_rad')
    print(f'stands for {standing.SECONDS:.0f} s:')
    for engine in ENGINES:
        stood = standing.stand(body, engine)
        print(f'  {stood}')
        if stood.problem:
            print(f'error: in {engine} it {stood.problem}; check stand, masses and servo.torque_nm')
            bad += 1
    return bad


def _export(options: argparse.Namespace) -> int:
    from w2b_sim.engines.mujoco_model import to_mjcf
    from w2b_sim.worlds import WORLDS

    body = robot_file.read(options.robot).body
    if body is None:
        raise ValueError(f'{options.robot}: names a registered body; use `w2b urdf`')
    options.out.mkdir(parents=True, exist_ok=True)
    for suffix, text in (('.urdf', to_urdf(body)), ('.xml', to_mjcf(body, WORLDS[body.world]))):
        path = options.out / f'{body.name}{suffix}'
        write_atomically(path, text.encode())
        print(path)
    return 0


def _draw(options: argparse.Namespace) -> int:
    from w2b_sim.own_robot import drawing, electrics

    if options.out.suffix.lower() != '.svg':
        raise ValueError(f'--out: expected a name that ends in .svg, got {options.out}')
    body, wiring = bodies.check(options.body), bodies.wiring(options.body)
    made = {'views': drawing.views, **electrics.SHEETS}[options.sheet](body, wiring)
    write_atomically(options.out, made)
    print(f'{options.out}: {body.name}, {options.sheet}')
    return 0


def _print(findings: Iterable[Finding], stream: object) -> None:
    """Print findings, those that say the same of several parts in one line."""
    alike: dict[tuple[Grade, str], list[Finding]] = {}
    for one in findings:
        alike.setdefault((one.grade, one.alike or f'{one.what} {one.fix}'), []).append(one)
    for (grade, _what), same in alike.items():
        first = same[0]
        more = f' (and {len(same) - 1} more)' if len(same) > 1 else ''
        line = re.sub(r'^([^:]*)', rf'\1{more}', str(first), count=1) if first.where else str(first)
        print(f'{grade.value}: {line}', file=stream)  # type: ignore[call-overload]
