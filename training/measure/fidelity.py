"""
How closely an engine repeats recorded evaluations: `python -m training fidelity --traces FILE.npz`.

Contact is chaotic, so an engine cannot follow a recording for all its 25 s: it agrees when its
error is no larger than the recording's own after a nudge of 1e-6 m, the noise floor. Per body:
median and 90th percentile of the error of the final x-y displacement, and the rank correlation of
final x with the recording's, each with the floor's beside it; and the share of time in which the
feet touch.

The bounds are those of the batched engine in double precision: median error at most twice the
floor's plus 5 mm, rank correlation at least the floor's less 0.05. PyBullet, whose friction is
another law, is printed beside it without a bound, for a part of the evaluations: it takes seconds
for what the batched engine does in milliseconds (--engine pybullet repeats all of them).
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import replace
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import spearmanr

from training.measure.traces import Traces, TracesError, load
from w2b_controller.network import Network, State, step
from w2b_sim.engines.interface import Start
from w2b_sim.rollout import sensor_values, targets_rad
from w2b_sim.worlds import PAPER

Array = NDArray[np.float64]
ENGINES = ('batched', 'pybullet')
#: As many evaluations of a body are repeated in PyBullet where it is only printed beside.
BESIDE = 48
MEDIAN_FACTOR, MEDIAN_ALLOWANCE_M, RANK_ALLOWANCE = 2.0, 0.005, 0.05


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument('--traces', type=Path, required=True, metavar='FILE.npz',
                        help='recorded evaluations of the original simulator')
    parser.add_argument('--engine', choices=ENGINES, default=None,
                        help='only this one (default: batched, and PyBullet beside it)')
    parser.add_argument('--json', action='store_true',
                        help='print JSON, of one engine (default: batched)')


def main(args: argparse.Namespace) -> int:
    """Run the command; return the exit code."""
    try:
        recorded = load(args.traces)
    except TracesError as error:
        print(f'fidelity: {error}', file=sys.stderr)
        return 2
    if args.json:
        engine = args.engine or ENGINES[0]
        print(json.dumps({'bodies': {
            traces.name: compare(traces, *replay(engine, traces)) for traces in recorded}}))
        return 0
    print(f'{"":24}{"engine":10}{"median error":>24}{"90 %":>20}{"rank corr. of x":>20}'
          f'{"touch":>8}')
    for engine in (args.engine,) if args.engine else ENGINES:
        for traces in recorded:
            if engine == 'pybullet' and args.engine is None:
                traces = sample(traces, BESIDE)
            print(_line(engine, traces.name, compare(traces, *replay(engine, traces))),
                  flush=True)
    return 0


def sample(traces: Traces, count: int) -> Traces:
    """Return recorded evaluations of evenly spaced controllers, about `count` at most."""
    controllers, words = traces.hidden.shape[:2]
    every = slice(None, None, max(1, -(-controllers * words // count)))
    network = traces.network
    return replace(traces, network=Network(network.hidden_weights[every],
                                           network.motor_weights[every],
                                           network.motor_time_constants),
                   hidden=traces.hidden[every], position_m=traces.position_m[every],
                   nudged_m=traces.nudged_m[every])


def replay(engine: str, traces: Traces) -> tuple[Array, float | None]:
    """
    Let `engine` repeat recorded evaluations from the recorded primed states.

    Returns the x-y displacements (C, W, 2), NaN where it failed, and the share of frames in which
    touch-sensitive links touch the floor, None for a body without any.
    """
    world = replace(PAPER, steps=traces.position_m.shape[2])
    if engine == 'pybullet':
        return _replay_in_pybullet(traces, world.steps)
    from w2b_sim.engines.batched import BatchedEngine

    outcome = BatchedEngine(traces.body, world, 'double').evaluate_primed(
        traces.network, traces.hidden[..., 1], [Start()])
    touch = outcome.touch_fraction
    return (outcome.final_position_m[:, :, 0, :2],
            float(np.nanmean(touch)) if touch.shape[-1] else None)


def _replay_in_pybullet(traces: Traces, steps: int) -> tuple[Array, float | None]:
    from w2b_sim.engines.pybullet_engine import PyBulletSimulation

    body, network = traces.body, traces.network
    controllers, words = traces.hidden.shape[:2]
    moved = np.zeros((controllers, words, 2))
    touches: list[bool] = []
    simulation = PyBulletSimulation(body, PAPER)
    try:
        for c, w in np.ndindex(controllers, words):
            simulation.reset()
            one = Network(network.hidden_weights[c], network.motor_weights[c],
                          network.motor_time_constants)
            state = State(traces.hidden[c, w, :, 1], traces.hidden[c, w, :, 0],
                          np.zeros(one.motor_count), True)
            for _ in range(steps - 1):
                frame = simulation.observe()
                touches.extend(frame.touching.values())
                targets = targets_rad(body, state.motors)
                state = step(one, state, sensor_values(body, frame, state.motors))
                simulation.step(targets)
            moved[c, w] = simulation.observe().position_m[:2]
    finally:
        simulation.close()
    return moved, float(np.mean(touches)) if touches else None


def compare(traces: Traces, moved: Array, touch: float | None) -> dict[str, Any]:
    """
    Return an engine's agreement with a recording, by the names of the JSON output.

    A failed evaluation counts as an infinite error; what is not finite, as a correlation over
    fewer than two evaluations, is None.
    """
    recorded = traces.position_m[:, :, -1, :2] - traces.position_m[:, :, 0, :2]
    nudged = traces.nudged_m[:, :, -1, :2] - traces.nudged_m[:, :, 0, :2]
    error = np.linalg.norm(moved - recorded, axis=-1)
    error = np.where(np.isnan(error), np.inf, error)
    floor = np.linalg.norm(nudged - recorded, axis=-1)
    measured = {
        'median_error_m': np.median(error),
        'p90_error_m': np.quantile(error, 0.9, method='higher'),
        'floor_median_error_m': np.median(floor),
        'rank_correlation': _rank(moved[..., 0], recorded[..., 0]),
        'floor_rank_correlation': _rank(nudged[..., 0], recorded[..., 0])}
    result: dict[str, Any] = {
        name: float(value) if isfinite(value) else None for name, value in measured.items()}
    result['touch'] = touch
    return result


def within_bounds(measured: dict[str, Any]) -> bool:
    """Return whether an engine's agreement is within the bounds of the batched engine."""
    median, rank = measured['median_error_m'], measured['rank_correlation']
    floor_rank = measured['floor_rank_correlation']
    return (median is not None and median <= MEDIAN_FACTOR * measured['floor_median_error_m']
            + MEDIAN_ALLOWANCE_M
            and (floor_rank is None or (rank is not None
                                        and rank >= floor_rank - RANK_ALLOWANCE)))


def _rank(a: Array, b: Array) -> float:
    a = np.nan_to_num(a).ravel()
    if a.size < 2 or np.ptp(a) == 0 or np.ptp(b) == 0:
        return float('nan')
    return float(spearmanr(a, b.ravel()).statistic)


def _line(engine: str, name: str, measured: dict[str, Any]) -> str:
    def text(value: float | None, digits: int, unit: str = '') -> str:
        return '-' if value is None else f'{value:.{digits}f}{unit}'

    median = (f'{text(measured["median_error_m"], 4, " m")} '
              f'(floor {text(measured["floor_median_error_m"], 4)})')
    rank = (f'{text(measured["rank_correlation"], 3)} '
            f'(floor {text(measured["floor_rank_correlation"], 3)})')
    verdict = ''
    if engine == 'batched':
        verdict = '  within bounds' if within_bounds(measured) else '  OUT OF BOUNDS'
    return (f'{name:24}{engine:10}{median:>24}{text(measured["p90_error_m"], 4, " m"):>20}'
            f'{rank:>20}{text(measured["touch"], 3):>8}{verdict}')

