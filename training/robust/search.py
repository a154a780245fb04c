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
- hidden weights that tell the words apart are evolved first, without a body (`listening`);
- stages: walking first without touch sensors in few situations, then in many, then with touch.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
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
from training.evolution.treatments import Words
from training.robust.careful import careful_mutation
from training.robust.listening import Listening, listen, newcomers
from training.robust.objective import FREE_STRAY_M, STRAY_WEIGHT, fitness, values
from training.robust.scenarios import DIRECTION, MOVE_NOISE, Randomisation, Scenario, draw
from w2b_controller import __version__
from w2b_controller.network import Network
from w2b_sim import bodies
from w2b_sim.engines.interface import Start
from w2b_sim.worlds import WORLDS, World

Array = NDArray[np.float64]

#: Given to a child that was rejected early: worse than any that was not.
REJECTED = -10.0
#: A child may be this much worse than its parent in the first situations and still be tried.
TOLERANCE = 0.01
#: Part of a stage's generations over which touch that was not felt before grows to its full size,
#: and standard deviations of the synapses that it begins with.
GROWING, TOUCH_SIZES = 0.7, (0.02, 0.04, 0.08)
#: How many of the best begin to feel.
WALKERS = 5
#: Weight of the newest draw in an individual's fitness.
NEWEST = 0.3


@dataclass(frozen=True)
class Stage:
    """
    A part of the robust training.

    `generations` long; `moves` situations a direction and `stops` for standing still, drawn anew
    every `redraw` generations (0: never, so that small gains are not lost in the luck of the draw),
    each for the share `length` of the world's steps; words as they are unless `vectors`; touch
    sensors read 0 unless `touch`; progress counts up to `clip_m`, extrapolated to the whole;
    straying under a stop word costs `stray_weight` for each metre beyond `free_stray_m`.
    """

    generations: int
    moves: int
    stops: int
    redraw: int
    touch: bool
    clip_m: float
    vectors: bool = True
    length: float = 1.0
    stray_weight: float = STRAY_WEIGHT
    free_stray_m: float = FREE_STRAY_M


#: Walk both ways, however slowly; harden; use the touch sensors, where the body has any. The clip
#: stays low: who gets far in some worlds only has learnt those worlds.
STAGES = (Stage(150, 6, 3, 0, False, 0.6, vectors=False), Stage(200, 9, 6, 15, False, 0.6),
          Stage(400, 9, 6, 12, True, 0.6))


@dataclass(frozen=True)
class RobustConfig:
    """
    What decides the outcome of a robust training run.

    Attributes
    ----------
    body, seed, world, vocabulary, population
        As in `RunConfig`.
    words
        (word, behaviour) pairs to train on.
    physics_steps
        Of one control period in training; 0 for the world's own.
    randomisation
        The means in use.
    listening
        Before the first stage.
    stages
        One after the other.
    move_noise
        As in `scenarios.draw`.
    careful
        Most children keep their parent's hidden weights, and none hears the words worse than its
        parent (`careful.careful_mutation`): for newcomers that hear well from the start.
    aggregate
        How three behaviours make one fitness, see `objective.fitness`.

    """

    body: str
    seed: int
    words: Words
    world: str = ''
    vocabulary: str = 'default'
    population: int = 50
    physics_steps: int = 0
    randomisation: Randomisation = field(default_factory=Randomisation)
    listening: Listening = field(default_factory=Listening)
    stages: tuple[Stage, ...] = STAGES
    move_noise: float = MOVE_NOISE
    careful: bool = False
    aggregate: str = 'balanced'

    def __post_init__(self) -> None:
        """Check the fields (ValueError, naming the field, with what was expected and what came)."""
        if self.world == '':
            object.__setattr__(self, 'world', bodies.get(self.body).world)
        if self.world not in WORLDS:
            raise ValueError(f'world: expected one of {", ".join(WORLDS)}, got {self.world!r}')
        missing = sorted(set(DIRECTION) - {behaviour for _word, behaviour in self.words})
        if missing:
            raise ValueError(f'words: expected at least one for each behaviour, got none for '
                             f'{missing[0]!r}')

    @property
    def generations(self) -> int:
        """Of all stages together."""
        return sum(stage.generations for stage in self.stages)

    def training_world(self) -> World:
        """Return the nominal world of the training."""
        world = WORLDS[self.world]
        return replace(world, physics_steps=self.physics_steps) if self.physics_steps else world

    def to_json(self) -> dict[str, Any]:
        """Return the configuration as a JSON object."""
        value = asdict(self)
        value['words'] = [list(pair) for pair in self.words]
        value['stages'] = [asdict(stage) for stage in self.stages]
        return value


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
        from w2b_controller.vocabulary import Vocabulary

        vocabulary = Vocabulary.load(config.vocabulary)
        vectors = {word: vocabulary.vector(word) for word, _behaviour in config.words}
    heard = {behaviour: np.array([np.asarray(vectors[word], dtype=np.float64)
                                  for word, asked in config.words if asked == behaviour])
             for behaviour in DIRECTION}
    identity = {'config': config.to_json(), 'program_version': __version__,
                'vectors': {word: treatments.vector_hash(vectors[word])
                            for word, _behaviour in config.words}}
    with RunDirectory(Path(directory), identity, may_grow=()) as place:
        search = RobustSearch(config, heard, place, threads)
        search.evolve(progress, checkpoint_s, stages)
        return search.ranked()


