"""What an ear answers: what it understood and why, or why it refuses."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

#: A known word and its cosine with what was said, behind the metric.
Near = tuple[str, float]


class Role(StrEnum):
    """What a word did in a sentence."""

    COMMAND = 'command'
    NEGATED = 'negated command'
    NEGATION = 'negation'
    FUNCTION = 'function word'
    OTHER = 'no command'
    UNKNOWN = 'unknown word'
    DIRECTION = 'direction not asked for'


@dataclass(frozen=True)
class WordHeard:
    """
    One word, or one known pair of words, of a sentence.

    Attributes
    ----------
    text
        As the vocabulary spells it.
    role
        What it did.
    behaviour
        What it asks for by itself; empty for words that ask for nothing.
    probability
        Of that behaviour, given that the word is a command; 1 for words of the training.
    familiarity
        How much it is like a command, above 0 if it passes; NaN where nothing was measured.
    nearest
        Known words, the nearest first.
    by_heart
        Whether it is a word of the training or of the rules.

    """

    text: str
    role: Role
    behaviour: str = ''
    probability: float = 0.0
    familiarity: float = float('nan')
    nearest: tuple[Near, ...] = ()
    by_heart: bool = False


@dataclass(frozen=True, eq=False)
class Understood:
    """
    A command that the robot follows.

    Attributes
    ----------
    behaviour, probability
        What was asked for, and how sure the ear is of it among its behaviours.
    command: shape (K,)
        Drive of the network before its synapses, constant until the next word: 1 for the behaviour
        and 0 for the others, the only drives that legs are trained under.
    nearest
        Known words that are like the word that decided, the nearest first.
    words
        What each word did.

    """

    behaviour: str
    probability: float
    command: NDArray[np.float64]
    nearest: tuple[Near, ...]
    words: tuple[WordHeard, ...]


@dataclass(frozen=True)
class Refused:
    """
    A sentence that changes nothing: the robot goes on with what it does.

    Attributes
    ----------
    reason
        One line, for people.
    nearest
        Known words that are like what was said, the nearest first; may be empty.
    words
        What each word did; empty if the text could not be read.

    """

    reason: str
    nearest: tuple[Near, ...] = ()
    words: tuple[WordHeard, ...] = ()
