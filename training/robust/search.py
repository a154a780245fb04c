"""
The robust training mode: controllers that keep walking in another simulator.

AFPO as in a plain run, but each generation is judged in many drawn situations (`scenarios`), and:

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

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from training.evolution import treatments
from training.evolution.afpo import Afpo, Newcomers
from training.evolution.checkpoint import CheckpointError, save_array
from training.evolution.operators import Layout, mutate_mixed, random_genomes
from training.evolution.run import Progress
from training.evolution.rundir import RunDirectory
from training.robust import touch
from training.robust.careful import careful_mutation
from training.robust.config import RobustConfig
from training.robust.objective import fitness, values
from training.robust.pretraining import listen, newcomers
from training.robust.scenarios import Scenario, by_direction, draw
from training.robust.settings import Randomisation, Stage
from w2b_core import __version__, bodies
from w2b_core.network import Network
from w2b_sim.engines.interface import Start

Array = NDArray[np.float64]

#: File in a run's directory: pretrained hidden weights (N, H, H + 1) that newcomers start from.
LISTENERS = 'listeners.npy'
#: Given to a child that was rejected early: worse than any that was not.
REJECTED = -10.0


def train(config: RobustConfig, directory: Path | str,
          progress: Callable[[Progress], None] | None = None, *, threads: int = 1,
          checkpoint_s: float = 10.0, vectors: Mapping[str, ArrayLike] | None = None,
          stages: int | None = None) -> tuple[Network, Array]:
    """
    Run `config` in `directory`, or go on with it there, for all or the first `stages` stages.

    Returns the population's networks (N, ...) and fitness (N,) in a last, larger draw of
    situations, best first.

    Raises
    ------
    RunConflictError, CheckpointError, ValueError
        As `training.evolution.run.run`.

    """
    if vectors is None:
        from w2b_core.vocabulary import Vocabulary

        vocabulary = Vocabulary.load(config.vocabulary)
        vectors = {word: vocabulary.vector(word) for word, _behaviour in config.words}
    heard = by_direction(config.words, vectors)
    identity = {'config': config.to_json(), 'program_version': __version__,
                'vectors': {word: treatments.vector_hash(vectors[word])
                            for word, _behaviour in config.words}}
    with RunDirectory(Path(directory), identity, may_grow=()) as place:
        search = RobustSearch(config, heard, place, threads)
        search.evolve(progress, checkpoint_s, stages)
        return search.ranked()


class RobustSearch:
    """A robust training run in memory."""

    def __init__(self, config: RobustConfig, heard: Mapping[int, Array], place: RunDirectory | None,
                 threads: int = 1) -> None:
        from w2b_sim.engines.batched import BatchedEngine

        self.config, self.heard, self.place = config, heard, place
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
        self.rng = treatments.generator(config.seed, treatments.EVOLUTION)
        self.afpo = Afpo(self.layout, self.rng, capacity=config.population,
                         mutation=mutate_mixed if config.careful is None else careful_mutation(
                             config.careful, heard, self.layout.hidden_count),
                         newcomers=self._newcomers())
        self.evaluations = 0
        #: Number of an individual -> its values (R,) in the scenario of now.
        self.values: dict[int, Array] = {}
        self.stage, self.scenario = self._situation(0)
        self.gain = self.config.touch_gain(0)
        state = place.resume(self.rng) if place is not None else None
        if state is not None:
            self._restore(state)

    def _newcomers(self) -> Newcomers:
        config = self.config
        listeners = self._listeners_file()
        if listeners is None and not config.pretraining.attempts:
            return random_genomes
        if listeners is None:
            listeners = listen(self.layout, config.pretraining, config.seed,
                               lambda rng, moves, stops: self._draw(
                                   rng, config.randomisation, moves, stops))
            if self.place is not None:
                save_array(self.place.path / LISTENERS, listeners)
        return newcomers(listeners)

    def _listeners_file(self) -> Array | None:
        path = self.place.path / LISTENERS if self.place is not None else None
        if path is None or not path.exists():
            return None
        listeners: Array = np.load(path, allow_pickle=False)
        return listeners

    def _restore(self, state: dict[str, NDArray[Any]]) -> None:
        try:
            self.afpo.restore(state)
            self.values = dict(zip(self.afpo.population.numbers.tolist(), state['values'],
                                   strict=True))
        except (KeyError, ValueError) as error:
            raise CheckpointError(f'checkpoint: does not belong to this run ({error}); delete it '
                                  'to start again from the first generation') from None
        self.stage, self.scenario = self._situation(max(0, self.afpo.generation - 1))
        self.gain = self.config.touch_gain(max(0, self.afpo.generation - 1))

    def _situation(self, generation: int) -> tuple[Stage, Scenario]:
        """Return the stage of a generation and the scenario drawn for it."""
        stage, _begin = self.config.stage_at(generation)
        rng = treatments.generator(self.config.seed, treatments.VARIATIONS,
                                   self.config.drawn_at(generation))
        means = self.config.randomisation
        if not stage.vectors:
            means = replace(means, vectors=False)
        return stage, self._draw(rng, means, stage.moves, stage.stops)

    def _draw(self, rng: np.random.Generator, means: Randomisation, moves: int,
              stops: int) -> Scenario:
        return draw(rng, self.heard, self.world, means, moves=moves, stops=stops,
                    move_noise=self.config.move_noise)

    def judge(self, genomes: Array, scenario: Scenario, stage: Stage) -> Array:
        """Return the values (N, R) of genomes in each situation, see `objective`."""
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
        return earned

    def _fitness(self, earned: Array, directions: NDArray[np.int64]) -> Array:
        return fitness(earned, directions, self.config.aggregate)

    def evolve(self, progress: Callable[[Progress], None] | None = None,
               checkpoint_s: float = 10.0, stages: int | None = None) -> None:
        """Run the generations that are left of the first `stages` stages."""
        began = saved = perf_counter()
        total = sum(stage.generations for stage in self.config.stages[:stages])
        while self.afpo.generation < total:
            if self.config.drawn_at(self.afpo.generation) == self.afpo.generation:
                self._rescore()
            self._generation()
            now = perf_counter()
            if self.place is not None and (now - saved >= checkpoint_s
                                           or self.afpo.generation == total):
                self._save(self.place)
                saved = perf_counter()
            if progress is not None:
                best = self.afpo.population.fitness[self.afpo.population.best]
                progress(Progress(self.afpo.generation, total, float(best), self.evaluations,
                                  now - began))

    def _rescore(self) -> None:
        """Draw anew and score everybody in it."""
        before = self.gain
        self.stage, self.scenario = self._situation(self.afpo.generation)
        self.gain = self.config.touch_gain(self.afpo.generation)
        if before == 0.0 and self.gain > 0.0 and self.afpo.generation:
            self.afpo.population = touch.begin_to_feel(
                self.afpo.population, self.layout,
                treatments.generator(self.config.seed, treatments.VARIATIONS, 2**30),
                self.config.touch)
        population = self.afpo.population
        now = self.judge(population.genomes, self.scenario, self.stage)
        self.values = dict(zip(population.numbers.tolist(), now, strict=True))
        newest = self._fitness(now, self.scenario.directions)
        old = population.fitness
        # What was earned while less was felt counts no more.
        known = np.isfinite(old) & (old > REJECTED) & (self.gain == before)
        weight = self.config.newest
        mean = np.where(known, (1 - weight) * np.where(known, old, 0.0) + weight * newest, newest)
        self.afpo.population = replace(population, fitness=mean)

    def _generation(self) -> None:
        scenario, stage = self.scenario, self.stage
        genomes = self.afpo.ask()
        population = self.afpo.population
        new = np.flatnonzero(np.isnan(population.fitness))
        known = {int(number): (float(score), self.values[int(number)]) for number, score in zip(
            population.numbers, population.fitness, strict=True) if score > REJECTED}
        first = _first_third(scenario.directions)
        rest = np.setdiff1d(np.arange(len(scenario)), first)
        seen = np.full((len(genomes), len(scenario)), np.nan)
        seen[:, first] = self.judge(genomes, scenario.take(first), stage)
        early = self._fitness(seen[:, first], scenario.directions[first])
        tried = np.ones(len(genomes), dtype=np.bool_)
        for index, parent in enumerate(population.parents[new].tolist()):
            if parent in known:
                bar = self._fitness(known[parent][1][None, first], scenario.directions[first])[0]
                tried[index] = early[index] > bar - self.config.tolerance
        if tried.any():
            seen[np.ix_(tried, rest)] = self.judge(genomes[tried], scenario.take(rest), stage)
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
        self.afpo.tell(scores)
        nothing = np.full(len(scenario), REJECTED)
        self.values = {int(number): self.values.get(int(number), nothing)
                       for number in self.afpo.population.numbers}

    def _save(self, place: RunDirectory) -> None:
        state = self.afpo.arrays()
        state['values'] = np.array([self.values[int(number)]
                                    for number in self.afpo.population.numbers])
        place.save(state, self.rng)

    def ranked(self) -> tuple[Network, Array]:
        """Return the population's networks and fitness, best first in a last, larger draw."""
        genomes = self.afpo.population.genomes
        score = self.examine(genomes, self.config.randomisation)
        order = np.argsort(-score, kind='stable')
        return (self.layout.network(touch.felt(genomes[order], self.layout, self.gain)),
                score[order])

    def examine(self, genomes: Array, means: Randomisation) -> Array:
        """Return the fitness (N,) of genomes in 24 + 24 + 32 situations drawn with `means`."""
        rng = treatments.generator(self.config.seed, treatments.VARIATIONS, 2**31)
        scenario = self._draw(rng, means, 24, 32)
        return self._fitness(self.judge(genomes, scenario, replace(self.stage, length=1.0)),
                             scenario.directions)


def _first_third(directions: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the indices of the first third, at least one, of the situations of each kind."""
    chosen = []
    for direction in np.unique(directions):
        indices = np.flatnonzero(directions == direction)
        chosen.append(indices[:max(1, len(indices) // 3)])
    return np.sort(np.concatenate(chosen))
