"""
The table of evidence of a controller with legs: `python -m training evidence CONTROLLER --out DIR`.

The judge's conditions, one row each and engine: as it ships, a minute, every disturbance alone, all
of them together, without an IMU; words switched in all ordered pairs. Each row says which of the
body's bounds it misses. Rows that DIR has are not walked again if they are of this very controller,
plan and number of starts, the engine's version and the same sources of judge and simulation.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from math import radians
from pathlib import Path
from typing import Any

from training.judge.command import judge
from training.judge.conditions import Conditions
from training.judge.trial import Plan
from w2b_core.controller import file as controller_file
from w2b_core.files import write_atomically, write_json
from w2b_sim.engines import registry

GYRO_BIAS_RAD_S = 0.01


@dataclass(frozen=True)
class Bounds:
    """
    What a body's champion is to reach: medians of speed, every start's else.

    `turn_deg` is of the time `seconds` that a row takes. `kept` is the share of its own speed that
    a disturbance must leave.
    """

    seconds: float
    speed_m_s: float
    worst_speed_m_s: float
    heading_deg: float
    long_heading_deg: float
    hard_heading_deg: float
    across_share: float
    turn_deg: tuple[float, float]
    displacement_m: float
    stop_drift_m: float
    joint_hz: float = 2.5
    at_speed_limit: float = 0.1
    kept: float = 0.8


BOUNDS = {
    'physical_twin': Bounds(10.0, 0.144, 0.12, 8.0, 15.0, 12.0, 0.08, (60.0, 200.0), 0.12, 0.01),
    'quadruped': Bounds(25.0, 0.048, 0.0, 15.0, 90.0, 90.0, 1.0, (45.0, 1e3), 1e3, 0.1,
                        at_speed_limit=1.0, kept=0.0)}


@dataclass(frozen=True)
class Row:
    """A row: conditions beside the simulated IMU's, and in what it is not as the others."""

    name: str
    conditions: Mapping[str, Any]
    starts: int = 0
    minute: bool = False
    switch_s: float = 0.0
    imu: bool = True


ROWS = (
    Row('as it ships', {}, switch_s=4.0), Row('a minute', {}, starts=5, minute=True),
    Row('friction 0.4', {'friction': 0.4}), Row('friction 1.0', {'friction': 1.0}),
    Row('one period late', {'late': True}), Row('zeros off by 5 degrees',
                                                {'zeros_rad': radians(5.0)}),
    Row('masses -20 %', {'mass': 0.8}), Row('masses +20 %', {'mass': 1.2}),
    Row('servos -20 %', {'servo': 0.8}), Row('all together (--hard)', {'hard': True}, starts=20),
    Row('no IMU', {'no_imu': True}, imu=False))
HEAD = ('| conditions | engine, starts | forward / backward, body lengths/s (worst) | '
        'worst heading, degrees | sideways, worst | left / right, degrees | '
        'turning, displacement | stop, drift | fastest joint, Hz | at speed limit | '
        'falls | misses |\n' + '|---' * 12 + '|')


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    add = parser.add_argument
    add('controller', help='a controller file, or the name of one that ships')
    add('--out', type=Path, required=True, metavar='DIR', help='for rows.json and table.md')
    add('--engines', nargs='+', choices=registry.stepwise_names(),
        default=list(registry.stepwise_names()))
    add('--starts', type=int, default=20, metavar='N', help='as it ships (default: %(default)s)')
    add('--disturbed', type=int, default=6, metavar='N',
        help='starts of a disturbance (default: %(default)s)')
    add('--rows', type=int, default=len(ROWS), metavar='N', help='only the first N rows')
    add('--processes', type=int, default=1, metavar='N', help='changes no result (default: 1)')


