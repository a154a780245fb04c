"""
Genomes of controllers, and the operators that make new ones.

A genome is one row of numbers: the hidden weights, then the motor weights, row by row. Operators
are pure: they draw from the generator they are given and return new arrays.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from w2b_core.bodies.model import Body
from w2b_core.network import Network

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Layout:
    """How a genome of G numbers maps to the weights of a network (see `network.Network`)."""

    hidden_count: int
    sensor_count: int
    motor_time_constants: tuple[float, ...]

    @classmethod
    def of(cls, body: Body) -> Layout:
        """Return the layout of the controllers that fit `body`."""
        return cls(body.hidden_neurons, len(body.sensors),
                   tuple(joint.time_constant for joint in body.joints))

    @property
    def hidden_shape(self) -> tuple[int, int]:
        """Shape of the hidden weights: (H, H + 1 + S)."""
        return self.hidden_count, self.hidden_count + 1 + self.sensor_count

    @property
    def motor_shape(self) -> tuple[int, int]:
        """Shape of the motor weights: (M, H)."""
        return len(self.motor_time_constants), self.hidden_count

    @property
    def hidden_size(self) -> int:
        """How many numbers of a genome are hidden weights; they come first."""
        return self.hidden_shape[0] * self.hidden_shape[1]

    @property
    def size(self) -> int:
        """Length of a genome, G."""
        return self.hidden_size + self.motor_shape[0] * self.motor_shape[1]

    def network(self, genomes: ArrayLike) -> Network:
        """Return the network of one genome (G,), or the batch of several (C, G)."""
        genomes = np.asarray(genomes, dtype=np.float64)
        if genomes.shape[-1:] != (self.size,):
            raise ValueError(f'genomes: expected (..., {self.size}), got {genomes.shape}')
        lead = genomes.shape[:-1]
        return Network(genomes[..., :self.hidden_size].reshape(*lead, *self.hidden_shape),
                       genomes[..., self.hidden_size:].reshape(*lead, *self.motor_shape),
                       np.array(self.motor_time_constants))

    def genome(self, network: Network) -> Array:
        """Return the genome (..., G) of `network`: the inverse of `network`."""
        if network.hidden_weights.shape[-2:] != self.hidden_shape or (
                network.motor_weights.shape[-2:] != self.motor_shape):
            raise ValueError(
                f'network: expected weights {self.hidden_shape} and {self.motor_shape}, got '
                f'{network.hidden_weights.shape[-2:]} and {network.motor_weights.shape[-2:]}')
        lead = network.hidden_weights.shape[:-2]
        return np.concatenate([network.hidden_weights.reshape(*lead, -1),
                               network.motor_weights.reshape(*lead, -1)], axis=-1)


def random_genomes(rng: np.random.Generator, count: int, layout: Layout) -> Array:
    """Return `count` new genomes (count, G), every weight drawn from N(0, 1)."""
    return rng.standard_normal((count, layout.size))


def _pick_synapses(rng: np.random.Generator, count: int, layout: Layout) -> NDArray[np.int64]:
    """One synapse each (count,): the hidden or the motor matrix evenly, then one of its entries."""
    in_motor = rng.random(count) < 0.5
    hidden = rng.integers(0, layout.hidden_size, count)
    motor = rng.integers(layout.hidden_size, layout.size, count)
    return np.where(in_motor, motor, hidden)


def mutate(rng: np.random.Generator, genomes: Array, layout: Layout) -> Array:
    """
    Return copies of `genomes` (N, G), each with one synapse w redrawn from N(w, |w|).

    The original's operator (paper, section II-E): the hidden or the motor matrix with even odds,
    then one of its entries.
    """
    children = genomes.copy()
    rows = np.arange(len(children))
    columns = _pick_synapses(rng, len(children), layout)
    old = children[rows, columns]
    children[rows, columns] = old + np.abs(old) * rng.standard_normal(len(children))
    return children


def mutate_mixed(rng: np.random.Generator, genomes: Array, layout: Layout) -> Array:
    """
    Return mutated copies of `genomes` (N, G) by the robust mode's mixture of operators.

    Half of the copies get one synapse redrawn as in `mutate`; a fifth two or three of them; the
    rest have every synapse scaled by 1 + N(0, 0.1) and shifted by N(0, 0.02). Small changes of all
    weights refine gaits that a change of one whole synapse would break.
    """
    children = genomes.copy()
    count = len(children)
    kind = rng.random(count)
    times = np.where(kind < 0.5, 1, np.where(kind < 0.7, rng.integers(2, 4, count), 0))
    for turn in range(3):
        mutated = mutate(rng, children, layout)
        children = np.where((times > turn)[:, None], mutated, children)
    scale = 1.0 + 0.1 * rng.standard_normal(children.shape)
    shift = 0.02 * rng.standard_normal(children.shape)
    return np.where((times == 0)[:, None], children * scale + shift, children)
