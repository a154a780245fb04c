"""
Evaluations a second of both engines, per body: `python -m training bench` (`make bench`).

Both engines are timed in turn within one process, in rounds, so that a busy machine slows both
alike; the best round counts. Rates per core are by the thread's processor time, those of one and
two threads by wall time. `--prototype LIBRARY.so` times the C++ prototype of the quadruped in the
same rounds. The shares say where the wall time of a short evolutionary run goes: into the compiled
call (and of that into priming), and into selection, mutation and the rest. Scaling and shares mean
little on a machine that does something else meanwhile. `--profile` says where the time of a single
evaluation goes (module `engine_profile`).
"""

from __future__ import annotations

import argparse
import ctypes
import json
import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from time import perf_counter, thread_time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from training.measure import bench_leaky, engine_profile
from w2b_core import bodies
from w2b_core.bodies.model import Body
from w2b_core.network import Network
from w2b_sim.engines.batched import BatchedEngine
from w2b_sim.engines.interface import Start
from w2b_sim.worlds import WORLDS

Array = NDArray[np.float64]
CONTROLLERS, WORDS = 96, 4
#: Controllers of the batch that two threads share: what the robust mode evaluates at once, several
#: times over, and those of a generation of a plain run, which has few blocks of lanes to share.
LARGE_BATCH, GENERATION = 16 * CONTROLLERS, 51
ROUNDS = 5
PYBULLET_EVALUATIONS = 6
EVOLUTION_GENERATIONS = 150


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument('--json', action='store_true', help='print JSON')
    parser.add_argument('--body', action='append', choices=bodies.names(), default=None,
                        help='only this one; may be given several times')
    parser.add_argument('--prototype', type=Path, default=None, metavar='LIBRARY.so',
                        help='the C++ prototype, built with single precision, beside the engines')
    parser.add_argument('--profile', action='store_true',
                        help='also where the time of one evaluation goes')


def main(args: argparse.Namespace) -> int:
    """Run the command; return the exit code."""
    if args.prototype is not None:
        try:
            _prototype(args.prototype)
        except (OSError, AttributeError) as error:
            print(f'bench: --prototype {args.prototype}: expected a built prototype, got none '
                  f'({error})', file=sys.stderr)
            return 2
    names = args.body or list(bodies.names())
    measured = {}
    for name in names:
        measured[name] = measure(bodies.get(name))
        if not args.json:
            print(_line(name, measured[name]), flush=True)
    usual = 'quadruped' if 'quadruped' in names else names[0]
    scaling = two_core_scaling(bodies.get(usual), LARGE_BATCH)
    small = two_core_scaling(bodies.get(usual), GENERATION)
    shares = evolve_shares(bodies.get(usual))
    result: dict[str, Any] = {'bodies': measured, 'two_core_scaling': scaling,
                              'two_core_scaling_generation': small,
                              'evolve_shares': shares}
    if args.prototype is not None:
        result['prototype'] = against_prototype(args.prototype)
    if not args.body:
        result['leaky'] = _race(bench_leaky.tasks(bodies.get(bench_leaky.BODY)), 3)
    if args.profile:
        result['profile'] = engine_profile.profile(bodies.get(usual),
                                                   *_workload(bodies.get(usual)))
    if args.json:
        print(json.dumps(result))
        return 0
    print(f'\n{usual}, single precision, two threads on two cores: {scaling:.2f} times one with '
          f'{LARGE_BATCH * WORDS:,} evaluations in a batch, {small:.2f} times with '
          f'{GENERATION * WORDS}')
    print(f'wall time of {EVOLUTION_GENERATIONS} generations of evolution: '
          + ', '.join(f'{name} {share:.1%}' for name, share in shares.items()))
    if 'leaky' in result:
        print(bench_leaky.line(result['leaky']))
    if 'prototype' in result:
        print('C++ prototype: {cpp:,.0f} a second; batched, single: {batched_f32:,.0f}, '
              '{ratio:.2f} times that'.format(**result['prototype']))
    if 'profile' in result:
        print(engine_profile.lines(result['profile']))
    return 0


def measure(body: Body) -> dict[str, float]:
    """Return evaluations a second and core of each engine, and the ratio, of one body."""
    world = WORLDS[body.world]
    network, words = _workload(body)
    few = Network(network.hidden_weights[:1], network.motor_weights[:1],
                  network.motor_time_constants)
    count = PYBULLET_EVALUATIONS if world.physics_steps == 1 else 1
    engines = {'batched_f32': BatchedEngine(body, world, 'single'),
               'batched_f64': BatchedEngine(body, world, 'double')}
    tasks: dict[str, tuple[int, Callable[[], object]]] = {
        name: (CONTROLLERS * WORDS, lambda engine=engine: engine.evaluate(  # type: ignore[misc]
            network, words, [Start()])) for name, engine in engines.items()}
    from w2b_sim.engines.pybullet_evaluator import PyBulletEvaluator

    for _count, task in tasks.values():
        task()
    with PyBulletEvaluator(body, world) as pybullet:
        tasks['pybullet'] = (count, lambda: pybullet.evaluate(few, words[:1], [Start()] * count))
        rates = _race(tasks, ROUNDS if world.physics_steps == 1 else 2)
    return {**rates, 'ratio_f32': rates['batched_f32'] / rates['pybullet']}


