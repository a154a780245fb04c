"""
The task of drawn worlds: controllers that keep walking in another simulator.

Each generation is judged in many drawn situations (`scenarios`), and:

- the fitness is the sum of forward and backward progress, each clipped, minus what the robot moves
  under stop words; of each, half the mean and half the mean of the worst third of the situations;
- progress is twice the way of the second half, so that one lunge from the start earns nothing;
- situations are drawn anew every `redraw` generations and the parents scored again; an individual's
  fitness is a running mean over the draws; a child's is its own in the draw of now, but no more
  than its parent's plus their difference in the same situations;
- a child that is worse than its parent in a third of the situations is not tried in the rest;
- hidden weights that tell the words apart are evolved first, without a body (`pretraining`);
- stages: walking first without touch sensors in few situations, then in many, then with touch.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from training.evolution import treatments
from training.evolution.operators import Array, Layout
from training.evolution.optimisers import Optimiser
from training.robust import touch
from training.robust.config import RobustConfig
from training.robust.objective import fitness, values
from training.robust.scenarios import Scenario, draw
from training.robust.settings import Randomisation, Stage
from w2b_core import bodies
from w2b_core.network import Network
from w2b_sim.engines.interface import Start

#: Given to a child that was rejected early: worse than any that was not.
REJECTED = -10.0


class DrawnWorlds:
    """
    The task: genomes are judged in situations that are drawn anew from time to time.

    Parameters
    ----------
    config
        The run.
    heard
        Direction -> vectors (W, T) of the trained words.
    threads
        Of the engine.

    """

    def __init__(self, config: RobustConfig, heard: Mapping[int, Array], threads: int = 1) -> None:
        from w2b_sim.engines.batched import BatchedEngine

        self.config, self.heard = config, heard
        body = bodies.get(config.body)
        self.world = config.training_world()
        # A world with dry friction has Bullet's contacts, which act just before they are reached.
        dry = replace(self.world, friction=self.world.friction or 1.0)
        self.engines = {(length, soon): BatchedEngine(
            body, replace(world, steps=round(world.steps * length)), precision='float32',
            threads=threads, friction_law='coulomb')
            for length in {1.0, *(stage.length for stage in config.stages)}
            for soon, world in ((False, self.world), (True, dry))}
        self.layout = Layout.of(body)
        self.evaluations, self.seconds = 0, 0.0
        #: Number of an individual -> its values (R,) in the scenario of now.
        self.values: dict[int, Array] = {}
        self.stage, self.scenario = self._situation(0)
        self.gain = self.config.touch_gain(0)

    def arrays(self, optimiser: Optimiser) -> dict[str, NDArray[np.generic]]:
        """Return what the population earned in the situations of now."""
        return {'values': np.array([self.values[int(number)]
                                    for number in optimiser.population.numbers])}

    def restore(self, arrays: dict[str, NDArray[Any]], optimiser: Optimiser) -> None:
        """Take up what `arrays` returned."""
        self.values = dict(zip(optimiser.population.numbers.tolist(), arrays['values'],
                               strict=True))
        last = max(0, optimiser.generation - 1)
        self.stage, self.scenario = self._situation(last)
        self.gain = self.config.touch_gain(last)

    def _situation(self, generation: int) -> tuple[Stage, Scenario]:
        """Return the stage of a generation and the scenario drawn for it."""
        stage, _begin = self.config.stage_at(generation)
        rng = treatments.generator(self.config.seed, treatments.VARIATIONS,
                                   self.config.drawn_at(generation))
        means = self.config.randomisation
        if not stage.vectors:
            means = replace(means, vectors=False)
        return stage, self.draw(rng, means, stage.moves, stage.stops)

    def draw(self, rng: np.random.Generator, means: Randomisation, moves: int,
             stops: int) -> Scenario:
        """Return situations with these means, `moves` a direction and `stops`."""
        return draw(rng, self.heard, self.world, means, moves=moves, stops=stops,
                    move_noise=self.config.move_noise)

    def earned(self, genomes: Array, scenario: Scenario, stage: Stage) -> Array:
        """Return the values (N, R) of genomes in each situation, see `objective`."""
        began = perf_counter()
        network = self.layout.network(touch.felt(genomes, self.layout, self.gain))
        earned = np.empty((len(genomes), len(scenario)))
        for soon in (False, True):
            chosen = np.flatnonzero(scenario.contact_soon == soon)
            if not len(chosen):
                continue
            part = scenario.take(chosen)
            outcome = self.engines[stage.length, soon].evaluate(
                network, part.signals, (Start(),), part.engine_variations())
            earned[:, chosen] = values(outcome, part.directions, stage.clip_m, stage.length,
                                       stage.stray_weight, stage.free_stray_m)
        self.evaluations += earned.size
        self.seconds += perf_counter() - began
        return earned

    def _fitness(self, earned: Array, directions: NDArray[np.int64]) -> Array:
        return fitness(earned, directions, self.config.aggregate)

    def begin(self, optimiser: Optimiser) -> None:
        """Draw situations anew where they are due, and score the population in them."""
        generation = optimiser.generation
        if self.config.drawn_at(generation) != generation:
            return
        before = self.gain
        self.stage, self.scenario = self._situation(generation)
        self.gain = self.config.touch_gain(generation)
        if not len(optimiser.population):
            return
        if before == 0.0 and self.gain > 0.0 and generation:
            optimiser.population = touch.begin_to_feel(
                optimiser.population, self.layout,
                treatments.generator(self.config.seed, treatments.VARIATIONS, 2**30),
                self.config.touch)
        population = optimiser.population
        now = self.earned(population.genomes, self.scenario, self.stage)
        self.values = dict(zip(population.numbers.tolist(), now, strict=True))
        newest = self._fitness(now, self.scenario.directions)
        old = population.fitness
        # What was earned while less was felt counts no more.
        known = np.isfinite(old) & (old > REJECTED) & (self.gain == before)
        weight = self.config.newest
        mean = np.where(known, (1 - weight) * np.where(known, old, 0.0) + weight * newest, newest)
        optimiser.population = replace(population, fitness=mean)

    def judge(self, genomes: Array, optimiser: Optimiser) -> Array:
        """Return the fitness (N,) of the genomes (N, G) that were asked for."""
        scenario, stage, population = self.scenario, self.stage, optimiser.population
        new = np.flatnonzero(np.isnan(population.fitness))
        known = {int(number): (float(score), self.values[int(number)]) for number, score in zip(
            population.numbers, population.fitness, strict=True) if score > REJECTED}
        first = _first_third(scenario.directions)
        rest = np.setdiff1d(np.arange(len(scenario)), first)
        seen = np.full((len(genomes), len(scenario)), np.nan)
        seen[:, first] = self.earned(genomes, scenario.take(first), stage)
        early = self._fitness(seen[:, first], scenario.directions[first])
        tried = np.ones(len(genomes), dtype=np.bool_)
        for index, parent in enumerate(population.parents[new].tolist()):
            if parent in known:
                bar = self._fitness(known[parent][1][None, first], scenario.directions[first])[0]
                tried[index] = early[index] > bar - self.config.tolerance
        if tried.any():
            seen[np.ix_(tried, rest)] = self.earned(genomes[tried], scenario.take(rest), stage)
        scores = np.full(len(genomes), REJECTED)
        scores[tried] = self._fitness(seen[tried], scenario.directions)
        for index in np.flatnonzero(tried).tolist():
            parent = int(population.parents[new[index]])
            if parent in known:
                score, met = known[parent]
                # A draw that is hard on the parent must not make an idle child look better than
                # both have ever been, nor an easy draw a lucky child.
                paired = score + scores[index] - self._fitness(met[None], scenario.directions)[0]
                scores[index] = min(scores[index], paired)
            self.values[int(population.numbers[new[index]])] = seen[index]
        return scores

    def end(self, optimiser: Optimiser) -> None:
        """Keep the values of those who are left."""
        nothing = np.full(len(self.scenario), REJECTED)
        self.values = {int(number): self.values.get(int(number), nothing)
                       for number in optimiser.population.numbers}

    def ranked(self, genomes: Array) -> tuple[Network, Array]:
        """Return the networks and fitness of genomes, best first in a last, larger draw."""
        score = self.examine(genomes, self.config.randomisation)
        order = np.argsort(-score, kind='stable')
        return (self.layout.network(touch.felt(genomes[order], self.layout, self.gain)),
                score[order])

    def examine(self, genomes: Array, means: Randomisation) -> Array:
        """Return the fitness (N,) of genomes in 24 + 24 + 32 situations drawn with `means`."""
        rng = treatments.generator(self.config.seed, treatments.VARIATIONS, 2**31)
        scenario = self.draw(rng, means, 24, 32)
        return self._fitness(self.earned(genomes, scenario, replace(self.stage, length=1.0)),
                             scenario.directions)


def _first_third(directions: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the indices of the first third, at least one, of the situations of each kind."""
    chosen = []
    for direction in np.unique(directions):
        indices = np.flatnonzero(directions == direction)
        chosen.append(indices[:max(1, len(indices) // 3)])
    return np.sort(np.concatenate(chosen))
