"""Evaluation in a step-wise engine: one robot after the other, in one process or several."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import fields
from itertools import product
from multiprocessing import connection, get_context, parent_process
from threading import Thread
from typing import Self

import numpy as np
from numpy.typing import NDArray

from w2b_core.bodies.model import Body
from w2b_core.network import Network
from w2b_sim.engines import registry
from w2b_sim.engines.interface import Evaluation, Simulation, Start
from w2b_sim.recording import outcome
from w2b_sim.rollout import rollout
from w2b_sim.worlds import World

Array = NDArray[np.float64]
Task = tuple[Array, Array, Array, Array, Start]

_worker: tuple[Body, World, Simulation] | None = None


class StepwiseEvaluator:
    """
    Evaluates controllers in one engine, in the order of the batch, one world a process.

    Use as a context manager, or call `close`. A controller with weights that are not finite, and
    one under which the simulation fails, has NaN for its outcome.

    Parameters
    ----------
    engine
        One of `registry.stepwise_names`.
    body, world
        What moves, and where.
    processes
        How many; the results do not depend on it.

    Raises
    ------
    ValueError
        See `registry.make_simulation`.

    """

    def __init__(self, engine: str, body: Body, world: World, processes: int = 1) -> None:
        self.body = body
        self.world = world
        # Made here also where the processes make their own: what is wrong is told at once.
        self._simulation = registry.make_simulation(engine, body, world)
        self._pool = None if processes <= 1 else ProcessPoolExecutor(
            processes, get_context('spawn'), _start_worker,
            (engine, body, world))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_exception: object) -> None:
        self.close()

    def close(self) -> None:
        """End the processes."""
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)
        self._simulation.close()

    def evaluate(self, network: Network, signals: Array, starts: Sequence[Start]) -> Evaluation:
        """Return the outcome of `network` (C controllers) under `signals` (W, T) or (C, W, T)."""
        hidden, motor = network.hidden_weights, network.motor_weights
        if hidden.ndim != 3:
            raise ValueError(f'network: expected a batch (C, H, K) of controllers, '
                             f'got hidden weights of shape {hidden.shape}')
        signals = np.asarray(signals, dtype=np.float64)
        signals = np.broadcast_to(signals, (len(hidden), *signals.shape[-2:]))
        shape = (len(hidden), signals.shape[1], len(starts))
        tasks = [(hidden[c], motor[c], network.motor_time_constants, signals[c, w], starts[k])
                 for c, w, k in product(*map(range, shape))]
        outcomes = list(self._run(tasks))

        def gather(name: str) -> Array:
            values = np.array([getattr(outcome, name) for outcome in outcomes])
            return values.reshape(*shape, *values.shape[1:])
        return Evaluation(**{field.name: gather(field.name) for field in fields(Evaluation)})

    def _run(self, tasks: list[Task]) -> Iterator[Evaluation]:
        if self._pool is not None:
            return self._pool.map(_evaluate_in_worker, tasks, chunksize=4)
        return (_evaluate(self.body, self.world, self._simulation, task) for task in tasks)


def _start_worker(engine: str, body: Body, world: World) -> None:
    global _worker
    Thread(target=_die_with_parent, daemon=True).start()
    _worker = body, world, registry.make_simulation(engine, body, world)


def _die_with_parent() -> None:
    """End this process when the one that started it is gone, also after a SIGKILL."""
    parent = parent_process()
    assert parent is not None
    connection.wait([parent.sentinel])
    os._exit(1)


def _evaluate_in_worker(task: Task) -> Evaluation:
    assert _worker is not None
    return _evaluate(*_worker, task)


def _evaluate(body: Body, world: World, simulation: Simulation, task: Task) -> Evaluation:
    hidden, motor, time_constants, signal, start = task
    if not all(np.isfinite(values).all() for values in (hidden, motor, signal)):
        touches = sum(sensor.startswith('touch:') for sensor in body.sensors)
        widths = {'final_position_m': 3, 'touch_fraction': touches, 'halfway_position_m': 2,
                  'reversals': len(body.joints)}
        return Evaluation(**{field.name: np.full(
            (widths[field.name],) if field.name in widths else (), np.nan)
            for field in fields(Evaluation)})
    simulation.reset(start)
    return outcome(rollout(simulation, body, Network(hidden, motor, time_constants), signal,
                           world.steps, period_s=world.control_period_s))
