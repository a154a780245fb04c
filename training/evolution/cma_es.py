"""
CMA-ES (Hansen; PyPI `cma`) as an optimiser of evolution.

Its state is what its candidates earned: it is deterministic, so that a resumed search is told the
same again, without evaluations, and is where it was.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import cma
import numpy as np
from numpy.typing import ArrayLike, NDArray

from training.evolution.operators import Array, Layout, mutate, random_genomes
from training.evolution.population import Population, born, checked, joined

#: Step size to begin with, where weights are drawn from N(0, 1).
SIGMA = 0.5


def strategy(start: Array, sigma: float, capacity: int, rng: np.random.Generator) -> Any:
    """Return a `cma.CMAEvolutionStrategy` that draws from `rng` alone and never ends by itself."""
    return cma.CMAEvolutionStrategy(start, sigma, {
        'popsize': capacity, 'randn': lambda *shape: rng.standard_normal(shape),
        'seed': np.nan, 'verbose': -9, 'maxiter': np.inf, 'tolfun': 0, 'tolx': 0,
        'tolfunhist': 0, 'tolflatfitness': np.inf, 'tolstagnation': np.inf})


class CmaEs:
    """
    CMA-ES from one newcomer on; its population is the last generation and the best so far.

    Parameters
    ----------
    layout, rng, capacity, newcomers
        As `optimisers.Make`.
    mutation
        Not used: it draws from its own distribution.

    """

    def __init__(self, layout: Layout, rng: np.random.Generator, *, capacity: int = 50,
                 mutation: Callable[..., Array] = mutate,
                 newcomers: Callable[..., Array] = random_genomes) -> None:
        if capacity < 2:
            raise ValueError(f'capacity: expected at least 2, got {capacity}')
        self.layout = layout
        own = np.random.default_rng(rng.integers(0, 2**63, 4))
        self._strategy = strategy(newcomers(own, 1, layout)[0], SIGMA, capacity, own)
        self._told: list[Array] = []
        self.generation = 0
        self.next_number = 0
        self.population = born(np.zeros((0, layout.size)), np.zeros(0, dtype=np.int64), 0)

    def ask(self) -> Array:
        """Start a generation; return its genomes (N, G)."""
        genomes = np.array(self._strategy.ask())
        new = born(genomes, np.zeros(len(genomes), dtype=np.int64), self.next_number)
        self.next_number += len(genomes)
        old = self.population
        kept = old.take(np.array([old.best] if len(old) else [], dtype=np.int64))
        self.population = joined(replace(kept, ages=kept.ages + 1), new)
        return genomes

    def tell(self, fitness: ArrayLike) -> None:
        """End the generation: `fitness` (N,) of the genomes that `ask` returned, in that order."""
        fitness = np.asarray(fitness, dtype=np.float64)
        new = checked(self.population, fitness)
        scored = self.population.fitness.copy()
        scored[new] = fitness
        self._strategy.tell(list(self.population.genomes[new]), (-fitness).tolist())
        self._told.append(fitness)
        self.population = replace(self.population, fitness=scored)
        self.generation += 1

    def arrays(self) -> dict[str, NDArray[np.generic]]:
        """Return the state as named arrays."""
        return {**self.population.arrays(), 'told': np.array(self._told),
                'counters': np.array([self.generation, self.next_number], dtype=np.int64)}

    def restore(self, arrays: dict[str, NDArray[np.generic]]) -> None:
        """Take up the state that `arrays` returned (ValueError if it is of another layout)."""
        population = Population.restored(arrays, self.layout)
        for fitness in np.asarray(arrays['told'], dtype=np.float64):
            self._strategy.tell(self._strategy.ask(), (-fitness).tolist())
            self._told.append(fitness)
        self.population = population
        self.generation, self.next_number = (int(value) for value in arrays['counters'])
