"""Touch synapses in the robust mode: silent at first, then small and many, then grown."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from training.evolution.operators import Array, Layout
from training.evolution.population import Population
from training.robust.settings import Touch


def synapses(genomes: Array, layout: Layout) -> Array:
    """Return a view (N, H, S) of the synapses from the sensors in genomes (N, G)."""
    hidden, inputs = layout.hidden_shape
    weights = genomes.reshape(len(genomes), -1)[:, :hidden * inputs]
    strides = (weights.strides[0], inputs * weights.strides[1], weights.strides[1])
    every = np.lib.stride_tricks.as_strided(weights, (len(genomes), hidden, inputs), strides)
    return every[..., hidden + 1:]


def felt(genomes: Array, layout: Layout, gain: float) -> Array:
    """Return the genomes with the sensors' synapses scaled by `gain`."""
    if gain == 1.0 or not layout.sensor_count:
        return genomes
    scaled = genomes.copy()
    synapses(scaled, layout)[:] *= gain
    return scaled


def begin_to_feel(population: Population, layout: Layout, rng: np.random.Generator,
                  settings: Touch) -> Population:
    """
    Return many copies of each of the best, with small touch synapses drawn anew for each.

    Most synapses upset a gait; which do not is found by trying many.
    """
    best = np.argsort(-population.fitness, kind='stable')[:settings.best]
    chosen = best[np.arange(len(population)) % len(best)]
    genomes = population.genomes[chosen]
    touch = synapses(genomes, layout)
    sizes = rng.choice(settings.sizes, len(genomes))
    touch[:] = sizes[:, None, None] * rng.standard_normal(touch.shape)
    return replace(population, genomes=genomes, ages=population.ages[chosen])
