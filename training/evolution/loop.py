"""
The loop of evolution: ask an optimiser for genomes, let a task judge them, tell what they earned.

A task is what genomes are judged by: `exact.Exact`, or `training.robust` in drawn worlds. The loop
keeps a history, clocks and checkpoints: it is safe to kill at any moment, and what it was resumed
from makes no difference.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from training.evolution import checkpoint, rundir
from training.evolution.operators import Array
from training.evolution.optimisers import Optimiser
from training.evolution.rundir import RunDirectory

HISTORY = ('best_fitness', 'median_fitness', 'best_age', 'survivors', 'evaluations')
CLOCKS = ('total', 'engine', 'evolution', 'checkpoint')


@dataclass(frozen=True)
class Progress:
    """How far a run is; `seconds` and `evaluations` count from where this process took it up."""

    generation: int
    generations: int
    best_fitness: float
    evaluations: int
    seconds: float


class Task(Protocol):
    """What genomes are judged by; `evaluations` and `seconds` count what it did, and how long."""

    @property
    def evaluations(self) -> int:
        """Simulations in this process."""

    @property
    def seconds(self) -> float:
        """Wall time that they took."""

    def begin(self, optimiser: Optimiser) -> None:
        """Prepare a generation: situations may change, and the population's fitness with them."""

    def judge(self, genomes: Array, optimiser: Optimiser) -> Array:
        """Return the fitness (N,) of genomes (N, G) that `optimiser` asked for."""

    def end(self, optimiser: Optimiser) -> None:
        """Take note of who is left in the population."""

    def arrays(self, optimiser: Optimiser) -> dict[str, NDArray[np.generic]]:
        """Return the state that a checkpoint must hold, as named arrays."""

    def restore(self, arrays: dict[str, NDArray[Any]], optimiser: Optimiser) -> None:
        """Take up that state (KeyError or ValueError if it is none)."""


class Loop:
    """
    An optimiser at a task, in a run's directory or in memory.

    Parameters
    ----------
    optimiser, task
        What searches, and for what.
    rng
        The optimiser's; its state is part of a checkpoint.
    place
        Where checkpoints are kept, and one is taken up; None: nowhere.

    Attributes
    ----------
    clocks
        Name of `CLOCKS` -> seconds of the whole run.

    Raises
    ------
    CheckpointError
        If the checkpoint is damaged or of another run.

    """

    def __init__(self, optimiser: Optimiser, task: Task, rng: np.random.Generator,
                 place: RunDirectory | None = None) -> None:
        self.optimiser, self.task, self.rng, self.place = optimiser, task, rng, place
        self.clocks = dict.fromkeys(CLOCKS, 0.0)
        self._history = np.zeros((0, len(HISTORY)))
        state = place.resume(rng) if place is not None else None
        if place is not None and state is not None:
            try:
                self._restore(state)
            except (KeyError, ValueError) as error:
                raise checkpoint.CheckpointError(
                    f'{place.path / rundir.CHECKPOINT}: does not belong to this run ({error}); '
                    'delete it to start again from the first generation') from None

    def _restore(self, state: dict[str, NDArray[Any]]) -> None:
        self.optimiser.restore(state)
        self.task.restore(state, self.optimiser)
        self._history = np.array(state['history'][:self.optimiser.generation])
        self.clocks = dict(zip(CLOCKS, state['clocks'].tolist(), strict=True))

    @property
    def history(self) -> Array:
        """What each generation came to, shape (generations, len(HISTORY))."""
        return self._history[:self.optimiser.generation]

    def reserve(self, generations: int) -> None:
        """Make room for the history of so many generations (MemoryError)."""
        missing = max(0, generations - len(self._history))
        self._history = np.concatenate([self._history, np.zeros((missing, len(HISTORY)))])

    def run(self, generations: int, progress: Callable[[Progress], None] | None = None, *,
            checkpoint_s: float = 10.0, checkpoint_generations: int | None = None) -> None:
        """
        Run the generations that are left of `generations`.

        `progress` is called after each. A checkpoint is written when `checkpoint_s` seconds, or
        `checkpoint_generations` generations, have gone by since the last, and at the end.
        """
        self.reserve(generations)
        optimiser, task = self.optimiser, self.task
        began = mark = saved = perf_counter()
        saved_generation = optimiser.generation
        while optimiser.generation < generations:
            in_engine, evaluations = task.seconds, task.evaluations
            task.begin(optimiser)
            optimiser.tell(task.judge(optimiser.ask(), optimiser))
            task.end(optimiser)
            self._record(task.evaluations - evaluations)
            now = perf_counter()
            self.clocks['engine'] += task.seconds - in_engine
            self.clocks['evolution'] += now - mark - (task.seconds - in_engine)
            self.clocks['total'] += now - mark
            mark = now
            if (now - saved >= checkpoint_s or optimiser.generation - saved_generation
                    == checkpoint_generations or optimiser.generation == generations):
                self._save()
                saved, saved_generation = perf_counter(), optimiser.generation
                self.clocks['checkpoint'] += saved - mark
                self.clocks['total'] += saved - mark
                mark = saved
            if progress is not None:
                population = optimiser.population
                progress(Progress(optimiser.generation, generations,
                                  float(population.fitness[population.best]), task.evaluations,
                                  mark - began))
                # Its time is not the run's: it may wait, as a study that is paused does.
                mark = perf_counter()

    def _record(self, evaluations: int) -> None:
        population = self.optimiser.population
        best = population.best
        self._history[self.optimiser.generation - 1] = (
            population.fitness[best], np.median(population.fitness), population.ages[best],
            len(population), evaluations)

    def _save(self) -> None:
        if self.place is not None:
            self.place.save({**self.optimiser.arrays(), **self.task.arrays(self.optimiser),
                             'history': self.history,
                             'clocks': np.array([self.clocks[name] for name in CLOCKS])}, self.rng)


class StatelessTask:
    """A task whose judgement depends on nothing but the genomes."""

    def begin(self, optimiser: Optimiser) -> None:
        """Change nothing."""

    def end(self, optimiser: Optimiser) -> None:
        """Change nothing."""

    def arrays(self, optimiser: Optimiser) -> dict[str, NDArray[np.generic]]:
        """Return no state."""
        return {}

    def restore(self, arrays: dict[str, NDArray[Any]], optimiser: Optimiser) -> None:
        """Change nothing."""
