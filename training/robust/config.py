"""What decides the outcome of a robust training run: its stages, means and words."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any

import numpy as np
from pydantic import Field, TypeAdapter
from pydantic.dataclasses import dataclass

from training.configuration import (
    STRICT,
    BodyName,
    NotNegative,
    Seed,
    Share,
    one_line,
    one_of,
    world_of,
)
from training.evolution.config import check_each_once
from training.evolution.optimisers import OPTIMISERS, PAPER
from training.evolution.treatments import Words
from training.robust.objective import AGGREGATES
from training.robust.scenarios import MOVE_NOISE, check_directions
from training.robust.settings import Careful, Pretraining, Randomisation, Stage, Touch, Whole
from w2b_sim.worlds import WORLDS, World


@one_line('training in drawn worlds')
@dataclass(frozen=True, config=STRICT)
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
    pretraining
        Before the first stage.
    move_noise
        As in `scenarios.draw`.
    careful
        Most children keep their parent's hidden weights, and none hears the words worse than its
        parent (`careful.careful_mutation`): for newcomers that hear well from the start. None: as
        `operators.mutate_mixed`.
    touch
        How touch comes into use.
    newest
        Weight of the newest draw in an individual's fitness.
    tolerance
        A child may be this much worse than its parent in the first situations and still be tried.
    optimiser
        A name of `optimisers.OPTIMISERS`.
    aggregate
        How three behaviours make one fitness, see `objective.fitness`.

    """

    body: BodyName
    seed: Seed
    words: Words
    stages: Annotated[tuple[Stage, ...], Field(min_length=1)]
    world: str = ''
    vocabulary: str = 'default'
    population: Annotated[int, Field(ge=2, le=10_000)] = 50
    physics_steps: Whole = 0
    randomisation: Randomisation = Randomisation()
    pretraining: Pretraining = Pretraining()
    move_noise: NotNegative = MOVE_NOISE
    careful: Careful | None = None
    touch: Touch = Touch()
    newest: Share = 0.3
    tolerance: NotNegative = 0.01
    optimiser: Annotated[str, one_of(OPTIMISERS.names)] = PAPER
    aggregate: Annotated[str, one_of(lambda: AGGREGATES)] = 'balanced'

    def __post_init__(self) -> None:
        """Check the fields (ValueError, naming the field, with what was expected and what came)."""
        object.__setattr__(self, 'world', world_of(self.world, self.body))
        check_directions(self.words)
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
        steps = int(np.ceil(self.touch.growing * stage.generations / stage.redraw))
        return min(1.0, ((generation - begin) // stage.redraw + 1) / steps)

    def training_world(self) -> World:
        """Return the nominal world of the training."""
        world = WORLDS[self.world]
        return replace(world, physics_steps=self.physics_steps) if self.physics_steps else world

    def to_json(self) -> dict[str, Any]:
        """Return the configuration as a JSON object."""
        value: dict[str, Any] = TypeAdapter(RobustConfig).dump_python(self, mode='json')
        return value
