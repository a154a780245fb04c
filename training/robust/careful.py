"""
Careful mutation: children sort the words no worse than their parents.

Walking is learnt with the touch sensors off, where the hidden layer runs by itself: whether a
changed hidden layer still rests under every stop word, and still has a rhythm of its own for each
move, is seen without a body, in microseconds. Children that hear worse than their parents get their
parents' hidden weights back, and keep what changed in their motor weights.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from training.evolution.operators import Array, Layout, mutate_mixed
from training.evolution.optimisers import Mutation
from training.robust.hidden_life import live
from training.robust.pretraining import LIVELY, RESTLESS, TOUCH_INPUT
from training.robust.scenarios import BACKWARD, FORWARD, STOP, STOP_NOISE
from training.robust.settings import Careful

NOISE_SEED = 0


def careful_mutation(settings: Careful, heard: Mapping[int, Array], hidden_count: int) -> Mutation:
    """
    Return `mutate_mixed` for networks that shall go on hearing.

    Parameters
    ----------
    settings
        How careful.
    heard
        Direction -> vectors (W, T) of the trained words. They are tried as they are, and with
        noise and constant inputs from feet.
    hidden_count
        Of the networks, H.

    """
    rng = np.random.default_rng(NOISE_SEED)

    def twice(vectors: Array) -> Array:
        return np.concatenate([vectors, vectors + STOP_NOISE * rng.standard_normal(vectors.shape)])

    stops = twice(heard[STOP])
    moves = [np.repeat(heard[direction], 2, axis=0) for direction in (FORWARD, BACKWARD)]
    signals = np.concatenate([stops, *moves])
    first, second = len(stops), len(stops) + len(moves[0])
    bias = TOUCH_INPUT * rng.standard_normal((len(signals), hidden_count))
    bias[:len(stops) // 2] = 0.0
    bias[first::2] = 0.0

    def hearing(genomes: Array, layout: Layout) -> Array:
        life = live(layout.network(genomes).hidden_weights, signals, bias)
        unrest = np.sqrt((life.swing[:, :first]**2).mean(axis=-1))
        rest = (1 - np.minimum(1.0, unrest / RESTLESS)).sum(axis=1)
        rhythm = np.sqrt((life.late_swing[:, first:]**2).mean(axis=-1)).min(axis=1)
        contrast = np.linalg.norm(life.mean[:, first:second].mean(axis=1)
                                  - life.mean[:, second:].mean(axis=1), axis=-1)
        score: Array = rest + settings.rhythm_weight * (np.minimum(1.0, rhythm / LIVELY)
                                                        + np.minimum(1.0, contrast))
        return score

    def mutation(rng: np.random.Generator, genomes: Array, layout: Layout) -> Array:
        children = mutate_mixed(rng, genomes, layout)
        size = layout.hidden_size
        kept = rng.random(len(children)) >= settings.hidden_share
        children[kept, :size] = genomes[kept, :size]
        changed = np.flatnonzero((children[:, :size] != genomes[:, :size]).any(axis=1))
        if len(changed):
            before, after = np.split(hearing(np.concatenate(
                [genomes[changed], children[changed]]), layout), 2)
            worse = changed[after < before - settings.tolerance]
            children[worse, :size] = genomes[worse, :size]
        return children

    return mutation
