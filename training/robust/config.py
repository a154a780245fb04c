"""What decides the outcome of a robust training run: its stages, means and words."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from training.evolution.config import check_each_once
from training.evolution.treatments import Words
from training.robust.listening import Listening
from training.robust.objective import FREE_STRAY_M, STRAY_WEIGHT
from training.robust.scenarios import DIRECTION, MOVE_NOISE, Randomisation
from w2b_core import bodies
from w2b_sim.worlds import WORLDS, World

#: Part of a stage's generations over which touch that was not felt before grows to its full size.
GROWING = 0.7


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
    stages
        One after the other.
    physics_steps
        Of one control period in training; 0 for the world's own.
    randomisation
        The means in use.
    listening
        Before the first stage.
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
    stages: tuple[Stage, ...]
    world: str = ''
    vocabulary: str = 'default'
    population: int = 50
    physics_steps: int = 0
    randomisation: Randomisation = field(default_factory=Randomisation)
    listening: Listening = field(default_factory=Listening)
    move_noise: float = MOVE_NOISE
    careful: bool = False
    aggregate: str = 'balanced'

    def __post_init__(self) -> None:
        """Check the fields (ValueError, naming the field, with what was expected and what came)."""
        if self.world == '':
            object.__setattr__(self, 'world', bodies.get(self.body).world)
        if self.world not in WORLDS:
            raise ValueError(f'world: expected one of {", ".join(WORLDS)}, got {self.world!r}')
        if not self.stages:
            raise ValueError('stages: expected at least one, got none')
        missing = sorted(set(DIRECTION) - {behaviour for _word, behaviour in self.words})
        if missing:
            raise ValueError(f'words: expected at least one for each behaviour, got none for '
                             f'{missing[0]!r}')
        check_each_once(word for word, _behaviour in self.words)

    @property
    def generations(self) -> int:
        """Of all stages together."""
        return sum(stage.generations for stage in self.stages)

    def stage_at(self, generation: int) -> tuple[Stage, int]:
        """Return the stage of a generation (the last one after the end), and where it begins."""
        begin = 0
        for stage in self.stages[:-1]:
            if generation < begin + stage.generations:
                return stage, begin
            begin += stage.generations
        return self.stages[-1], begin

    def drawn_at(self, generation: int) -> int:
        """Return the generation in which the situations of a generation are drawn."""
        stage, begin = self.stage_at(generation)
        return generation - (generation - begin) % stage.redraw if stage.redraw else begin

    def touch_gain(self, generation: int) -> float:
        """
        Return the share of the touch sensors' signals that is felt in a generation.

        A stage with touch that follows one without lets it grow, a step at each draw, over the
        first part of its generations: a gait is at stake.
        """
        stage, begin = self.stage_at(generation)
        felt_before = begin == 0 or self.stage_at(begin - 1)[0].touch
        if felt_before or not stage.touch or not stage.redraw:
            return float(stage.touch)
        steps = int(np.ceil(GROWING * stage.generations / stage.redraw))
        return min(1.0, ((generation - begin) // stage.redraw + 1) / steps)

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
