"""
The batched engine against PyBullet, for bodies and worlds that both engines model.

PyBullet at the world's physics steps is the reference of worlds with dry friction, as recordings of
the original are that of the `paper` world. Controllers are compared that were never selected, and
evolved ones: a random controller mostly trembles on the spot, where every engine agrees.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain, zip_longest

import numpy as np
from numpy.typing import NDArray

from training.configuration import world_of
from training.evolution.operators import Layout, mutate, random_genomes
from training.evolution.treatments import WORD_SETS
from training.study.lexicon import load_lexicon
from w2b_core import bodies
from w2b_core.bodies.model import Body
from w2b_core.controller import file as controller_file
from w2b_core.network import Network
from w2b_core.vocabulary import Vocabulary
from w2b_sim.engines.interface import Start
from w2b_sim.worlds import WORLDS, World

Array = NDArray[np.float64]

#: Evaluations of each sample: some eight minutes of PyBullet on one core for both of the twin.
COUNT = 96
#: The start of the floor's second evaluation.
NUDGE = Start(height_m=1e-6)


@dataclass(frozen=True)
class Sample:
    """N evaluations: each of the controllers in `network` under its own word, (N, 1, T)."""

    kind: str
    network: Network
    signals: Array


@dataclass(frozen=True)
class Settings:
    """How the batched engine runs; `physics_steps` in a control period, None for the world's."""

    name: str
    precision: str
    physics_steps: int | None = None


@dataclass(frozen=True)
class Reference:
    """What PyBullet says: x-y displacements (N, 2), those of the nudged start, touch fraction."""

    moved_m: Array
    nudged_m: Array
    touch: float | None


def choose(body_name: str, world_name: str | None = None) -> tuple[Body, World]:
    """
    Return a body and the world to compare it in, by default its own.

    Raises
    ------
    ValueError
        If there is no such body or world, or PyBullet has another law for the world's friction.

    """
    body = bodies.get(body_name)
    name = world_of(world_name or '', body_name)
    if WORLDS[name].friction is None:
        dry = [world.name for world in WORLDS.values() if world.friction is not None]
        raise ValueError(
            f"{body.name} in {name}: PyBullet's friction is another law there, so that it is no "
            f'reference; expected a world with dry friction (--world {" or ".join(dry)}), or '
            'recordings of the original (--traces)')
    return body, WORLDS[name]


def load_controllers(body: Body, names: Sequence[str] | None, vocabulary: Vocabulary
                     ) -> tuple[controller_file.Controller, ...]:
    """
    Return the controllers called `names` (files, or shipped), by default all that ship for `body`.

    Raises
    ------
    ValueError
        If a file is damaged, its controller of another body, or trained on other vectors.

    """
    if names is None:
        every = (controller_file.load(controller_file.shipped(name))
                 for name in controller_file.shipped_names())
        return tuple(one for one in every if one.body == body.name and one.ear is None)
    loaded = []
    for name in names:
        one = controller_file.load(controller_file.resolve(name))
        if one.body != body.name:
            raise ValueError(f'{name}: expected a controller of {body.name}, got one of {one.body}')
        Layout.of(body).genome(one.serial)
        if not one.words:
            raise ValueError(f'{name}: expected a controller with its trained words, got none')
        if changed := one.changed_words(vocabulary):
            raise ValueError(f'{name}: expected a controller trained on the vectors of the default '
                             f'vocabulary, got another vector of {changed[0]!r}')
        loaded.append(one)
    return tuple(loaded)


def random_sample(body: Body, vocabulary: Vocabulary, count: int, seed: int) -> Sample:
    """Return `count` new controllers, under the paper's words in turn."""
    layout = Layout.of(body)
    words = [word for word, _asked in chain(*WORD_SETS['paper'])]
    genomes = random_genomes(np.random.default_rng((seed, 0)), count, layout)
    heard = [vocabulary.vector(words[index % len(words)]) for index in range(count)]
    return Sample('random', layout.network(genomes), np.array(heard)[:, None])


