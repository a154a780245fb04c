"""The vectors of a study's words, from one vocabulary that is opened once a process."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache

import numpy as np
from numpy.typing import NDArray

from w2b_core.vocabulary import Vocabulary

Array = NDArray[np.float64]


@cache
def _open(spec: str) -> Vocabulary:
    return Vocabulary.load(spec)


def known(spec: str, word: str) -> bool:
    """Return whether the vocabulary `spec` holds `word`."""
    return word in _open(spec)


def vector(spec: str, word: str) -> Array:
    """
    Return the vector (T,) of `word` in the vocabulary `spec` (see `Vocabulary.load`).

    Raises
    ------
    UnknownWordError
        If the word is not there.
    VocabularyFileError
        If there is no such vocabulary, or it is damaged.

    """
    return _open(spec).vector(word)


def vectors(spec: str, words: Iterable[str]) -> dict[str, Array]:
    """Return word -> vector (T,), as `vector`."""
    return {word: vector(spec, word) for word in words}
