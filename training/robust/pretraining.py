"""
Pretraining: hidden weights that tell words apart, evolved without a body.

Most of what a controller must learn before it can obey is in its hidden layer alone: `forward` and
`backward` have to lead into two different rhythms, and every stop word into rest. A rhythm costs
microseconds to compute and a walk milliseconds, so these weights are evolved first, on the network
with silent sensors, and the robust mode's newcomers start from them with random motor weights.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from training.evolution.loop import Loop, StatelessTask
from training.evolution.operators import Array, Layout, random_genomes
from training.evolution.optimisers import PAPER, Optimiser, make_optimiser
from training.evolution.treatments import VARIATIONS, generator
from training.robust.hidden_life import live
from training.robust.objective import fitness_of
from training.robust.scenarios import BACKWARD, FORWARD, STOP, Scenario
from training.robust.settings import Pretraining

#: Swing of the hidden neurons that is worth full marks for a move.
LIVELY = 0.3
#: Swing of the hidden neurons that costs a stop full marks.
RESTLESS = 0.1
#: Standard deviation of the constant input that feet on the floor may put on a hidden neuron.
TOUCH_INPUT = 0.07
STOP_WEIGHT, ALL_WEIGHT = 2.0, 2.0
#: Listeners this much worse than the best are not kept.
ENOUGH = 0.5


def score(hidden_weights: Array, scenario: Scenario, bias: float = 0.0) -> Array:
    """
    Return how well networks (N, H, K) tell the scenario's words apart, shape (N,), at most 4.

    Rhythm under the move words (up to 1 a direction), rest under the stop words (else down to -2),
    and up to 2 for having it all: both rhythms, about different means, and rest.
    """
    life = live(hidden_weights, scenario.signals,
                inputs(len(scenario), hidden_weights.shape[1], bias))
    directions = scenario.directions
    unrest = np.minimum(1.0, _norm(life.swing) / RESTLESS)
    rhythm = np.minimum(1.0, _norm(life.late_swing) / LIVELY)
    difference = (life.mean[:, directions == FORWARD].mean(axis=1)
                  - life.mean[:, directions == BACKWARD].mean(axis=1))
    contrast = np.minimum(1.0, np.linalg.norm(difference, axis=-1))
    forward, backward = (fitness_of(rhythm[:, directions == way]) for way in (FORWARD, BACKWARD))
    rest = 1.0 + fitness_of(-unrest[:, directions == STOP])
    total: Array = (forward + backward - STOP_WEIGHT * (1.0 - rest)
                    + ALL_WEIGHT * contrast * np.minimum(forward, backward) * rest)
    return total


def inputs(count: int, hidden: int, bias: float) -> Array:
    """Return constant inputs (count, hidden): 0 in every other situation, else N(0, bias)."""
    drawn = bias * np.random.default_rng(count).standard_normal((count, hidden))
    drawn[::2] = 0.0
    return drawn


class SortingTask(StatelessTask):
    """The task: hidden layers without a body are judged by how they tell words apart."""

    def __init__(self, layout: Layout, plan: Pretraining,
                 drawn: Callable[[int], Scenario]) -> None:
        self.layout, self.plan, self.drawn = layout, plan, drawn
        self.scenario = drawn(0)
        self.evaluations, self.seconds = 0, 0.0

    def begin(self, optimiser: Optimiser) -> None:
        """Draw situations anew where they are due, and score the population in them."""
        generation = optimiser.generation
        if generation and generation % self.plan.redraw == 0:
            self.scenario = self.drawn(generation)
            population = optimiser.population
            optimiser.population = replace(
                population, fitness=self.judge(population.genomes, optimiser))

    def judge(self, genomes: Array, _optimiser: Optimiser) -> Array:
        """Return the scores (N,) of genomes (N, G)."""
        self.evaluations += len(genomes) * len(self.scenario)
        return score(self.layout.network(genomes).hidden_weights, self.scenario, self.plan.bias)


def listen(layout: Layout, plan: Pretraining, seed: int, scenario: Callable[
        [np.random.Generator, int, int], Scenario], keep: int = 20) -> Array:
    """
    Return recurrent and auditory weights (keep, H, H + 1): the best of all attempts.

    Parameters
    ----------
    layout
        Of the genomes that will start from them.
    plan
        How long to listen.
    seed
        Everything random follows from it.
    scenario
        Draws one from (generator, moves a direction, stops).
    keep
        How many to return.

    """
    hidden = Layout(layout.hidden_count, 0, (1.0,))
    test = scenario(generator(seed, VARIATIONS, 0, 0), 16, 40)
    found, scores = [], []
    for attempt in range(plan.attempts):
        rng = generator(seed, VARIATIONS, 1, attempt)
        optimiser = make_optimiser(PAPER, hidden, rng, capacity=plan.population,
                                   mutation=mutate_ear, newcomers=random_genomes)
        drawn = partial(_drawn, scenario, plan, seed, attempt)
        Loop(optimiser, SortingTask(hidden, plan, drawn), rng).run(plan.generations)
        weights = hidden.network(optimiser.population.genomes).hidden_weights
        reached = score(weights, test, plan.bias)
        best = np.argsort(-reached, kind='stable')[:keep // 2]
        found.append(weights[best])
        scores.append(reached[best])
    reached = np.concatenate(scores)
    order = np.argsort(-reached, kind='stable')[:keep]
    # Those that miss a move word cannot learn to walk both ways.
    order = order[reached[order] > reached[order[0]] - ENOUGH]
    chosen: Array = np.concatenate(found)[order]
    return chosen


def _drawn(scenario: Callable[[np.random.Generator, int, int], Scenario], plan: Pretraining,
           seed: int, attempt: int, generation: int) -> Scenario:
    """Return the situations that are drawn in a generation of an attempt."""
    return scenario(generator(seed, VARIATIONS, 2, attempt, generation), plan.moves, plan.stops)


def mutate_ear(rng: np.random.Generator, genomes: Array, layout: Layout) -> Array:
    """
    Return copies of `genomes` (N, G), each with one recurrent or auditory synapse w redrawn.

    Either kind with even odds, then one of its entries, from N(w, |w|) or, in one of four, N(w, 1).
    """
    children = genomes.copy()
    count, inputs = len(children), layout.hidden_count + 1
    target = rng.integers(0, layout.hidden_count, count)
    source = np.where(rng.random(count) < 0.5, layout.hidden_count,
                      rng.integers(0, layout.hidden_count, count))
    rows, columns = np.arange(count), target * inputs + source
    old = children[rows, columns]
    size = np.where(rng.random(count) < 0.25, 1.0, np.abs(old))
    children[rows, columns] = old + size * rng.standard_normal(count)
    return children


def newcomers(listeners: Array) -> Callable[[np.random.Generator, int, Layout], Array]:
    """Return an operator that draws new genomes: a listener's weights, and the others at random."""
    def born(rng: np.random.Generator, count: int, layout: Layout) -> Array:
        genomes = random_genomes(rng, count, layout)
        # The better half of the places goes to the best: rank-weighted draws.
        rank = np.minimum(rng.integers(0, len(listeners), count),
                          rng.integers(0, len(listeners), count))
        hidden, inputs = layout.hidden_shape
        weights = genomes[:, :layout.hidden_size].reshape(count, hidden, inputs)
        weights[:, :, :hidden + 1] = listeners[rank]
        genomes[:, :layout.hidden_size] = weights.reshape(count, -1)
        return genomes
    return born


def _norm(values: NDArray[np.float64]) -> Array:
    """Root mean square over the neurons."""
    size: Array = np.sqrt((values**2).mean(axis=-1))
    return size
