"""
The vectors of a study's words: a vocabulary, and beside it the one command that its source lacks.

The balanced set trains on `foward`, a misspelling that word2vec's Google News embedding knows and
the package behind the default vocabulary left out. `words/foward.txt` holds that one vector, as the
embedding has it, in word2vec's text format; a vocabulary that has the word itself is preferred.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from w2b_controller.vocabulary import UnknownWordError, Vocabulary

EXTRA = Path(__file__).parent / 'words' / 'foward.txt'

Array = NDArray[np.float64]


@cache
def _open(spec: str) -> Vocabulary:
    return Vocabulary.load(spec)


def vector(spec: str, word: str) -> Array:
    """
    Return the vector (T,) of `word` in the vocabulary `spec` (see `Vocabulary.load`).

    Raises
    ------
    UnknownWordError
        If the word is neither there nor among the extra ones.
    VocabularyFileError
        If there is no such vocabulary, or it is damaged.

    """
    try:
        return _open(spec).vector(word)
    except UnknownWordError:
        extra = _open(str(EXTRA))
        if word not in extra.words:
            raise
        return extra.vector(word)


def vectors(spec: str, words: Iterable[str]) -> dict[str, Array]:
    """Return word -> vector (T,), as `vector`."""
    return {word: vector(spec, word) for word in words}
