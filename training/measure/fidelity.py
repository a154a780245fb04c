"""
How closely the engines agree with a reference.

  python -m training fidelity --traces FILE.npz     recorded evaluations of the original simulator
  python -m training fidelity --body physical_twin  PyBullet, in a world with dry friction

Contact is chaotic, so an engine cannot follow a recording for all its 25 s: it agrees when its
error is no larger than the recording's own after a nudge of 1e-6 m, the noise floor. Per body:
median and 90th percentile of the error of the final x-y displacement, and the rank correlation of
final x with the recording's, each with the floor's beside it; and the share of time in which the
feet touch.

The bounds are those of the batched engine in double precision: median error at most twice the
floor's plus 5 mm, rank correlation at least the floor's less 0.05. PyBullet and MuJoCo, whose
friction is another law, are printed beside it without a bound, for a part of the evaluations: they
take seconds for what the batched engine does in milliseconds (--engine repeats all of them).

With --body, PyBullet at the world's own physics steps (1 ms in `earth`) is the reference, and the
floor is PyBullet against itself from a start raised by 1e-6 m. Two samples of --count evaluations
each, every one a controller under a word:

  random   new controllers, every weight drawn from N(0, 1), under the study's words in turn;
  evolved  the controllers that ship for the body, or --controllers: half of the sample as they are
           under many words, their own first and then the lexicon's, and half copies of them with
           one synapse redrawn, as evolution makes them, under their own words in turn.

The row `as trained` is the engine as evolution uses it: single precision and, for the twin, the
physics steps of its training; the row `MuJoCo` is the other independent engine. PyBullet needs more
than a second for an evaluation of the twin: the default count takes about ten minutes on one core.
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

from training.measure import against_pybullet
from training.measure.against_pybullet import COUNT
from training.measure.traces import Traces, load
from w2b_core.network import Network, State, step
from w2b_core.vocabulary import Vocabulary
from w2b_sim.engines.interface import Start
from w2b_sim.rollout import sensor_values, targets_rad
from w2b_sim.worlds import PAPER

Array = NDArray[np.float64]
ENGINES = ('batched', 'pybullet', 'mujoco')
#: As many evaluations of a body are repeated in PyBullet where it is only printed beside.
BESIDE = 48
MEDIAN_FACTOR, MEDIAN_ALLOWANCE_M, RANK_ALLOWANCE = 2.0, 0.005, 0.05


HEAD = (f'{"":24}{"engine":12}{"median error":>24}{"90 %":>18}{"rank corr. of x":>20}'
        f'{"touch":>8}')
#: Options that only a comparison with PyBullet has.
WITH_BODY = ('world', 'controllers', 'count', 'seed', 'processes')


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    add = parser.add_argument
    add('--traces', type=Path, default=None, metavar='FILE.npz',
        help='compare with recorded evaluations of the original simulator')
    add('--engine', choices=ENGINES, default=None,
        help='only this one (default: batched, and PyBullet and MuJoCo beside it)')
    add('--json', action='store_true', help='print JSON, of one engine (default: batched)')
    add('--body', default=None, metavar='BODY',
        help='compare with PyBullet on this registered body; the options below need it')
    add('--world', default=None, metavar='WORLD',
        help="a world with dry friction (default: the body's own)")
    add('--controllers', nargs='+', default=None, metavar='FILE.json',
        help='evolved controllers, files or shipped names (default: all that ship for the body)')
    add('--count', type=int, default=None, metavar='N',
        help=f'evaluations of each sample (default: {COUNT})')
    add('--seed', type=int, default=None, metavar='N',
        help='of random controllers and of mutations (default: 0)')
    add('--processes', type=int, choices=(1, 2), default=None,
        help='of PyBullet and MuJoCo; changes no result (default: 1)')


def main(args: argparse.Namespace) -> int:
    """Run the command; return the exit code: 0, 2 for an error, 130 if interrupted."""
    try:
        _refuse_contradictions(args)
        return _against_pybullet(args) if args.traces is None else _against_traces(args)
    except (ValueError, OSError) as error:
        print(f'fidelity: {" ".join(str(error).split())}', file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print('fidelity: interrupted; nothing was kept', file=sys.stderr)
        return 130


def _refuse_contradictions(args: argparse.Namespace) -> None:
    if (args.traces is None) == (args.body is None):
        raise ValueError('expected either --traces FILE.npz or --body BODY, '
                         f'got {"neither" if args.body is None else "both"}')
    given = [f'--{name}' for name in WITH_BODY if getattr(args, name) is not None]
    if args.traces is not None and given:
        raise ValueError(f'{given[0]} needs --body: recordings say themselves what was evaluated')
    if args.body is not None and args.engine not in (None, 'batched'):
        raise ValueError('with --body PyBullet is the reference, and MuJoCo is printed beside it: '
                         f'expected --engine batched or no --engine, got --engine {args.engine}')


def _against_pybullet(args: argparse.Namespace) -> int:
    body, world = against_pybullet.choose(args.body, args.world)
    count, seed = COUNT if args.count is None else args.count, args.seed or 0
    for name, value, smallest in (('count', count, 1), ('seed', seed, 0)):
        if value < smallest:
            raise ValueError(f'--{name}: expected an integer >= {smallest}, got {value}')
    vocabulary = Vocabulary.load()
    controllers = against_pybullet.load_controllers(body, args.controllers, vocabulary)
    samples = [against_pybullet.random_sample(body, vocabulary, count, seed)]
    if controllers:
        samples.append(against_pybullet.evolved_sample(body, controllers, vocabulary, count, seed))
    else:
        print(f'fidelity: no controller of {body.name} ships: only random ones are compared; '
              'give evolved ones with --controllers', file=sys.stderr)
    if not args.json:
        print(f'{body.name} in {world.name}, {count} evaluations a row; reference: PyBullet at '
              f'{1e3 * world.physics_step_s:g} ms')
        print(HEAD)
    result = {}
    for sample in samples:
        # The batched engine first: it refuses what it does not model, and PyBullet takes minutes.
        engines = [(how, *against_pybullet.in_batched(body, world, sample, how,
                                                      args.processes or 1))
                   for how in against_pybullet.settings(body)[:1 if args.json else None]]
        reference = against_pybullet.in_pybullet(body, world, sample, args.processes or 1)
        for how, moved, touch in engines:
            result[sample.kind] = {
                **agreement(reference.moved_m, reference.nudged_m, moved, touch),
                'reference_touch': reference.touch}
            if not args.json:
                print(_line(how.name, sample.kind, result[sample.kind]), flush=True)
        if not args.json:
            moved, touch = against_pybullet.in_mujoco(body, world, sample, args.processes or 1)
            print(_line('MuJoCo', sample.kind, agreement(
                reference.moved_m, reference.nudged_m, moved, touch)), flush=True)
    if args.json:
        print(json.dumps({'world': world.name, 'count': count, 'bodies': {body.name: result}}))
    return 0


def _against_traces(args: argparse.Namespace) -> int:
    recorded = load(args.traces)
    if args.json:
        engine = args.engine or ENGINES[0]
        print(json.dumps({'bodies': {
            traces.name: compare(traces, *replay(engine, traces)) for traces in recorded}}))
        return 0
    print(HEAD)
    for engine in (args.engine,) if args.engine else ENGINES:
        for traces in recorded:
            if engine != 'batched' and args.engine is None:
                traces = sample(traces, BESIDE)
            measured = compare(traces, *replay(engine, traces))
            print(_line(engine, traces.name, measured) + _verdict(engine, measured), flush=True)
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
    if engine != 'batched':
        return _replay_stepwise(engine, traces, world.steps)
    from w2b_sim.engines.batched import BatchedEngine

    outcome = BatchedEngine(traces.body, world, 'double').evaluate_primed(
        traces.network, traces.hidden[..., 1], [Start()])
    touch = outcome.touch_fraction
    return (outcome.final_position_m[:, :, 0, :2],
            float(np.nanmean(touch)) if touch.shape[-1] else None)


def _replay_stepwise(engine: str, traces: Traces, steps: int) -> tuple[Array, float | None]:
    from w2b_sim.engines import registry

    body, network = traces.body, traces.network
    controllers, words = traces.hidden.shape[:2]
    moved = np.zeros((controllers, words, 2))
    touches: list[bool] = []
    simulation = registry.make_simulation(engine, body, PAPER)
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
    """Return an engine's agreement with a recording: see `agreement`."""
    return agreement(traces.position_m[:, :, -1, :2] - traces.position_m[:, :, 0, :2],
                     traces.nudged_m[:, :, -1, :2] - traces.nudged_m[:, :, 0, :2], moved, touch)


def agreement(recorded: Array, nudged: Array, moved: Array, touch: float | None
              ) -> dict[str, Any]:
    """
    Return how closely an engine agrees with a reference, by the names of the JSON output.

    `recorded`, `nudged` and `moved` (..., 2) are the x-y displacements in the reference, in the
    reference from the nudged start, and in the engine. A failed evaluation counts as an infinite
    error; what is not finite, as a correlation over fewer than two evaluations, is None.
    """
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
    return (f'{name:24}{engine:12}{median:>24}{text(measured["p90_error_m"], 4, " m"):>18}'
            f'{rank:>20}{text(measured["touch"], 3):>8}')


def _verdict(engine: str, measured: dict[str, Any]) -> str:
    if engine != 'batched':
        return ''
    return '  within bounds' if within_bounds(measured) else '  OUT OF BOUNDS'
