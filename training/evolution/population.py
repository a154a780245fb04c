"""A population: genomes with their fitness, and where each comes from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from training.evolution.operators import Array, Layout


@dataclass(frozen=True)
class Population:
    """
    N individuals.

    Attributes
    ----------
    genomes: shape (N, G)
    ages: shape (N,)
        Generations since the individual's oldest ancestor was drawn at random.
    fitness: shape (N,)
        NaN until it is told.
    numbers: shape (N,)
        Serial numbers: the smaller, the older.
    parents: shape (N,)
        The number of the individual that this one is a mutated copy of; -1 if it is none's.

    """

    genomes: Array
    ages: NDArray[np.int64]
    fitness: Array
    numbers: NDArray[np.int64]
    parents: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.ages)

    def take(self, indices: NDArray[np.int64]) -> Population:
        """Return the individuals at `indices`."""
        return Population(*(getattr(self, field.name)[indices] for field in fields(self)))

    @property
    def best(self) -> int:
        """Index of the fittest individual; of equals, the one with the smallest number."""
        order = np.lexsort((self.numbers, -np.nan_to_num(self.fitness, nan=-np.inf)))
        return int(order[0])

    def arrays(self) -> dict[str, NDArray[np.generic]]:
        """Return the individuals as named arrays."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @classmethod
    def restored(cls, arrays: Mapping[str, NDArray[np.generic]], layout: Layout) -> Population:
        """Return the population of named arrays (ValueError if it is of another layout)."""
        population = cls(*(np.array(arrays[field.name]) for field in fields(cls)))
        if population.genomes.ndim != 2 or population.genomes.shape[1] != layout.size:
            raise ValueError(f'genomes: expected (N, {layout.size}), '
                             f'got {population.genomes.shape}')
        return population


def born(genomes: Array, ages: NDArray[np.int64], first_number: int,
         parents: NDArray[np.int64] | None = None) -> Population:
    """Return individuals that have no fitness yet, numbered from `first_number` on."""
    count = len(genomes)
    return Population(genomes, ages, np.full(count, np.nan),
                      np.arange(first_number, first_number + count),
                      np.full(count, -1) if parents is None else parents)


def joined(*parts: Population) -> Population:
    """Return all individuals of some populations, in their order."""
    return Population(*(np.concatenate([getattr(part, field.name) for part in parts])
                        for field in fields(Population)))


def checked(population: Population, fitness: Array) -> NDArray[np.bool_]:
    """Return who has no fitness yet (ValueError unless `fitness` is one number for each)."""
    new = np.isnan(population.fitness)
    if fitness.shape != (int(new.sum()),) or np.isnan(fitness).any():
        raise ValueError(f'fitness: expected ({int(new.sum())},) numbers, got {fitness.shape} '
                         f'with {int(np.isnan(fitness).sum())} NaN')
    return new
