"""
A recipe: all that says how legs are trained, as data. Validated when it is read.

`parts` has the defaults, `training/recipes` the recipes that the shipped champions were made by.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, ValidationError, field_validator, model_validator

from training.configuration import (
    ConfigError,
    Count,
    Positive,
    Strict,
    explain,
    read_recipe,
)
from training.legs.parts import Aims, Drop, FirstPart, NetworkPart, Stage, Worlds
from w2b_core import bodies
from w2b_core.behaviours import BEHAVIOURS, DEFAULT_BEHAVIOURS, course_of
from w2b_core.network.sharing import Sharing
from w2b_core.network.symmetry import MIRRORS, Mirror, find_mirror, find_mirrors, limbs_of
from w2b_core.senses import SENSES, split
from w2b_sim.worlds import WORLDS


class RecipeError(ConfigError):
    """A recipe cannot be used; the message names the file, the field and what was expected."""


class Recipe(Strict):
    """How legs are trained."""

    name: str
    body: str
    world: str
    behaviours: tuple[str, ...] = DEFAULT_BEHAVIOURS
    senses: tuple[str, ...]
    network: NetworkPart = NetworkPart()
    first: FirstPart = FirstPart()
    worlds: Worlds = Worlds()
    aims: Aims = Aims()
    population: Annotated[int, Field(ge=4, le=1000)] = 24
    sigma: Positive = 0.15
    seeds: Count = 8
    seed: Annotated[int, Field(ge=0, lt=2**31)] = 1
    stages: Annotated[tuple[Stage, ...], Field(min_length=1)]
    drop: Drop = Drop()
    examination: Count = 16

    @field_validator('senses')
    @classmethod
    def _known_senses(cls, senses: tuple[str, ...]) -> tuple[str, ...]:
        for sense in senses:
            split(sense)
        return senses

    @model_validator(mode='after')
    def _fits_together(self) -> Recipe:
        bodies.check(self.body)
        if self.world not in WORLDS:
            raise ValueError(f'world: expected one of {", ".join(WORLDS)}, got {self.world!r}')
        for behaviour in self.behaviours:
            if behaviour not in BEHAVIOURS:
                raise ValueError(f'behaviours: expected some of {", ".join(BEHAVIOURS.names())}, '
                                 f'got {behaviour!r}')
        if not any(course_of(behaviour).along for behaviour in self.behaviours):
            raise ValueError('behaviours: expected one that walks')
        self._check_sources()
        self.sharing()
        self._check_entries()
        return self

    def _check_sources(self) -> None:
        body = bodies.get(self.body)
        known = {'link': [link.name for link in body.links],
                 'joint': [joint.name for joint in body.joints]}
        for sense in self.senses:
            kind, source = split(sense)
            among = known.get(SENSES.get(kind).source, [source])
            if source not in among:
                raise ValueError(f'senses: {sense!r}: expected one of {", ".join(among)}')

    def _check_entries(self) -> None:
        limbs = limbs_of(bodies.get(self.body))
        if unknown := set(self.first.stance) - set(self.behaviours):
            raise ValueError(f'first.stance: expected some of {", ".join(self.behaviours)}, '
                             f'got {", ".join(sorted(unknown))}')
        for number, entry in enumerate(self.first.entries):
            joints = len(limbs[entry.of]) if entry.of < len(limbs) else 0
            for name, value, count in (('of', entry.of, len(limbs)),
                                       ('onto', entry.onto, self.network.per_limb),
                                       ('neuron', entry.neuron, self.network.per_limb),
                                       ('joint', entry.joint, joints)):
                if isinstance(value, int) and value >= count:
                    raise ValueError(f'first.entries[{number}]: {name}: expected 0 to {count - 1}, '
                                     f'got {value}')
            for name, said, among in (
                    ('behaviours', entry.behaviours, self.behaviours),
                    ('sense', (entry.sense,) if entry.sense else (), self.senses)):
                if unknown := set(said) - set(among):
                    raise ValueError(f'first.entries[{number}]: {name}: expected some of '
                                     f'{", ".join(among)}, got {", ".join(sorted(unknown))}')

    def mirrors(self) -> tuple[Mirror, ...]:
        """Return the body's mirrors that the network shares (NotSymmetricError)."""
        body = bodies.get(self.body)
        if self.network.symmetry == 'found':
            return find_mirrors(body)
        unknown = set(self.network.symmetry) - set(MIRRORS)
        if unknown:
            raise ValueError(f'network.symmetry: expected found or some of '
                             f'{", ".join(MIRRORS)}, got {", ".join(sorted(unknown))}')
        return tuple(find_mirror(body, name) for name in self.network.symmetry)

    def sharing(self) -> Sharing:
        """Return the map from genomes to networks."""
        part = self.network
        return Sharing(bodies.get(self.body), self.behaviours, self.senses, self.mirrors(),
                       oscillating=part.oscillating, per_limb=part.per_limb, direct=part.direct,
                       begins=part.begins)

    def kind(self, behaviour: str) -> str:
        """Return how a behaviour is judged: walk, turn, stand or sit."""
        course = course_of(behaviour)
        usual = ('walk' if course.along else 'turn' if course.turn
                 else 'sit' if behaviour == 'sit' else 'stand')
        return self.aims.kinds.get(behaviour, usual)

    def sha256(self) -> str:
        """Return the hash of all that the recipe says."""
        text = json.dumps(self.model_dump(mode='json'), sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()


def load_recipe(path: Path, **changes: Any) -> Recipe:
    """
    Return the recipe in a YAML file, with the fields of `changes` in place of its own.

    Raises
    ------
    RecipeError
        If the file cannot be read or says something that does not fit.

    """
    try:
        return Recipe(**{**read_recipe(path), **changes})
    except ConfigError as error:
        raise RecipeError(str(error)) from None
    except ValidationError as error:
        raise RecipeError(f'{path}: {explain(error, Recipe, "the recipe")}') from None
