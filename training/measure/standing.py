"""
How far a body creeps while it stands, by the sweeps of the contact solve, and what they cost.

The batched engine takes the fewest sweeps with which a body moves by less than 1 mm in 5 s; bodies
that do with the usual ones keep those. Example: `python -m training standing physical_twin`.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import replace
from time import perf_counter

import numpy as np

from w2b_core import bodies
from w2b_core.network import Network
from w2b_sim.engines.batched import BatchedEngine
from w2b_sim.engines.batched.standing import LADDER, STILL_M
from w2b_sim.engines.interface import Start
from w2b_sim.worlds import WORLDS

CONTROLLERS = 64
#: Periods of the evaluations that are timed.
PERIODS = 20


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument('body', help='name or file of a body')
    parser.add_argument('--precision', choices=('float32', 'float64'), default='float32')
    parser.add_argument('--physics-steps', type=int, metavar='N',
                        help="in a control period, instead of the world's")
    parser.add_argument('--json', action='store_true', help='print JSON')


def main(args: argparse.Namespace) -> int:
    """Print the table; return the exit code: 0, or 2 for an error."""
    try:
        if args.physics_steps is not None and args.physics_steps < 1:
            raise ValueError(f'--physics-steps: expected at least 1, got {args.physics_steps}')
        body = bodies.get(args.body)
        engine = BatchedEngine(body, WORLDS[body.world], args.precision,
                               physics_steps=args.physics_steps)
    except (ValueError, OSError) as error:
        print(f'standing: {" ".join(str(error).split())}', file=sys.stderr)
        return 2
    chosen = engine.sweeps[1]
    rows = []
    for sweeps in sorted({chosen, engine.usual_sweeps[1], *LADDER}):
        rows.append({'sweeps': sweeps, 'creep_mm': 1e3 * engine.standing_creep_m(sweeps),
                     'seconds': seconds(engine, sweeps)})
    usual = next(row for row in rows if row['sweeps'] == engine.usual_sweeps[1])
    for row in rows:
        row['time'] = row['seconds'] / usual['seconds']
    if args.json:
        print(json.dumps({'body': body.name, 'chosen': chosen, 'rows': rows}))
        return 0
    print(f'{body.name}, {args.precision}: creep of a standing body in 5 s; bound '
          f'{1e3 * STILL_M:g} mm\n{"sweeps":>8} {"creep":>10} {"time":>8}')
    for row in rows:
        mark = '  <- chosen' if row['sweeps'] == chosen else ''
        print(f'{row["sweeps"]:8} {row["creep_mm"]:7.2f} mm {row["time"]:7.2f}x{mark}')
    return 0


def seconds(engine: BatchedEngine, sweeps: int) -> float:
    """Return how long evaluations of random controllers take with so many sweeps, s."""
    rng, layout = np.random.default_rng(1), engine.layout
    network = Network(rng.normal(size=(CONTROLLERS, layout.hidden, layout.inputs + 1)),
                      rng.normal(size=(CONTROLLERS, layout.joints, layout.hidden)),
                      np.array([joint.time_constant for joint in engine.body.joints]))
    timed = BatchedEngine(engine.body, replace(engine.world, steps=PERIODS),
                          'single' if layout.bits == 32 else 'double',
                          sweeps=(engine.usual_sweeps[0], sweeps))
    primed = rng.uniform(-1, 1, (CONTROLLERS, 1, layout.hidden))
    timed.evaluate_primed(network, primed, [Start()])
    began = perf_counter()
    timed.evaluate_primed(network, primed, [Start()])
    return perf_counter() - began