class RobustSearch:
    """A robust training run in memory."""

    def __init__(self, config: RobustConfig, heard: dict[str, Array], place: RunDirectory | None,
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
                         mutation=careful_mutation(heard, self.layout.hidden_count)
                         if config.careful else mutate_mixed,
                         newcomers=self._newcomers())
        self.evaluations = 0
        #: Number of an individual -> its values (R,) in the scenario of now.
        self.values: dict[int, Array] = {}
        self.stage, self.scenario = self._situation(0)
        self.gain = self._gain(0)
        state = place.resume(self.rng) if place is not None else None
        if state is not None:
            self._restore(state)

    def _newcomers(self) -> Newcomers:
        config = self.config
        listeners = self._listeners_file()
        if listeners is None and not config.listening.attempts:
            return random_genomes
        if listeners is None:
            listeners = listen(self.layout, config.listening, config.seed,
                               lambda rng, moves, stops: self._draw(
                                   rng, config.randomisation, moves, stops))
            if self.place is not None:
                save_array(self.place.path / 'listeners.npy', listeners)
        return newcomers(listeners)

    def _listeners_file(self) -> Array | None:
        path = self.place.path / 'listeners.npy' if self.place is not None else None
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
        self.gain = self._gain(max(0, self.afpo.generation - 1))

    def _situation(self, generation: int) -> tuple[Stage, Scenario]:
        """Return the stage of a generation and the scenario drawn for it."""
        begin = 0
        stage = self.config.stages[-1]
        for stage in self.config.stages:
            if generation < begin + stage.generations:
                break
            begin += stage.generations
        drawn = generation - (generation - begin) % stage.redraw if stage.redraw else begin
        rng = treatments.generator(self.config.seed, treatments.VARIATIONS, drawn)
        means = self.config.randomisation
        if not stage.vectors:
            means = replace(means, vectors=False)
        return stage, self._draw(rng, means, stage.moves, stage.stops)

    def _draw(self, rng: np.random.Generator, means: Randomisation, moves: int,
              stops: int) -> Scenario:
        return draw(rng, self.heard, self.world, means, moves=moves, stops=stops,
                    move_noise=self.config.move_noise)

    def _is_new(self, generation: int) -> bool:
        """Whether a generation's scenario is not the one of the generation before."""
        begin = 0
        for stage in self.config.stages:
            if begin <= generation < begin + stage.generations:
                return (generation - begin) % (stage.redraw or stage.generations) == 0
            begin += stage.generations
        return False

    def judge(self, genomes: Array, scenario: Scenario, stage: Stage) -> Array:
        """Return the values (N, R) of genomes in each situation, see `objective`."""
        network = self.layout.network(self._felt(genomes))
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

    def _felt(self, genomes: Array) -> Array:
        """Return the genomes with the sensors' synapses scaled to what is felt now."""
        if self.gain == 1.0 or not self.layout.sensor_count:
            return genomes
        felt = genomes.copy()
        self._touch(felt)[:] *= self.gain
        return felt

    def _touch(self, genomes: Array) -> Array:
        """Return a view (N, H, S) of the synapses of the sensors."""
        hidden, inputs = self.layout.hidden_shape
        weights = genomes.reshape(len(genomes), -1)[:, :hidden * inputs]
        strides = (weights.strides[0], inputs * weights.strides[1], weights.strides[1])
        every = np.lib.stride_tricks.as_strided(weights, (len(genomes), hidden, inputs), strides)
        return every[..., hidden + 1:]

    def _gain(self, generation: int) -> float:
        """
        Return the share of the touch sensors' signals that is felt in a generation.

        A stage with touch that follows one without lets it grow, a step at each draw, over the
        first part of its generations: a gait is at stake.
        """
        begin, before = 0, True
        stage = self.config.stages[-1]
        for stage in self.config.stages:
            if generation < begin + stage.generations:
                break
            begin, before = begin + stage.generations, stage.touch
        if before or not stage.touch or not stage.redraw:
            return float(stage.touch)
        steps = int(np.ceil(GROWING * stage.generations / stage.redraw))
        return min(1.0, ((generation - begin) // stage.redraw + 1) / steps)

    def _begin_to_feel(self) -> None:
        """
        Let the best walkers feel: each in many copies, with small synapses drawn anew for each.

        Most synapses upset a gait; which do not is found by trying many.
        """
        population = self.afpo.population
        best = np.argsort(-population.fitness, kind='stable')[:WALKERS]
        chosen = best[np.arange(len(population)) % len(best)]
        genomes = population.genomes[chosen]
        rng = treatments.generator(self.config.seed, treatments.VARIATIONS, 2**30)
        touch = self._touch(genomes)
        size = rng.choice(TOUCH_SIZES, len(genomes))[:, None, None]
        touch[:] = size * rng.standard_normal(touch.shape)
        self.afpo.population = replace(population, genomes=genomes, ages=population.ages[chosen])

    def evolve(self, progress: Callable[[Progress], None] | None = None,
               checkpoint_s: float = 10.0, stages: int | None = None) -> None:
        """Run the generations that are left of the first `stages` stages."""
        began = saved = perf_counter()
        total = sum(stage.generations for stage in self.config.stages[:stages])
        while self.afpo.generation < total:
            if self._is_new(self.afpo.generation):
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
        self.gain = self._gain(self.afpo.generation)
        if before == 0.0 and self.gain > 0.0 and self.afpo.generation:
            self._begin_to_feel()
        population = self.afpo.population
        now = self.judge(population.genomes, self.scenario, self.stage)
        self.values = dict(zip(population.numbers.tolist(), now, strict=True))
        newest = self._fitness(now, self.scenario.directions)
        old = population.fitness
        # What was earned while less was felt counts no more.
        known = np.isfinite(old) & (old > REJECTED) & (self.gain == before)
        mean = np.where(known, (1 - NEWEST) * np.where(known, old, 0.0) + NEWEST * newest, newest)
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
                tried[index] = early[index] > bar - TOLERANCE
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
        """Return the population's networks and fitness, best first in 24 + 24 + 32 situations."""
        stage = replace(self.stage, length=1.0)
        rng = treatments.generator(self.config.seed, treatments.VARIATIONS, 2**31)
        scenario = self._draw(rng, self.config.randomisation, 24, 32)
        genomes = self.afpo.population.genomes
        score = self._fitness(self.judge(genomes, scenario, stage), scenario.directions)
        genomes = self._felt(genomes)
        order = np.argsort(-score, kind='stable')
        return self.layout.network(genomes[order]), score[order]


def _first_third(directions: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the indices of the first third, at least one, of the situations of each kind."""
    chosen = []
    for direction in np.unique(directions):
        indices = np.flatnonzero(directions == direction)
        chosen.append(indices[:max(1, len(indices) // 3)])
    return np.sort(np.concatenate(chosen))


__all__ = ['STAGES', 'RobustConfig', 'RobustSearch', 'Stage', 'train']
