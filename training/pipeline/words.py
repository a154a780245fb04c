"""
Which word may be used for what in a pipeline.

- *trained*: used in evolution; gates may ask for them;
- *validation*: never used in evolution, but may choose among candidates;
- *held out*: not even looked up before the one candidate is chosen that ships. What it does under
  them is measured once (`blind`); the record counts the candidates that were.

A recipe has them by behaviour. `training/recipes/serial/words.yaml` tells by which rule those of
the shipped serial champions were drawn; a test repeats it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BeforeValidator, model_validator

from training.configuration import Strict
from training.evolution.treatments import Words
from training.robust.scenarios import check_directions, direction_of
from w2b_core.vocabulary.text import folded


def _pairs(value: Any) -> Any:
    """Return the (word, behaviour) pairs of a mapping behaviour -> words; others as they are."""
    if not isinstance(value, Mapping):
        return value
    return tuple((word, behaviour) for behaviour, words in value.items()
                 for word in ((words,) if isinstance(words, str) else words))


ByBehaviour = Annotated[Words, BeforeValidator(_pairs)]


class Roles(Strict):
    """
    Words with the behaviours they ask for, in three roles; ValueError if a word has two roles.

    Attributes
    ----------
    trained, validation, held_out
        (word, behaviour) pairs, or a mapping of behaviours to words.

    """

    trained: ByBehaviour
    validation: ByBehaviour = ()
    held_out: ByBehaviour = ()

    @model_validator(mode='after')
    def _each_once(self) -> Roles:
        seen: set[str] = set()
        for word, behaviour in self.every:
            direction_of(behaviour)
            if folded(word) in seen:
                raise ValueError(f'words: expected one role each, got two for {word!r}')
            seen.add(folded(word))
        check_directions(self.trained)
        return self

    @property
    def every(self) -> Words:
        """All words: trained, then validation, then held out."""
        return self.trained + self.validation + self.held_out

    @property
    def known(self) -> Words:
        """The words that may be looked up before a candidate is chosen."""
        return self.trained + self.validation

    @property
    def moves(self) -> Words:
        """The trained words that ask for a move."""
        return tuple(pair for pair in self.trained if direction_of(pair[1]))
