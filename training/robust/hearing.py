"""
New ears for a gait: only how words enter is evolved, everything that walks stays as it is.

A walk that survives every simulator is the dear part of a controller, and the words it obeys hang
on the five auditory synapses alone, once its hidden layer has a rhythm for each behaviour. Here
those synapses are drawn anew and evolved until each word of a new training set leads into the
rhythm that the gait's own words `forward`, `backward` and `stop` led into. No body is needed: a
generation takes milliseconds, and the PyBullet gate judges the outcome.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from training.evolution.afpo import Afpo
from training.evolution.operators import Array, Layout
from training.evolution.treatments import EVOLUTION, VARIATIONS, generator
from training.robust.hidden_life import Life, live
from training.robust.objective import fitness
from training.robust.scenarios import DIRECTION, Randomisation, draw
from w2b_controller.network import Network
from w2b_sim.worlds import PAPER

GENERATIONS, POPULATION, REDRAW = 250, 100, 25
#: A rhythm this far from the one that was asked for, or farther, counts as another.
ANOTHER = 1.0


def rehear(gait: Network, heard: dict[str, Array], seed: int) -> tuple[Network, float]:
    """
    Return `gait` with new auditory synapses, and how well they sort the words (at most 0).

    Parameters
    ----------
    gait
        One controller that walks forward, backward and stands under the first of `heard`'s words
        for each of them.
    heard
        Behaviour -> vectors (W, T) of the words to be trained on.
    seed
        Everything random follows from it.

    """
    count = gait.hidden_count
    ear = Layout(count, 0, (1.0,))
    own = np.array([heard[behaviour][0] for behaviour in DIRECTION])
    rhythms = dict(zip(DIRECTION.values(), _rhythm(live(gait.hidden_weights[None], own))[0],
                       strict=True))

    def weights(genomes: Array) -> Array:
        hidden = np.repeat(gait.hidden_weights[None, :, :count + 1], len(genomes), axis=0)
        hidden[:, :, count] = ear.network(genomes).hidden_weights[:, :, count]
        return hidden

    def score(genomes: Array, *branch: int, moves: int, stops: int) -> Array:
        scenario = draw(generator(seed, VARIATIONS, *branch), heard, PAPER, Randomisation(),
                        moves=moves, stops=stops)
        asked = np.array([rhythms[int(direction)] for direction in scenario.directions])
        away = np.linalg.norm(_rhythm(live(weights(genomes), scenario.signals)) - asked, axis=-1)
        return fitness(-np.minimum(1.0, away / ANOTHER), scenario.directions)

    afpo = Afpo(ear, generator(seed, EVOLUTION), capacity=POPULATION, mutation=_mutate,
                newcomers=_newcomers)
    for generation in range(GENERATIONS):
        drawn = generation - generation % REDRAW
        if generation and generation == drawn:
            again = score(afpo.population.genomes, drawn, moves=2, stops=12)
            afpo.population = replace(afpo.population, fitness=again)
        afpo.tell(score(afpo.ask(), drawn, moves=2, stops=12))
    genomes = afpo.population.genomes
    reached = score(genomes, 2**31, moves=8, stops=40)
    best = int(np.argmax(reached))
    hidden = gait.hidden_weights.copy()
    hidden[:, count] = weights(genomes[best][None])[0, :, count]
    return replace(gait, hidden_weights=hidden), float(reached[best])


def _rhythm(life: Life) -> Array:
    """What tells one rhythm from another: where the hidden neurons are, and how far they swing."""
    return np.concatenate([life.mean, life.late_swing], axis=-1)


def _auditory(layout: Layout) -> NDArray[np.int64]:
    """Where the auditory synapses stand in a genome."""
    return np.arange(layout.hidden_count) * (layout.hidden_count + 1) + layout.hidden_count


def _newcomers(rng: np.random.Generator, count: int, layout: Layout) -> Array:
    genomes = np.zeros((count, layout.size))
    scale = rng.choice([0.5, 1.0, 2.0, 4.0], count)[:, None]
    genomes[:, _auditory(layout)] = scale * rng.standard_normal((count, layout.hidden_count))
    return genomes


def _mutate(rng: np.random.Generator, genomes: Array, layout: Layout) -> Array:
    """One auditory synapse redrawn, from N(w, |w|) or N(w, 1), or all of them scaled a little."""
    children = genomes.copy()
    count, places = len(children), _auditory(layout)
    one = rng.random(count) < 0.5
    rows, column = np.arange(count), places[rng.integers(0, len(places), count)]
    old = children[rows, column]
    size = np.where(rng.random(count) < 0.3, 1.0, np.abs(old))
    redrawn = old + size * rng.standard_normal(count)
    factor = 1.0 + rng.choice([0.03, 0.2], count)[:, None] * rng.standard_normal(
        (count, len(places)))
    children[:, places] *= np.where(one[:, None], 1.0, factor)
    children[rows[one], column[one]] = redrawn[one]
    return children
