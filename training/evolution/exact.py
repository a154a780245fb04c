"""The task of the paper: controllers are judged under the words as they are, from fixed starts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from training.evolution.engines import TimedEvaluator
from training.evolution.loop import StatelessTask
from training.evolution.objectives import aggregate, scores
from training.evolution.operators import Array, Layout, random_genomes
from training.evolution.optimisers import Optimiser
from w2b_sim.engines.interface import Start


class Exact(StatelessTask):
    """
    Exact evaluation.

    Parameters
    ----------
    layout
        Of the genomes.
    engine
        What moves the robots.
    heard: shape (W, T)
        The words' vectors.
    behaviours
        What each word asks for (W,).
    starts
        Over which a score is averaged.
    objective, kind
        Names of `objectives.OBJECTIVES` and `objectives.AGGREGATES`.

    """

    def __init__(self, layout: Layout, engine: TimedEvaluator, heard: Array,
                 behaviours: Sequence[str], starts: Sequence[Start], objective: str,
                 kind: str = 'sum') -> None:
        self.layout, self.engine, self.heard = layout, engine, heard
        self.behaviours, self.starts = behaviours, starts
        self.objective, self.kind = objective, kind

    @property
    def evaluations(self) -> int:
        """Simulations in this process."""
        return self.engine.evaluations

    @property
    def seconds(self) -> float:
        """Wall time that they took."""
        return self.engine.seconds

    def prepare(self) -> None:
        """Let the engine compile or load its code now: that is not in the run's seconds."""
        genomes = random_genomes(np.random.default_rng(0), 1, self.layout)
        self.engine.prepare(self.layout.network(genomes), self.heard[:1], self.starts[:1])

    def judge(self, genomes: Array, _optimiser: Optimiser) -> Array:
        """Return the fitness (N,) of genomes (N, G): one batch of evaluations."""
        outcome = self.engine.evaluate(self.layout.network(genomes), self.heard, self.starts)
        return aggregate(scores(outcome, self.behaviours, self.objective), self.behaviours,
                         self.kind)
