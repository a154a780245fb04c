"""The engines that training can evaluate in, by name; imported only when asked for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from w2b_core import bodies
from w2b_core.bodies.model import Body
from w2b_core.network import Network
from w2b_sim.engines.interface import Evaluation, Evaluator, Start
from w2b_sim.worlds import World

ENGINES = ('batched', 'pybullet')
PRECISIONS = ('float32', 'float64')


def make_evaluator(name: str, body: Body, world: World, *, precision: str = 'float32',
                   threads: int = 1, say: Callable[[str], None] | None = None) -> Evaluator:
    """
    Return an evaluator of `body` in `world`.

    Parameters
    ----------
    name
        `batched`: the servo-kinematic engine. `pybullet`: the reference, hundreds of times slower.
    body, world
        What moves, and where.
    precision
        `float32` or `float64`; PyBullet always computes in double precision.
    threads
        Threads of the batched engine, processes of PyBullet. The results do not depend on it.
    say
        Is told, once, that the batched engine is being compiled; None for its logger.

    Raises
    ------
    ValueError
        If there is no such engine or precision, or if the engine does not model the body.

    """
    if name not in ENGINES:
        raise ValueError(f'engine: expected one of {", ".join(ENGINES)}, got {name!r}')
    if precision not in PRECISIONS:
        raise ValueError(f'precision: expected one of {", ".join(PRECISIONS)}, got {precision!r}')
    if threads < 1:
        raise ValueError(f'threads: expected at least 1, got {threads}')
    if name == 'pybullet':
        from w2b_sim.engines.pybullet_evaluator import PyBulletEvaluator

        return PyBulletEvaluator(body, world, processes=threads)
    from w2b_sim.engines.batched import BatchedEngine

    batched: Evaluator = BatchedEngine(body, world, precision=precision, threads=threads,
                                       say=say)
    return batched


def refuse_unsupported(engine: str, body: str) -> None:
    """Raise ValueError, with the file that registered `body`, if `engine` does not model it."""
    if engine != 'batched':
        return
    from w2b_sim.engines.batched.supported import refuse_what_is_not_modelled

    try:
        refuse_what_is_not_modelled(bodies.get(body))
    except ValueError as error:
        origin = bodies.BODIES.origin(body)
        raise ValueError(f'{origin}: {error}' if origin else str(error)) from None


class TimedEvaluator:
    """An evaluator that keeps count of what it did and how long that took (wall time)."""

    def __init__(self, evaluator: Evaluator) -> None:
        self._evaluator = evaluator
        self.seconds = 0.0
        self.evaluations = 0

    def evaluate(self, network: Network, signals: NDArray[np.float64],
                 starts: Sequence[Start]) -> Evaluation:
        """Return what the evaluator returns; see `Evaluator`."""
        began = perf_counter()
        outcome = self._evaluator.evaluate(network, signals, starts)
        self.seconds += perf_counter() - began
        self.evaluations += outcome.path_length_m.size
        return outcome

    def prepare(self, network: Network, signals: NDArray[np.float64],
                starts: Sequence[Start]) -> None:
        """Evaluate without counting it: what compiles at its first call, does so here."""
        self._evaluator.evaluate(network, signals, starts)

    def close(self) -> None:
        """End the evaluator's processes, if it has any."""
        close = getattr(self._evaluator, 'close', None)
        if close is not None:
            close()
