"""The engines that training can evaluate in, by name, and how long they take."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from w2b_core import bodies
from w2b_core.behaviours import BEHAVIOURS
from w2b_core.network import Network
from w2b_sim.engines import registry
from w2b_sim.engines.interface import Evaluation, Evaluator, Start
from w2b_sim.engines.registry import PRECISIONS, make_evaluator

__all__ = ['ENGINES', 'PRECISIONS', 'TimedEvaluator', 'make_evaluator', 'needs_complete']

ENGINES = registry.names()


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


def needs_complete(behaviours: Iterable[str]) -> bool:
    """Return whether a behaviour reads more figures than plain outcomes have."""
    return any(BEHAVIOURS.get(name).figures for name in behaviours)


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
