"""What makes each engine's evaluator, as `registry` names it."""

from __future__ import annotations

from collections.abc import Callable

from w2b_core.bodies.model import Body
from w2b_sim.engines.interface import Evaluator
from w2b_sim.worlds import World

Say = Callable[[str], None]


def batched(body: Body, world: World, *, precision: str, threads: int, say: Say | None,
            complete: bool) -> Evaluator:
    """Return the batched engine."""
    from w2b_sim.engines.batched import BatchedEngine

    evaluator: Evaluator = BatchedEngine(body, world, precision=precision, threads=threads, say=say,
                                         complete=complete)
    return evaluator


def pybullet(body: Body, world: World, *, precision: str, threads: int, say: Say | None,
             complete: bool) -> Evaluator:
    """Return PyBullet, in `threads` processes."""
    from w2b_sim.engines.stepwise_evaluator import StepwiseEvaluator

    return StepwiseEvaluator('pybullet', body, world, threads)


def mujoco(body: Body, world: World, *, precision: str, threads: int, say: Say | None,
           complete: bool) -> Evaluator:
    """Return MuJoCo, in `threads` processes."""
    from w2b_sim.engines.stepwise_evaluator import StepwiseEvaluator

    return StepwiseEvaluator('mujoco', body, world, threads)
