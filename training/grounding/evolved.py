"""
The evolved rivals: ear and legs in one network, trained and judged by what the quadruped does.

Serial priming is the paper's: the elements of a word's vector pass one after the other through one
auditory neuron, before the body moves. The wide input is what its discussion proposes: every
element has a synapse of its own onto every neuron and is heard at every step. Both are evolved by
AFPO in the paper's world on k words a behaviour, each of another stem family, with the published
objective; then all words of the other families are said. A robot that ends within `STILL_M` of its
start has taken the word for stop, else for the way it went.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from training.evolution.afpo import Afpo
from training.evolution.operators import Layout, mutate_mixed, random_genomes
from training.grounding.accuracy import INTERVAL
from training.grounding.lexicon import Lexicon
from w2b_core import bodies
from w2b_core.hearing.metric import unit
from w2b_core.network.leaky import BLOCKS, LeakyNetwork
from w2b_core.vocabulary import Vocabulary
from w2b_sim.engines.batched.leaky_engine import LeakyEngine
from w2b_sim.engines.interface import Start
from w2b_sim.engines.registry import make_evaluator
from w2b_sim.worlds import PAPER

Array = NDArray[np.float64]

BODY = 'quadruped'
#: The quadruped's trained gaits go several metres in the 25 s of an evaluation.
STILL_M = 0.3
#: A step longer than this is an explosion: the word earns nothing.
LARGEST_STEP_M = 0.1
CAPACITY = 50


class Rival(Protocol):
    """A network that hears vectors, and the body that it moves."""

    layout: Layout

    def ways(self, genomes: Array, vectors: Array) -> tuple[Array, Array]:
        """Return displacements (C, W, 2) and path lengths (C, W) of genomes under words."""

    def mutate(self, rng: np.random.Generator, genomes: Array, layout: Layout) -> Array:
        """Return mutated copies of genomes."""

    def newcomers(self, rng: np.random.Generator, count: int, layout: Layout) -> Array:
        """Return new genomes."""


class Serial:
    """The paper's network, primed element by element."""

    def __init__(self, threads: int) -> None:
        body = bodies.get(BODY)
        self.layout = Layout.of(body)
        self._evaluator = make_evaluator('batched', body, PAPER, threads=threads)

    def ways(self, genomes: Array, vectors: Array) -> tuple[Array, Array]:
        """See `Rival`."""
        outcome = self._evaluator.evaluate(self.layout.network(genomes), vectors, (Start(),))
        sound = outcome.largest_step_m[..., 0] <= LARGEST_STEP_M
        return (np.where(sound[..., None], outcome.final_position_m[..., 0, :2], 0.0),
                np.where(sound, outcome.path_length_m[..., 0], 0.0))

    def mutate(self, rng: np.random.Generator, genomes: Array, layout: Layout) -> Array:
        """See `Rival`."""
        return mutate_mixed(rng, genomes, layout)

    def newcomers(self, rng: np.random.Generator, count: int, layout: Layout) -> Array:
        """See `Rival`."""
        return random_genomes(rng, count, layout)


class Wide:
    """A leaky network with a synapse from every element of the vector, heard at every step."""

    def __init__(self, threads: int, length: int) -> None:
        body = bodies.get(BODY)
        self.layout = Layout.of(body)  # what AFPO carries along; the genome is `_sizes`
        sizes = {'H': body.hidden_neurons, 'K': length, 'S': len(body.sensors),
                 'M': len(body.joints)}
        self._shapes = {block.name: tuple(sizes[axis] for axis in block.shape) for block in BLOCKS}
        self._engine = LeakyEngine(body, PAPER, hidden=sizes['H'], senses=body.sensors,
                                   behaviours=tuple(f'element_{i}' for i in range(length)),
                                   threads=threads)

    def ways(self, genomes: Array, vectors: Array) -> tuple[Array, Array]:
        """See `Rival`."""
        seconds = PAPER.steps * PAPER.control_period_s
        recording = self._engine.record(self._network(genomes), unit(vectors)[:, None], [seconds])
        place = recording.position_m[:, :, 0, :, :2].astype(np.float64)
        steps = np.linalg.norm(np.diff(place, axis=-2), axis=-1)
        sound = steps.max(axis=-1) <= LARGEST_STEP_M
        way = place[..., -1, :] - place[..., 0, :]
        return np.where(sound[..., None], way, 0.0), np.where(sound, steps.sum(axis=-1), 0.0)

    def mutate(self, rng: np.random.Generator, genomes: Array, layout: Layout) -> Array:
        """See `Rival`: one block of each copy, all of it a little or one synapse much."""
        children = genomes.copy()
        starts = np.cumsum([0, *(int(np.prod(shape)) for shape in self._shapes.values())])
        for child in children:
            block = rng.integers(len(self._shapes))
            part = child[starts[block]:starts[block + 1]]
            if rng.random() < 0.5:
                part += 0.1 * rng.standard_normal(part.shape)
            elif part.size:
                one = rng.integers(part.size)
                part[one] += (abs(part[one]) + 0.1) * rng.standard_normal()
        return children

    def newcomers(self, rng: np.random.Generator, count: int, layout: Layout) -> Array:
        """See `Rival`."""
        size = sum(int(np.prod(shape)) for shape in self._shapes.values())
        return rng.standard_normal((count, size))

    def _network(self, genomes: Array) -> LeakyNetwork:
        """Return the batch of networks; numbers outside a block's range are at its ends."""
        blocks, first = {}, 0
        for block in BLOCKS:
            shape = self._shapes[block.name]
            last = first + int(np.prod(shape))
            values = genomes[:, first:last].reshape(len(genomes), *shape)
            blocks[block.name] = np.clip(values, block.low, block.high)
            first = last
        return LeakyNetwork(**blocks)


