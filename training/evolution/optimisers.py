"""
Optimisers by name. Each asks for the fitness of genomes, and is told it: `ask`, then `tell`.

`OPTIMISERS.add(name, Kind(about, make))` registers one more, from a plugin (see
`w2b_core.registry`); `python -m training evolve --optimiser NAME` runs with it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from training.evolution.operators import Array, Layout, mutate, random_genomes
from training.evolution.population import Population
from w2b_core.registry import Registry

Mutation = Callable[[np.random.Generator, Array, Layout], Array]
Newcomers = Callable[[np.random.Generator, int, Layout], Array]

PAPER = 'afpo'
#: What an optimiser must have.
PARTS = ('generation', 'population', 'ask', 'tell', 'arrays', 'restore')


class Optimiser(Protocol):
    """
    An optimiser's state between generations; the generator that it is given is its only chance.

    Attributes
    ----------
    generation
        How many generations have been told.
    population
        The genomes that it holds, with their fitness: the fittest is what it has found. A task
        whose situations change may replace it, with the fitness in the new ones.

    """

    generation: int
    population: Population

    def ask(self) -> Array:
        """Start a generation; return the genomes (N, G) of `population` without a fitness."""

    def tell(self, fitness: ArrayLike) -> None:
        """End the generation: `fitness` (N,) of the genomes that `ask` returned, more is better."""

    def arrays(self) -> dict[str, NDArray[np.generic]]:
        """Return the state, but for the generator, as named arrays."""

    def restore(self, arrays: dict[str, NDArray[np.generic]]) -> None:
        """Take up the state that `arrays` returned (KeyError or ValueError if it is no such)."""


class Make(Protocol):
    """What makes an optimiser."""

    def __call__(self, layout: Layout, rng: np.random.Generator, *, capacity: int,
                 mutation: Mutation, newcomers: Newcomers) -> Optimiser:
        """
        Return an optimiser.

        Parameters
        ----------
        layout
            Of the genomes.
        rng
            For all that is drawn.
        capacity
            Size of its population.
        mutation, newcomers
            Make children of parents' genomes (N, G), and genomes of no parents; an optimiser may
            do without.

        """


@dataclass(frozen=True)
class Kind:
    """An optimiser: a line on what it is, and what makes it."""

    about: str
    make: Make


def _afpo(*args: Any, **options: Any) -> Optimiser:
    from training.evolution.afpo import Afpo

    return Afpo(*args, **options)


def _cma_es(*args: Any, **options: Any) -> Optimiser:
    from training.evolution.cma_es import CmaEs

    return CmaEs(*args, **options)


OPTIMISERS: Registry[Kind] = Registry('optimiser')
OPTIMISERS.add(PAPER, Kind('age-fitness Pareto optimisation, as in the paper', _afpo))
OPTIMISERS.add('cma', Kind('CMA-ES: adapts the covariance of a normal distribution', _cma_es))


def make_optimiser(name: str, layout: Layout, rng: np.random.Generator, *, capacity: int,
                   mutation: Mutation = mutate, newcomers: Newcomers = random_genomes) -> Optimiser:
    """
    Return the optimiser `name`, see `Make`.

    Raises
    ------
    ValueError
        If there is none, or what was registered is none; the message names the plugin.

    """
    optimiser = OPTIMISERS.get(name).make(layout, rng, capacity=capacity, mutation=mutation,
                                          newcomers=newcomers)
    missing = [part for part in PARTS if not hasattr(optimiser, part)]
    if missing:
        origin = OPTIMISERS.origin(name)
        raise ValueError(f'{origin + ": " if origin else ""}optimiser {name!r}: expected an object '
                         f'with {", ".join(PARTS)}, got one without {", ".join(missing)}')
    return optimiser