def two_core_scaling(body: Body, controllers: int) -> float:
    """Return how many times as fast two threads are as one: best wall times of several rounds."""
    world = WORLDS[body.world]
    network, words = _workload(body, controllers)
    engines = [BatchedEngine(body, world, 'single', threads) for threads in (1, 2)]
    times: list[list[float]] = [[], []]
    for _ in range(2 * ROUNDS):
        for engine, taken in zip(engines, times, strict=True):
            began = perf_counter()
            engine.evaluate(network, words, [Start()])
            taken.append(perf_counter() - began)
    best = [min(taken) for taken in times]
    return best[0] / best[1]


def evolve_shares(body: Body) -> dict[str, float]:
    """
    Return the shares of an evolutionary run's wall time.

    `engine` is all of the compiled call, of which `priming` hears the words and `physics` moves the
    bodies; `evolution` is selection, mutation and scoring.
    """
    from training.evolution.run import RunConfig, run

    words = tuple((f'word{number}', behaviour) for number, behaviour in enumerate(
        ('forward', 'backward', 'stop', 'stop')))
    rng = np.random.default_rng(3)
    vectors = {word: rng.normal(scale=0.17, size=300) for word, _behaviour in words}
    config = RunConfig(body.name, 0, words, generations=EVOLUTION_GENERATIONS)
    with tempfile.TemporaryDirectory() as folder:
        seconds = run(config, Path(folder) / 'run', vectors=vectors).seconds
    engine = seconds['engine'] / seconds['total']
    priming = engine * _priming_share(body)
    return {'engine': engine, 'physics': engine - priming, 'priming': priming,
            'evolution': seconds['evolution'] / seconds['total'],
            'checkpoint': seconds['checkpoint'] / seconds['total']}


def _priming_share(body: Body) -> float:
    """Return the share of an evaluation that priming takes: that of one without any steps."""
    world = WORLDS[body.world]
    network, words = _workload(body)
    whole, primed_only = (BatchedEngine(body, replace(world, steps=steps), 'single')
                          for steps in (world.steps, 1))
    times = _race({name: (1, lambda engine=engine: engine.evaluate(  # type: ignore[misc]
        network, words, [Start()])) for name, engine in (('whole', whole), ('no', primed_only))},
        ROUNDS)
    return times['whole'] / times['no']


def against_prototype(library: Path) -> dict[str, float]:
    """Race the engine against the C++ prototype on the quadruped, both from words already heard."""
    evaluate = _prototype(library)
    body = bodies.get('quadruped')
    network, _words = _workload(body)
    count = CONTROLLERS * WORDS
    hidden, motor = (np.ascontiguousarray(np.repeat(weights, WORDS, axis=0)) for weights in
                     (network.hidden_weights, network.motor_weights))
    start, out = np.zeros((count, body.hidden_neurons)), np.zeros((count, 9))

    def prototype() -> None:
        pointers = [array.ctypes.data_as(ctypes.c_void_p) for array in (hidden, motor, start)]
        evaluate(ctypes.c_long(count), *pointers, ctypes.c_int(500), ctypes.c_double(0.05),
                 out.ctypes.data_as(ctypes.c_void_p), None, None, None)
    engine = BatchedEngine(body, WORLDS[body.world], 'single')
    primed = np.zeros((CONTROLLERS, WORDS, body.hidden_neurons))
    rates = _race({'cpp': (count, prototype),
                   'batched_f32': (count, lambda: engine.evaluate_primed(
                       network, primed, [Start()]))}, 2 * ROUNDS)
    return {**rates, 'ratio': rates['batched_f32'] / rates['cpp']}


def _prototype(library: Path) -> Callable[..., object]:
    """Return the prototype's evaluation (OSError or AttributeError if the file is another)."""
    evaluate: Callable[..., object] = ctypes.CDLL(str(library.resolve())).kin_batch
    return evaluate


def _workload(body: Body, count: int | None = None) -> tuple[Network, Array]:
    """Return `count` random controllers (by default `CONTROLLERS`), and words."""
    count = CONTROLLERS if count is None else count
    rng = np.random.default_rng(1)
    hidden, sensors, motors = body.hidden_neurons, len(body.sensors), len(body.joints)
    network = Network(rng.normal(size=(count, hidden, hidden + 1 + sensors)),
                      rng.normal(size=(count, motors, hidden)),
                      np.array([joint.time_constant for joint in body.joints]))
    return network, rng.normal(scale=0.17, size=(WORDS, 300))


def _race(tasks: dict[str, tuple[int, Callable[[], object]]], rounds: int) -> dict[str, float]:
    """Run the tasks in turn; return how often a second of processor time each does its count."""
    best = dict.fromkeys(tasks, 0.0)
    for _ in range(rounds):
        for name, (count, task) in tasks.items():
            began = thread_time()
            task()
            best[name] = max(best[name], count / (thread_time() - began))
    return best


def _line(name: str, rates: dict[str, float]) -> str:
    return (f'{name:24} batched {rates["batched_f32"]:9,.0f} (single) {rates["batched_f64"]:9,.0f} '
            f'(double)   PyBullet {rates["pybullet"]:7.2f}   ratio {rates["ratio_f32"]:7,.0f}')