def measure(words: Lexicon, vocabulary: Vocabulary, *, count: int, generations: int, seeds: int,
            threads: int = 1, say: Callable[[str], None] = lambda text: None) -> dict[str, Any]:
    """
    Return the evolved rivals' accuracy by name and number of words, as JSON values.

    Parameters
    ----------
    words, vocabulary
        What is judged.
    count, generations, seeds
        Words a behaviour, length of a run, and runs, each on other words.
    threads
        Of the engine.
    say
        Hears of each run.

    """
    makers: dict[str, Callable[[], Rival]] = {
        'serial priming, evolved, closed loop': lambda: Serial(threads),
        'wide input, evolved, closed loop': lambda: Wide(threads, vocabulary.dimensions)}
    found: dict[str, Any] = {}
    for name, make in makers.items():
        rival, runs = make(), []
        for seed in range(seeds):
            heard, asked = _draw(words, count, seed)
            runs.append(_run(rival, words, vocabulary, heard, asked, generations, seed))
            say(f'{name}, seed {seed}: {runs[-1][0]:.3f} of unheard words, {runs[-1][1]:.3f} of '
                'its own')
        unheard, own = (np.array(column) for column in zip(*runs, strict=True))
        low, high = np.percentile(unheard, INTERVAL)
        found[name] = {str(count): {
            'macro': float(unheard.mean()), 'low': float(low), 'high': float(high),
            'trained': float(own.mean()), 'seeds': seeds, 'generations': generations}}
    return found


def _draw(words: Lexicon, count: int, seed: int) -> tuple[list[str], list[str]]:
    """Return heard words, `count` a behaviour from other families each, and all unheard ones."""
    draw = np.random.default_rng(seed)
    heard: list[str] = []
    asked: list[str] = []
    for behaviour in words.scored:
        families = words.of(behaviour)
        names = sorted(families)
        if len(names) <= count:
            raise ValueError(f'{behaviour}: expected more than {count} families, got {len(names)}')
        chosen = {names[index] for index in draw.choice(len(names), count, replace=False)}
        heard += [families[name][int(draw.integers(len(families[name])))] for name in names
                  if name in chosen]
        asked += [word for name in names if name not in chosen for word in families[name]]
    return heard, asked


def _run(rival: Rival, words: Lexicon, vocabulary: Vocabulary, heard: Sequence[str],
         asked: Sequence[str], generations: int, seed: int) -> tuple[float, float]:
    """Evolve one controller; return its macro accuracy on unheard words and on its own."""
    vectors = vocabulary.matrix(heard).astype(np.float64)
    kinds = np.array([words.words[word].behaviour for word in heard])
    search = Afpo(rival.layout, np.random.default_rng(seed), capacity=CAPACITY,
                  mutation=rival.mutate, newcomers=rival.newcomers)
    for _ in range(generations):
        way, path = rival.ways(search.ask(), vectors)
        search.tell(_earned(way, path, kinds).sum(axis=-1))
    best = search.population.genomes[search.population.best][None]
    scores = []
    for group in (asked, heard):
        way, _path = rival.ways(best, vocabulary.matrix(group).astype(np.float64))
        scores.append(_accuracy(way[0], [words.words[word].behaviour for word in group],
                                words.scored))
    return scores[0], scores[1]


def _earned(way: Array, path: Array, kinds: NDArray[np.str_]) -> Array:
    """Return what words (C, W) earn by the published objective."""
    return np.where(kinds == 'stop', -path, np.where(kinds == 'forward', way[..., 0],
                                                     -way[..., 0]))


def _accuracy(way: Array, kinds: Sequence[str], behaviours: Sequence[str]) -> float:
    """Return the mean of the behaviours' shares of words that were obeyed."""
    taken = np.where(np.linalg.norm(way, axis=-1) <= STILL_M, 'stop',
                     np.where(way[:, 0] > 0, 'forward', 'backward'))
    asked = np.array(kinds)
    return float(np.mean([(taken[asked == name] == name).mean() for name in behaviours]))
