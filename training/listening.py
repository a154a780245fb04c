"""
Hear first, walk later: hidden weights that tell words apart, evolved without a body.

Most of what a controller must learn before it can obey is in its hidden layer alone: `forward` and
`backward` have to lead into two different rhythms, and every stop word into rest. A rhythm costs
microseconds to compute and a walk milliseconds, so these weights are evolved first, on the network
with silent sensors, and the robust mode's newcomers start from them with random motor weights.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from training.afpo import Afpo
from training.operators import Array, Layout, mutate, random_genomes
from training.robust_objective import fitness
from training.scenarios import Scenario
from training.treatments import VARIATIONS, generator

#: Updates after priming, and the first of them that counts as settled.
STEPS, SETTLED = 400, 150
#: A joint follows its motor with a time constant of this many steps (1 s): faster rhythms are lost.
JOINT_STEPS = 20.0
#: Swing of the hidden neurons, after the joints' lag, that is worth full marks for a move.
LIVELY = 0.12
#: Swing of the hidden neurons that costs a stop full marks.
RESTLESS = 0.1
STOP_WEIGHT, CONTRAST_WEIGHT = 2.0, 0.25


@dataclass(frozen=True)
class Listening:
    """
    How long to listen before walking.

    `attempts` independent runs of `generations` each; `redraw` as in a robust stage. No attempts:
    walk at once.
    """

    attempts: int = 6
    generations: int = 500
    redraw: int = 25
    population: int = 50


class Life(NamedTuple):
    """Hidden neurons once settled: mean (N, R, H), swing, and swing after the joints' lag."""

    mean: Array
    swing: Array
    slow_swing: Array


def live(hidden_weights: Array, signals: Array) -> Life:
    """
    Prime networks (N, H, H + 1 + S) with signals (R, T) and let them run with silent sensors.

    The semantics of `w2b_controller.network`, in a form that is fast for large batches.
    """
    count = hidden_weights.shape[1]
    recurrent = np.ascontiguousarray(np.swapaxes(hidden_weights[:, :, :count], 1, 2))
    auditory = hidden_weights[:, None, :, count]
    hidden = np.zeros((len(hidden_weights), len(signals), count))
    for element in signals.T:
        hidden = np.tanh(hidden + hidden @ recurrent + auditory * element[None, :, None])
    hidden = np.tanh(2.0 * hidden + hidden @ recurrent)
    joint = hidden
    sums = np.zeros((4, *hidden.shape))
    for step in range(1, STEPS):
        hidden = np.tanh(hidden + hidden @ recurrent)
        joint = joint + (hidden - joint) / JOINT_STEPS
        if step >= SETTLED:
            sums += (hidden, hidden * hidden, joint, joint * joint)
    mean, square, slow_mean, slow_square = sums / (STEPS - SETTLED)
    return Life(mean, np.sqrt(np.maximum(square - mean**2, 0.0)),
                np.sqrt(np.maximum(slow_square - slow_mean**2, 0.0)))


def score(hidden_weights: Array, scenario: Scenario) -> Array:
    """
    Return how well networks (N, H, K) tell the scenario's words apart, shape (N,), at most 2.25.

    Rhythm under each move word (up to 1 a direction), rest under each stop word (down to -2), and
    a bonus for rhythms of forward and backward that differ in their mean or their swing.
    """
    life = live(hidden_weights, scenario.signals)
    directions = scenario.directions
    rest = -STOP_WEIGHT * np.minimum(1.0, _norm(life.swing) / RESTLESS)
    rhythm = np.minimum(1.0, _norm(life.slow_swing) / LIVELY)
    manner = np.concatenate([life.mean, 3.0 * life.slow_swing], axis=-1)
    difference = (manner[:, directions == 1].mean(axis=1)
                  - manner[:, directions == -1].mean(axis=1))
    contrast = np.minimum(1.0, np.linalg.norm(difference, axis=-1))
    total: Array = (fitness(np.where(directions == 0, rest, rhythm), directions)
                    + CONTRAST_WEIGHT * contrast)
    return total


def listen(layout: Layout, plan: Listening, seed: int, scenario: Callable[
        [np.random.Generator, int, int], Scenario], keep: int = 20) -> Array:
    """
    Return the `keep` best genomes (keep, G) of all attempts, of different descent where possible.

    Parameters
    ----------
    layout
        Of the genomes.
    plan
        How long to listen.
    seed
        Everything random follows from it.
    scenario
        Draws one from (generator, moves a direction, stops).
    keep
        How many to return.

    """
    test = scenario(generator(seed, VARIATIONS, 0, 0), 16, 40)
    found, scores = [], []
    for attempt in range(plan.attempts):
        afpo = Afpo(layout, generator(seed, VARIATIONS, 1, attempt), capacity=plan.population,
                    mutation=mutate)
        now = test
        for generation in range(plan.generations):
            if generation % plan.redraw == 0:
                now = scenario(generator(seed, VARIATIONS, 2, attempt, generation), 4, 10)
                if generation:
                    again = score(layout.network(afpo.population.genomes).hidden_weights, now)
                    afpo.population = replace(afpo.population, fitness=again)
            afpo.tell(score(layout.network(afpo.ask()).hidden_weights, now))
        genomes = afpo.population.genomes
        reached = score(layout.network(genomes).hidden_weights, test)
        best = np.argsort(-reached, kind='stable')[:keep // 2]
        found.append(genomes[best])
        scores.append(reached[best])
    order = np.argsort(-np.concatenate(scores), kind='stable')[:keep]
    chosen: Array = np.concatenate(found)[order]
    return chosen


def newcomers(listeners: Array) -> Callable[[np.random.Generator, int, Layout], Array]:
    """Return an operator that draws new genomes: hidden weights of a listener, random motors."""
    def born(rng: np.random.Generator, count: int, layout: Layout) -> Array:
        genomes = random_genomes(rng, count, layout)
        # The better half of the places goes to the best: rank-weighted draws.
        rank = np.minimum(rng.integers(0, len(listeners), count),
                          rng.integers(0, len(listeners), count))
        genomes[:, :layout.hidden_size] = listeners[rank, :layout.hidden_size]
        return genomes
    return born


def _norm(values: NDArray[np.float64]) -> Array:
    """Root mean square over the neurons."""
    size: Array = np.sqrt((values**2).mean(axis=-1))
    return size
