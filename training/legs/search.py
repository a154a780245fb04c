"""
One seed's search: CMA-ES through the stages of a recipe, safe to kill at any moment.

What is kept is what the candidates earned. The optimiser is deterministic, so a resumed search
tells it the same again, without walking, and is where it was: the same seed gives the same
champion, stopped or not.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from training.evolution.checkpoint import CheckpointError, reason, write_atomically
from training.evolution.cma_es import strategy
from training.legs.first import first_genomes
from training.legs.parts import Stage
from training.legs.recipe import Recipe
from training.legs.task import Task, Trial

Array = NDArray[np.float64]

HISTORY = 'history.npz'
#: Streams of random numbers of a seed.
FIRST, OPTIMISER, TRIALS, EXAMINATION = range(4)
SAVE_EVERY_S = 15.0
#: Step sizes beyond this only scatter.
LARGEST_SIGMA = 1.0


@dataclass(frozen=True)
class Step:
    """How far a seed is: reported every few seconds."""

    seed: int
    stage: str
    generation: int
    generations: int
    best: float
    scores: dict[str, float]
    sigma: float
    evaluations: int
    seconds: float


class Search:
    """
    The search of one seed.

    Parameters
    ----------
    recipe, seed
        What to do, and its random numbers.
    directory
        Where what was earned is kept; None for nowhere.
    task
        Evaluations; made if it is not given.

    """

    def __init__(self, recipe: Recipe, seed: int, directory: Path | None,
                 task: Task | None = None) -> None:
        self.recipe, self.seed, self.directory = recipe, seed, directory
        self.task = task or Task(recipe)
        self.generation = 0
        self._earned: list[Array] = []
        self._began_at: Array | None = None
        self._restore()
        self._strategy: Any = None
        self._saved = perf_counter()

    def _rng(self, stream: int, number: int = 0) -> np.random.Generator:
        return np.random.default_rng([self.recipe.seed, self.seed, stream, number])

    def run(self, stage_number: int, report: Callable[[Step], None] | None = None,
            stop: Callable[[], bool] | None = None, report_every_s: float = 10.0) -> bool:
        """
        Run the generations that are left up to the end of a stage.

        Returns whether the end was reached; False if `stop` said so before.
        """
        began = told = perf_counter()
        end = sum(stage.generations for stage in self.recipe.stages[:stage_number + 1])
        self._begin()
        while self.generation < end:
            if stop is not None and stop():
                self.save()
                return False
            stage, first = self._stage()
            if stage.sigma is not None and self.generation == first:
                self._strategy.sigma = stage.sigma
            genomes = np.array(self._strategy.ask())
            trial = self.task.trial(stage, self._rng(TRIALS, self.generation))
            known = self.generation < len(self._earned)
            if known:
                fitness = self._earned[self.generation]
            else:
                fitness = self.task.run(genomes, trial, stage.physics_steps).fitness
                self._earned.append(fitness)
            self._tell(genomes, fitness)
            self.generation += 1
            now = perf_counter()
            if not known and now - self._saved > SAVE_EVERY_S:
                self.save()
            if report is not None and not known and (now - told > report_every_s
                                                     or self.generation == end):
                told = now
                report(self._step(stage, trial, end, now - began))
        self.save()
        return True

    def _tell(self, genomes: Array, fitness: Array) -> None:
        self._strategy.tell(list(genomes), (-fitness).tolist())
        self._strategy.sigma = min(self._strategy.sigma, LARGEST_SIGMA)

    def _begin(self) -> None:
        """Start the optimiser, from the best of the first genomes."""
        if self._strategy is not None:
            return
        if self._began_at is None:
            self._began_at = self._best_first()
            self.save()
        rng = self._rng(OPTIMISER)
        self._strategy = strategy(self._began_at, self.recipe.sigma, self.recipe.population, rng)

    def _best_first(self) -> Array:
        recipe, stage = self.recipe, self.recipe.stages[0]
        rng = self._rng(FIRST)
        genomes = first_genomes(recipe, self.task.sharing, rng, self.task.world.control_period_s)
        trial = self.task.trial(stage.model_copy(update={
            'phases': (recipe.first.seconds,), 'sequences': None}), rng)
        earned = self.task.run(genomes, trial, stage.physics_steps).fitness
        best: Array = genomes[np.argmax(earned)]
        return best

    def _stage(self) -> tuple[Stage, int]:
        """Return the stage of the present generation and its first generation."""
        first = 0
        for stage in self.recipe.stages:
            if self.generation < first + stage.generations:
                return stage, first
            first += stage.generations
        return self.recipe.stages[-1], first

    @property
    def genome(self) -> Array:
        """The optimiser's mean (G,): what the search believes in."""
        self._begin()
        mean: Array = np.array(self._strategy.mean)
        return mean

    def _step(self, stage: Stage, trial: Trial, end: int, seconds: float) -> Step:
        earned = self.task.run(self.genome[None], trial, stage.physics_steps)
        return Step(self.seed, stage.name, self.generation, end, float(earned.fitness[0]),
                    {name: float(score[0]) for name, score in earned.scores.items()},
                    float(self._strategy.sigma), self.task.evaluations, seconds)

    def save(self) -> None:
        """Keep what was earned."""
        self._saved = perf_counter()
        if self.directory is None:
            return
        self.directory.mkdir(parents=True, exist_ok=True)
        buffer = BytesIO()
        assert self._began_at is not None
        np.savez(buffer, began_at=self._began_at, earned=np.array(self._earned),
                 recipe=np.array(json.dumps({'sha256': self.recipe.sha256(), 'seed': self.seed})))
        write_atomically(self.directory / HISTORY, buffer.getvalue())

    def _restore(self) -> None:
        path = None if self.directory is None else self.directory / HISTORY
        if path is None or not path.exists():
            return
        try:
            with np.load(path, allow_pickle=False) as file:
                self._began_at = file['began_at']
                self._earned = list(file['earned'])
                told = json.loads(str(file['recipe']))
            if told != {'sha256': self.recipe.sha256(), 'seed': self.seed}:
                raise ValueError('it belongs to another recipe or seed')
            if self._began_at.shape != (self.task.sharing.size,):
                raise ValueError(f'expected {self.task.sharing.size} numbers')
        except Exception as error:
            raise CheckpointError(f'{path}: cannot be used ({reason(error)}); delete it to start '
                                  'this seed again') from None
