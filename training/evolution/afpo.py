"""
Age-Fitness Pareto Optimization (Schmidt and Lipson, 2011), as the original study's program ran it.

One generation: every age grows by one; one new random individual of age 0 and mutated copies of
uniformly chosen parents (a copy keeps its parent's age) fill the population to twice its capacity;
the new ones are evaluated; then tournaments delete until max(capacity, size of the non-dominated
set) remain. Ask for genomes, score them, tell the scores.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from training.evolution.operators import Array, Layout, mutate, random_genomes
from training.evolution.optimisers import Mutation, Newcomers
from training.evolution.population import Population, born, checked, joined


def dominance(ages: ArrayLike, fitness: ArrayLike, numbers: ArrayLike) -> NDArray[np.bool_]:
    """
    Return whether i dominates j, shape (N, N).

    i dominates j if its age is no greater, its fitness no less, and one of them strictly so; of
    two alike, the one with the smaller number dominates.
    """
    ages, fitness, numbers = np.asarray(ages), np.asarray(fitness), np.asarray(numbers)
    younger, same_age = ages[:, None] < ages, ages[:, None] == ages
    fitter, as_fit = fitness[:, None] > fitness, fitness[:, None] == fitness
    older_number = numbers[:, None] < numbers
    dominates: NDArray[np.bool_] = ((younger | same_age) & (fitter | as_fit)
                                    & (younger | fitter | older_number))
    return dominates


def survivors(rng: np.random.Generator, dominates: NDArray[np.bool_],
              capacity: int) -> NDArray[np.int64]:
    """
    Return the indices, ascending, of those that outlive the tournaments.

    The original draws two individuals and deletes the second if the first dominates it, until
    max(capacity, size of the non-dominated set) remain. A draw without a deletion changes nothing,
    so every deletion falls on a pair drawn evenly from the dominating pairs that are left: the
    second is j with a probability in proportion to the number of living dominators of j. Drawing j
    so gives the same distribution and needs one draw a deletion.

    Parameters
    ----------
    rng
        Source of one uniform number a deletion.
    dominates: shape (N, N)
        As `dominance` returns it.
    capacity
        How many may stay, unless more are dominated by nobody.

    """
    dominators = dominates.sum(axis=0).astype(np.int64)
    keep = max(capacity, int((dominators == 0).sum()))
    count = len(dominators)
    alive = np.ones(count, dtype=np.bool_)
    for draw in rng.random(max(0, count - keep)):
        heap = np.cumsum(dominators)
        loser = int(np.searchsorted(heap, int(draw * heap[-1]), side='right'))
        alive[loser] = False
        dominators -= dominates[loser]
        dominators[loser] = 0
        # The dead must not be drawn again, whoever still dominates them.
        dominators[~alive] = 0
    return np.flatnonzero(alive)


class Afpo:
    """
    The algorithm's state between generations; the only randomness is the generator it is given.

    Parameters
    ----------
    layout
        Of the genomes.
    rng
        Advanced by `ask` and `tell`.
    capacity
        Population size (paper: 50).
    mutation
        Makes children of parents' genomes.
    newcomers
        Makes genomes of no parents.

    """

    def __init__(self, layout: Layout, rng: np.random.Generator, *, capacity: int = 50,
                 mutation: Mutation = mutate, newcomers: Newcomers = random_genomes) -> None:
        if capacity < 2:
            raise ValueError(f'capacity: expected at least 2, got {capacity}')
        self.layout, self.rng, self.capacity = layout, rng, capacity
        self.mutation, self.newcomers = mutation, newcomers
        self.generation = 0
        self.next_number = 0
        self.population = self._born(newcomers(rng, capacity, layout),
                                     np.zeros(capacity, dtype=np.int64))

    def ask(self) -> Array:
        """
        Start a generation; return the genomes (N, G) that have no fitness yet.

        In the first generation these are the whole first population and its children.
        """
        old = self.population
        rng, capacity = self.rng, self.capacity
        newcomer = self._born(self.newcomers(rng, 1, self.layout), np.zeros(1, dtype=np.int64))
        parents = rng.integers(0, len(old), max(0, 2 * capacity - len(old) - 1))
        children = self._born(self.mutation(rng, old.genomes[parents], self.layout),
                              old.ages[parents] + 1, old.numbers[parents])
        aged = replace(old, ages=old.ages + 1)
        self.population = joined(aged, newcomer, children)
        return self.population.genomes[np.isnan(self.population.fitness)]

    def tell(self, fitness: ArrayLike) -> None:
        """End the generation: `fitness` (N,) of the genomes that `ask` returned, in that order."""
        fitness = np.asarray(fitness, dtype=np.float64)
        new = checked(self.population, fitness)
        scored = self.population.fitness.copy()
        scored[new] = fitness
        everyone = replace(self.population, fitness=scored)
        chosen = survivors(self.rng, dominance(everyone.ages, everyone.fitness, everyone.numbers),
                           self.capacity)
        self.population = everyone.take(chosen)
        self.generation += 1

    def arrays(self) -> dict[str, NDArray[np.generic]]:
        """Return the state, but for the generator, as named arrays."""
        return {**self.population.arrays(),
                'counters': np.array([self.generation, self.next_number], dtype=np.int64)}

    def restore(self, arrays: dict[str, NDArray[np.generic]]) -> None:
        """Take up the state that `arrays` returned (ValueError if it is of another layout)."""
        self.population = Population.restored(arrays, self.layout)
        self.generation, self.next_number = (int(value) for value in arrays['counters'])

    def _born(self, genomes: Array, ages: NDArray[np.int64],
              parents: NDArray[np.int64] | None = None) -> Population:
        individuals = born(genomes, ages, self.next_number, parents)
        self.next_number += len(genomes)
        return individuals
