"""
The engines by name: what makes a step-wise simulation of one robot, and what evaluates many.

An engine's modules are imported when it is used, so that the libraries of the others need not be
installed. `ENGINES.add` registers one more, from a plugin (see `w2b_core.registry`).
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from w2b_core.bodies.model import Body
from w2b_core.registry import Registry
from w2b_sim.engines.interface import Evaluator, Simulation, Start
from w2b_sim.worlds import World

PRECISIONS = ('float32', 'float64')


class EngineError(ValueError):
    """No such engine, or it cannot be used here; one line says why and what to do."""


@dataclass(frozen=True)
class Engine:
    """
    One engine.

    Attributes
    ----------
    name, about
        What it is called, and a line on what it is.
    simulation
        `module:callable` that makes a `Simulation` of (body, world, start); empty if there is none.
    evaluator
        `module:callable` that makes an `Evaluator` of (body, world) and the keywords of
        `make_evaluator`.
    library, requirement
        What it imports that may be missing, and what to install then.

    """

    name: str
    about: str
    simulation: str
    evaluator: str
    library: str
    requirement: str


_HERE = 'w2b_sim.engines'
ENGINES: Registry[Engine] = Registry('engine')
for _engine in (
        Engine('batched', 'many robots at once in compiled code: what evolution runs in', '',
               f'{_HERE}.evaluators:batched', 'numba', 'numba==0.68.1'),
        Engine('pybullet', 'PyBullet, the default of the sim node and the first judge',
               f'{_HERE}.pybullet_engine:PyBulletSimulation', f'{_HERE}.evaluators:pybullet',
               'pybullet', 'pybullet==3.2.7'),
        Engine('mujoco', 'MuJoCo, the second judge', f'{_HERE}.mujoco_engine:MuJoCoSimulation',
               f'{_HERE}.evaluators:mujoco', 'mujoco', 'mujoco==3.17.0')):
    ENGINES.add(_engine.name, _engine)
DEFAULT = 'pybullet'


def names() -> tuple[str, ...]:
    """Return the names of all engines."""
    return ENGINES.names()


def stepwise_names() -> tuple[str, ...]:
    """Return the names of the engines that move one robot step by step."""
    return tuple(name for name in ENGINES if ENGINES.get(name).simulation)


def make_simulation(name: str, body: Body, world: World, start: Start | None = None
                    ) -> Simulation:
    """
    Return a simulation of one robot.

    Raises
    ------
    EngineError
        If there is no such engine, it has no step-wise simulation, or its library is missing.
    ValueError
        If it does not model the body.

    """
    if name not in stepwise_names():
        raise EngineError(f'engine: expected one of {", ".join(stepwise_names())}, got {name!r}')
    engine = ENGINES.get(name)
    simulation: Simulation = _load(engine, engine.simulation)(body, world, start)
    return simulation


def make_evaluator(name: str, body: Body, world: World, *, precision: str = 'float32',
                   threads: int = 1, say: Callable[[str], None] | None = None,
                   complete: bool = False) -> Evaluator:
    """
    Return an evaluator of `body` in `world`.

    Parameters
    ----------
    name
        `batched`: compiled, hundreds of times as fast as the others. `pybullet`, `mujoco`.
    body, world
        What moves, and where.
    precision
        `float32` or `float64`; PyBullet and MuJoCo always compute in double precision.
    threads
        Threads of the batched engine, processes of the others. The results do not depend on it.
    say
        Called with one line when the batched engine is compiled; None for its logger.
    complete
        Whether outcomes have every figure (`w2b_core.outcome.FIGURES`), not only the plain ones.
        Step-wise engines always give them; the batched engine takes longer.

    Raises
    ------
    EngineError
        If there is no such engine, or its library is missing.
    ValueError
        If there is no such precision, or the engine does not model the body.

    """
    if name not in ENGINES:
        raise EngineError(f'engine: expected one of {", ".join(ENGINES)}, got {name!r}')
    engine = ENGINES.get(name)
    if precision not in PRECISIONS:
        raise ValueError(f'precision: expected one of {", ".join(PRECISIONS)}, got {precision!r}')
    if threads < 1:
        raise ValueError(f'threads: expected at least 1, got {threads}')
    evaluator: Evaluator = _load(engine, engine.evaluator)(
        body, world, precision=precision, threads=threads, say=say, complete=complete)
    return evaluator


def _load(engine: Engine, path: str) -> Callable[..., Any]:
    # Looked for, not imported: importing PyBullet prints a line, which `quiet_pybullet` swallows.
    if engine.library and importlib.util.find_spec(engine.library) is None:
        raise EngineError(f'engine {engine.name}: the module {engine.library} is missing; install '
                          f'it with `pip install {engine.requirement}`')
    module, _colon, attribute = path.partition(':')
    found: Callable[..., Any] = getattr(importlib.import_module(module), attribute)
    return found