def evolved_sample(body: Body, controllers: Sequence[controller_file.Controller],
                   vocabulary: Vocabulary, count: int, seed: int) -> Sample:
    """
    Return `count` evaluations of evolved controllers.

    The first half as they are, under their own words and then the lexicon's, a word of each class
    in turn; the rest copies with one synapse redrawn, under the parent's own words in turn.
    """
    layout = Layout.of(body)
    other = [word for word in chain(*zip_longest(*load_lexicon().values()))
             if word is not None and word in vocabulary]
    kept = -(-count // 2)
    words, genomes = [], []
    for index in range(count):
        turn, parent = divmod(index if index < kept else index - kept, len(controllers))
        own = [word.word for word in controllers[parent].words]
        hears = own + [word for word in other if word not in own] if index < kept else own
        words.append(hears[turn % len(hears)])
        genomes.append(layout.genome(controllers[parent].serial))
    population = np.array(genomes)
    population[kept:] = mutate(np.random.default_rng((seed, 1)), population[kept:], layout)
    heard = np.array([vocabulary.vector(word) for word in words])
    return Sample('evolved', layout.network(population), heard[:, None])


def settings(body: Body) -> tuple[Settings, ...]:
    """Return how the batched engine is tried: precisely, and as evolution uses it."""
    from training.pipeline.recipe import load_recipe, shipped

    recipes = shipped()
    trained = load_recipe(recipes[body.name]).training if body.name in recipes else None
    return (Settings('batched', 'double'),
            Settings('as trained', 'single', trained.physics_steps or None if trained else None))


def in_batched(body: Body, world: World, sample: Sample, how: Settings, threads: int = 1
               ) -> tuple[Array, float | None]:
    """
    Return the x-y displacements (N, 2), NaN where one failed, and the touch fraction if any.

    Raises
    ------
    UnsupportedBodyError
        If the engine does not model the body (a ValueError).

    """
    from w2b_sim.engines.batched import BatchedEngine

    engine = BatchedEngine(body, world, how.precision, threads, physics_steps=how.physics_steps)
    outcome = engine.evaluate(sample.network, sample.signals, [Start()])
    return outcome.final_position_m[:, 0, 0, :2], _touch(outcome.touch_fraction)


def in_pybullet(body: Body, world: World, sample: Sample, processes: int = 1) -> Reference:
    """
    Return what PyBullet says of a sample, with a progress bar on standard error.

    Raises
    ------
    ValueError
        If PyBullet cannot run the body.

    """
    from w2b_sim.engines.quiet_pybullet import pybullet

    try:
        moved, touch = _stepwise('pybullet', 'PyBullet', body, world, sample, [Start(), NUDGE],
                                 processes)
    except pybullet.error as error:
        raise ValueError(f'{body.name}: PyBullet cannot run this body: {error}') from None
    return Reference(moved[:, 0], moved[:, 1], touch)


def in_mujoco(body: Body, world: World, sample: Sample, processes: int = 1
              ) -> tuple[Array, float | None]:
    """
    Return the x-y displacements (N, 2) in MuJoCo, and the touch fraction if any.

    Raises
    ------
    ValueError
        If MuJoCo is missing or makes no model of the body.

    """
    moved, touch = _stepwise('mujoco', 'MuJoCo', body, world, sample, [Start()], processes)
    return moved[:, 0], touch


def _stepwise(engine: str, title: str, body: Body, world: World, sample: Sample,
              starts: Sequence[Start], processes: int) -> tuple[Array, float | None]:
    """Return displacements (N, starts, 2) and the touch fraction from the first start."""
    from training.evolution.progress import counting
    from w2b_sim.engines.stepwise_evaluator import StepwiseEvaluator

    count = len(sample.signals)
    # Processes take four tasks at a time; a controller is one for each start.
    step = 1 if processes == 1 else 4 // len(starts) * processes
    moved, touched = [], []
    with (StepwiseEvaluator(engine, body, world, processes) as evaluator,
          counting(count, f'{title}: {sample.kind}') as advance):
        for first in range(0, count, step):
            some = slice(first, first + step)
            outcome = evaluator.evaluate(
                Network(sample.network.hidden_weights[some], sample.network.motor_weights[some],
                        sample.network.motor_time_constants), sample.signals[some], starts)
            moved.append(outcome.final_position_m[:, 0, :, :2])
            touched.append(outcome.touch_fraction[:, :, 0])
            advance(len(moved[-1]))
    return np.concatenate(moved), _touch(np.concatenate(touched))


def _touch(fraction: Array) -> float | None:
    """Return the mean over evaluations (..., T) and links; None for a body without touch."""
    return float(np.nanmean(fraction)) if fraction.shape[-1] else None