def main(args: argparse.Namespace) -> int:
    """Run the command; return the exit code: 0, 1 if a bound is missed, 2 for an error."""
    try:
        return _gather(args)
    except (ValueError, OSError) as error:
        print(f'evidence: {" ".join(str(error).split())}', file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print('evidence: interrupted; the rows so far are kept', file=sys.stderr)
        return 130


def _gather(args: argparse.Namespace) -> int:
    path = controller_file.resolve(args.controller)
    controller = controller_file.load(path)
    if controller.body not in BOUNDS:
        raise ValueError(f'{args.controller}: expected a body with bounds, one of '
                         f'{", ".join(BOUNDS)}, got {controller.body}')
    bounds = BOUNDS[controller.body]
    own, judged_by = hashlib.sha256(path.read_bytes()).hexdigest(), sources_sha256()
    args.out.mkdir(parents=True, exist_ok=True)
    kept = args.out / 'rows.json'
    rows: dict[str, Any] = json.loads(kept.read_text(encoding='utf-8')) if kept.exists() else {}
    if rows.get('controller') != own:
        rows = {'controller': own}
    results: dict[str, Any] = {}
    lines, missed = [HEAD], False
    for engine in args.engines:
        for row in ROWS[:args.rows]:
            starts = min(row.starts or (args.disturbed if row.conditions else args.starts),
                         args.starts)
            key = f'{engine}: {row.name}: {starts}'
            plan = Plan(engine, 60.0 if row.minute else bounds.seconds, row.switch_s,
                        Conditions(**row.conditions, imu_noise=row.imu,
                                   gyro_bias_rad_s=GYRO_BIAS_RAD_S * row.imu))
            of = identity(plan, starts, judged_by)
            found = rows.get(key)
            if not isinstance(found, dict) or found.get('of') != of:
                found = {'of': of, 'result': judge(controller, plan, starts, args.processes)}
                rows[key] = found
                write_json(kept, rows)
            results[key] = found['result']
            first = results[f'{engine}: {ROWS[0].name}: {args.starts}']
            misses = missing(results[key], first, row, bounds)
            missed |= bool(misses)
            lines.append(line(row, engine, starts, results[key], misses))
            print(lines[-1], flush=True)
            write_atomically(args.out / 'table.md', ('\n'.join(lines) + '\n').encode())
    return int(missed)


def identity(plan: Plan, starts: int, judged_by: str) -> dict[str, Any]:
    """Return what a row is a measurement of, as JSON has it; `judged_by` of `sources_sha256`."""
    about = {'plan': asdict(plan), 'starts': starts, 'engine_version': _version(plan.engine),
             'numpy': _version('numpy'), 'sources_sha256': judged_by}
    value: dict[str, Any] = json.loads(json.dumps(about))
    return value


def _version(package: str) -> str:
    """Return the version of an installed package; '' of an engine that is none."""
    try:
        return version(package)
    except PackageNotFoundError:
        return ''


def sources_sha256() -> str:
    """Return the hash of the sources that a row depends on: core, simulation and judge."""
    digest = hashlib.sha256()
    for package in ('w2b_core', 'w2b_sim', 'training.judge'):
        folder = Path(str(import_module(package).__file__)).parent
        for path in sorted(folder.rglob('*.py')):
            digest.update(f'{package}/{path.relative_to(folder)}\0'.encode() + path.read_bytes())
    return digest.hexdigest()


def missing(result: Mapping[str, Any], nominal: Mapping[str, Any], row: Row, bounds: Bounds
            ) -> list[str]:
    """Return the bounds that a row misses, given the row `nominal` as the controller ships."""
    did, found = result['behaviours'], []

    def check(name: str, holds: bool) -> None:
        if not holds:
            found.append(name)

    for name in ('forward', 'backward'):
        one, seconds = did[name], 60.0 if row.minute else bounds.seconds
        speed, worst = _speeds(one, seconds)
        if row.conditions and row.imu:
            own = _speeds(nominal['behaviours'][name], bounds.seconds)[0]
            check(f'{name} speed', worst >= bounds.kept * own)
        elif row.imu:
            check(f'{name} speed', speed >= bounds.speed_m_s and worst >= bounds.worst_speed_m_s)
        limit = (bounds.long_heading_deg if row.minute else bounds.hard_heading_deg
                 if row.conditions else bounds.heading_deg)
        if row.imu:
            check(f'{name} heading', one['worst_heading_error_deg'] <= limit)
        if not row.conditions:
            check(f'{name} sideways', one['worst_across_share'] <= bounds.across_share)
            check(f'{name} speed limit', one['at_speed_limit'] <= bounds.at_speed_limit)
    for name in ('left', 'right'):
        if not row.conditions and not row.minute:
            low, high = bounds.turn_deg
            check(f'{name} turn', low <= abs(did[name]['yaw_deg']) <= high)
            check(f'{name} displacement', did[name]['displacement_m'] <= bounds.displacement_m)
    check('stop drift', bool(row.conditions) or did['stop']['drift_m'] <= bounds.stop_drift_m)
    check('joint', max(one['fastest_joint_hz'] for one in did.values()) <= bounds.joint_hz)
    check('falls', not any(one['falls'] for one in did.values()))
    switches = result['switches']
    check('switches', switches['obeyed'] == switches['of'])
    return found


def _speeds(one: Mapping[str, Any], seconds: float) -> tuple[float, float]:
    """Return a walk's median speed, and that of its worst start, m/s."""
    speed = abs(one['along_m']) / seconds
    per_length = speed / one['body_lengths_per_s'] if one['body_lengths_per_s'] else 0.0
    return speed, one['worst_body_lengths_per_s'] * per_length


def line(row: Row, engine: str, starts: int, result: Mapping[str, Any], misses: list[str]) -> str:
    """Return a row of the table."""
    did = result['behaviours']
    walks, turns = (did['forward'], did['backward']), (did['left'], did['right'])
    switches = result['switches']
    said = f', {switches["obeyed"]} of {switches["of"]} switches' if switches['of'] else ''
    return ' | '.join([
        f'| {row.name}{said}', f'{engine}, {starts}',
        ' / '.join(f'{one["body_lengths_per_s"]:.2f} ({one["worst_body_lengths_per_s"]:.2f})'
                   for one in walks),
        ' / '.join(f'{one["worst_heading_error_deg"]:.1f}' for one in walks),
        ' / '.join(f'{one["worst_across_share"]:.1%}' for one in walks),
        ' / '.join(f'{one["yaw_deg"]:+.0f}' for one in turns),
        f'{max(one["displacement_m"] for one in turns):.3f} m',
        f'{did["stop"]["drift_m"]:.4f} m',
        f'{max(one["fastest_joint_hz"] for one in did.values()):.2f}',
        f'{max(one["at_speed_limit"] for one in did.values()):.1%}',
        str(sum(one['falls'] for one in did.values())),
        f'{", ".join(misses) or "none"} |'])
