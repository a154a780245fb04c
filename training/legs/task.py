"""The task: genomes walk under drawn commands in drawn situations, and earn a fitness."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise, product

import numpy as np
from numpy.typing import NDArray

from training.legs.parts import Stage
from training.legs.recipe import Recipe
from training.legs.scores import Scores
from training.legs.situations import draw
from w2b_core import bodies
from w2b_core.network.leaky import LeakyNetwork
from w2b_core.network.symmetry import SignedPermutation
from w2b_sim.engines.batched.leaky_engine import LeakyEngine
from w2b_sim.engines.batched.leaky_variations import LeakyVariations
from w2b_sim.recording import PhaseOutcome, Recording, phase_outcome
from w2b_sim.worlds import WORLDS

Array = NDArray[np.float64]

#: Free numbers beyond this are drawn back, so that none runs away.
LARGE_WEIGHT, LARGE_WEIGHT_COST = 4.0, 0.002


@dataclass(frozen=True)
class Trial:
    """
    What a generation meets.

    `words` (W, P) are numbers of behaviours, `commands` (W, P, behaviours) with what is blended in,
    `seconds` (P,) of each phase.
    """

    words: NDArray[np.int64]
    commands: Array
    seconds: tuple[float, ...]
    situations: LeakyVariations


@dataclass(frozen=True)
class Earned:
    """
    What candidates earned: `fitness` (C,), `scores` behaviour -> (C,), and the phases' figures.

    `phases` behaviour -> outcomes with the leading axes (C, sequences, situations).
    """

    fitness: Array
    scores: dict[str, Array]
    phases: dict[str, list[PhaseOutcome]]


class Task:
    """A recipe's evaluations, in engines that are compiled once for all its stages."""

    def __init__(self, recipe: Recipe, threads: int = 1) -> None:
        self.recipe, self.threads = recipe, threads
        self.body, self.world = bodies.get(recipe.body), WORLDS[recipe.world]
        if self.world.friction is None and recipe.worlds.dry_friction is not None:
            self.world = replace(self.world, friction=recipe.worlds.dry_friction)
        self.sharing = recipe.sharing()
        self.scores = Scores(recipe)
        self.evaluations = 0
        self._images = [mirror.behaviours(recipe.behaviours) for mirror in recipe.mirrors()]
        self._engines: dict[int, LeakyEngine] = {}

    def engine(self, physics_steps: int) -> LeakyEngine:
        """Return the engine with so many physics steps in a control period."""
        if physics_steps not in self._engines:
            self._engines[physics_steps] = LeakyEngine(
                self.body, self.world, hidden=self.sharing.hidden.count,
                senses=self.recipe.senses, behaviours=self.recipe.behaviours,
                threads=self.threads, physics_steps=physics_steps,
                friction_law='coulomb')
        return self._engines[physics_steps]

    def compile(self) -> None:
        """Compile the engine, or load its kept code, so that processes need not do it at once."""
        stage = self.recipe.stages[0].model_copy(update={
            'phases': (4 * self.world.control_period_s,), 'situations': 1})
        self.run(np.zeros((1, self.sharing.size)), self.trial(stage, np.random.default_rng(0)),
                 stage.physics_steps)

    def sequences(self, phases: int) -> NDArray[np.int64]:
        """Return all sequences (W, P) of differing commands, one of those that mirror others."""
        found: list[tuple[int, ...]] = []
        seen: set[tuple[int, ...]] = set()
        for words in product(range(len(self.recipe.behaviours)), repeat=phases):
            if words in seen or any(a == b for a, b in pairwise(words)):
                continue
            found.append(words)
            seen |= _images(words, self._images)
        return np.array(found)

    def trial(self, stage: Stage, rng: np.random.Generator) -> Trial:
        """Draw what a generation of a stage meets."""
        words = self.sequences(len(stage.phases))
        if stage.sequences is not None and stage.sequences < len(words):
            words = words[np.sort(rng.choice(len(words), stage.sequences, replace=False))]
        return Trial(words, self._commands(words, stage.blend, rng), stage.phases,
                     self._draw(stage.situations, rng))

    def examination(self, seconds: tuple[float, ...], situations: int,
                    rng: np.random.Generator) -> Trial:
        """Draw an examination: every behaviour, clear commands, many situations."""
        words = np.arange(len(self.recipe.behaviours))[:, None]
        return Trial(words, self._commands(words, 0.0, rng), seconds, self._draw(situations, rng))

    def _draw(self, count: int, rng: np.random.Generator) -> LeakyVariations:
        return draw(self.recipe.worlds, self.world, len(self.body.joints), count, rng,
                    touch=any(sense.startswith('touch:') for sense in self.recipe.senses))

    def _commands(self, words: NDArray[np.int64], blend: float, rng: np.random.Generator) -> Array:
        clear = np.eye(len(self.recipe.behaviours))[words]
        share = rng.uniform(0.0, blend, (*words.shape, 1)) * (rng.random((*words.shape, 1)) < 0.5)
        others = rng.dirichlet(np.ones(clear.shape[-1]), words.shape)
        blended: Array = (1 - share) * clear + share * others
        return blended

    def run(self, genomes: Array, trial: Trial, physics_steps: int) -> Earned:
        """Return what genomes (C, G) earn in a trial."""
        recording = self.record(self.sharing.network(genomes), trial, physics_steps)
        earned = self.judge(recording, trial)
        large = np.square(np.maximum(np.abs(genomes) - LARGE_WEIGHT, 0)).mean(1)
        return Earned(earned.fitness - LARGE_WEIGHT_COST * large, earned.scores, earned.phases)

    def record(self, network: LeakyNetwork, trial: Trial, physics_steps: int) -> Recording:
        """Return the recordings (C, W, K, ...) of networks (C, ...) in a trial."""
        recording = self.engine(physics_steps).record(network, trial.commands, trial.seconds,
                                                      variations=trial.situations)
        self.evaluations += int(np.prod(recording.position_m.shape[:3]))
        return recording

    def judge(self, recording: Recording, trial: Trial) -> Earned:
        """Return what recordings (C, W, K, ...) of a trial earn; no weights are judged."""
        edges = np.round(np.cumsum([0.0, *trial.seconds]) / recording.period_s).astype(int)
        scores: dict[str, list[Array]] = {}
        phases: dict[str, list[PhaseOutcome]] = {}
        for phase, (first, last) in enumerate(pairwise(edges)):
            for number in np.unique(trial.words[:, phase]):
                behaviour = self.recipe.behaviours[number]
                chosen = np.flatnonzero(trial.words[:, phase] == number)
                did = phase_outcome(recording.take(np.s_[:, chosen]), int(first), int(last))
                score = self.scores.score(behaviour, did, self.held(behaviour, trial))
                scores.setdefault(behaviour, []).append(score.reshape(len(score), -1))
                phases.setdefault(behaviour, []).append(did)
        means = {behaviour: np.concatenate(parts, 1).mean(1)
                 for behaviour, parts in scores.items()}
        table = np.stack(list(means.values()), 1)
        worst = self.recipe.aims.worst_weight
        return Earned((1 - worst) * table.mean(1) + worst * table.min(1), means, phases)

    def held(self, behaviour: str, trial: Trial) -> Array:
        """Return the heading (K,) to hold, from the one at the command; 0 where none is felt."""
        offset = np.asarray(trial.situations.heading_offset_rad, dtype=np.float64)
        feels = any(sense in ('heading', 'steer') for sense in self.recipe.senses)
        return offset if feels and self.recipe.kind(behaviour) == 'walk' else np.zeros_like(offset)


def _images(words: tuple[int, ...], mirrors: list[SignedPermutation]) -> set[tuple[int, ...]]:
    """Return a sequence and all that mirrors make of it."""
    images, waiting = {words}, [words]
    while waiting:
        now = waiting.pop()
        for mirror in mirrors:
            image = tuple(mirror.place[word] for word in now)
            if image not in images:
                images.add(image)
                waiting.append(image)
    return images
