"""Evaluation in PyBullet, the reference engine."""

from __future__ import annotations

from w2b_core.bodies.model import Body
from w2b_sim.engines.stepwise_evaluator import StepwiseEvaluator
from w2b_sim.worlds import World


class PyBulletEvaluator(StepwiseEvaluator):
    """`StepwiseEvaluator` in PyBullet."""

    def __init__(self, body: Body, world: World, processes: int = 1) -> None:
        super().__init__('pybullet', body, world, processes)
