"""
A recipe: all that says how a champion that is primed with words is made, as data.

`parts` has the defaults, `training/recipes/serial` the recipes of the champions that ship.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, cast

from pydantic import Field, ValidationError, model_validator

from training.configuration import (
    BodyName,
    ConfigError,
    Positive,
    Seed,
    Strict,
    explain,
    read_recipe,
)
from training.pipeline.parts import Choose, Evolve, Examine, Gate, Pretrain, Step, Training
from training.pipeline.words import Roles
from training.robust.config import RobustConfig
from training.robust.settings import Pretraining, Stage
from w2b_core import bodies
from w2b_sim.worlds import WORLDS, World

RECIPES = Path(__file__).parents[1] / 'recipes' / 'serial'


class Recipe(Strict):
    """
    How a champion is made.

    Attributes
    ----------
    body, vocabulary, words
        What learns which words, and their vectors.
    move_m
        How far the median start must get under a move word.
    seeds
        Of the evolutions.
    training
        What they have in common.
    steps
        Pretraining, evolution, gates, choice, examination: in this order.

    """

    name: str
    body: BodyName
    vocabulary: str = 'default'
    words: Roles
    move_m: Positive
    seeds: Annotated[tuple[Seed, ...], Field(min_length=1)] = (0, 1, 2, 3, 4, 5)
    training: Training = Training()
    steps: Annotated[tuple[Step, ...], Field(min_length=1)]

    @model_validator(mode='after')
    def _fits_together(self) -> Recipe:
        kinds = [part.step for part in self.steps]
        if kinds[:2] != ['pretrain', 'evolve'] or kinds[-2:] != ['choose', 'examine']:
            raise ValueError('steps: expected pretrain and evolve first, choose and examine last, '
                             f'got {", ".join(kinds)}')
        if set(kinds[2:-2]) - {'evolve', 'gate'}:
            raise ValueError('steps: expected only evolve and gate between, got '
                             f'{", ".join(kinds[2:-2])}')
        names = [part.name for part in self.steps]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f'steps: expected each name once, got {name!r} twice')
        final = self.examine.seed
        for part in self.steps:
            if isinstance(part, Gate | Choose) and part.seed == final:
                raise ValueError(f'steps: {part.name}: expected other starts than those of '
                                 f'{self.examine.name}, got the same seed {final}')
            if isinstance(part, Evolve) and len(part.discard_below) > len(part.stages):
                raise ValueError(f'steps: {part.name}: discard_below: expected at most '
                                 f'{len(part.stages)} bounds, got {len(part.discard_below)}')
        self.config(self.seeds[0])
        return self

    @property
    def pretrain(self) -> Pretrain:
        """The first step."""
        return cast(Pretrain, self.steps[0])

    @property
    def examine(self) -> Examine:
        """The last step."""
        return cast(Examine, self.steps[-1])

    @property
    def world(self) -> World:
        """Where trials take place."""
        return WORLDS[self.training.world or bodies.get(self.body).world]

    def stages(self, until: Evolve | None = None) -> tuple[Stage, ...]:
        """Return the stages of the evolution, all of them or those up to the end of a step."""
        found: list[Stage] = []
        for part in self.steps:
            if isinstance(part, Evolve):
                found += part.stages
            if part is until:
                break
        return tuple(found)

    def config(self, seed: int) -> RobustConfig:
        """Return the evolution of one seed."""
        common = {name: getattr(self.training, name) for name in Training.model_fields}
        return RobustConfig(body=self.body, seed=seed, words=self.words.trained,
                            vocabulary=self.vocabulary, stages=self.stages(),
                            pretraining=Pretraining(attempts=0), **common)

    def shortened(self, effort: float) -> Recipe:
        """Return the recipe with all generations times `effort`, at least one each."""
        def scaled(part: Any) -> Any:
            return replace(part, generations=max(1, round(part.generations * effort)))

        steps: list[Any] = []
        for part in self.steps:
            if isinstance(part, Pretrain):
                steps.append(part.model_copy(update={'plan': scaled(part.plan)}))
            elif isinstance(part, Evolve):
                steps.append(part.model_copy(update={'stages': tuple(map(scaled, part.stages))}))
            else:
                steps.append(part)
        return self.model_copy(update={'steps': tuple(steps)})


def load_recipe(path: Path) -> Recipe:
    """
    Return the recipe in a YAML file; its `words` may name a file beside it.

    Raises
    ------
    ConfigError
        One line with the file, the field, what was expected and what came.

    """
    content = read_recipe(path)
    if isinstance(words := content.get('words'), str):
        content['words'] = read_recipe(path.parent / words)
    try:
        return Recipe(**content)
    except ValidationError as error:
        raise ConfigError(f'{path}: {explain(error, Recipe, "the recipe")}') from None


def shipped() -> dict[str, Path]:
    """Return body -> recipe of the serial champions that ship."""
    return {path.stem: path for path in sorted(RECIPES.glob('*.yaml')) if path.stem != 'words'}
