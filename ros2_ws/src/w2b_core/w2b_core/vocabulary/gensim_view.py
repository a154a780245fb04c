"""A vocabulary opened in gensim, which is optional."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from w2b_core.vocabulary.errors import VocabularyError
from w2b_core.vocabulary.store import Vectors

if TYPE_CHECKING:
    from gensim.models import KeyedVectors

_CHUNK_WORDS = 1024


def keyed_vectors(words: list[str], places: dict[str, int], vectors: Vectors) -> KeyedVectors:
    """
    Return gensim's KeyedVectors with words, their places and vectors (N, D), none of them copied.

    Float16 and coded vectors are copied as float32: gensim computes with nothing else.

    Raises
    ------
    VocabularyError
        If gensim is not installed.

    """
    try:
        from gensim.models import KeyedVectors
    except ImportError as error:
        raise VocabularyError(f'expected gensim, got {error}; install it with '
                              '`python -m pip install gensim`') from None
    keyed = KeyedVectors(vectors.shape[1])
    keyed.index_to_key = words
    keyed.key_to_index = places
    # Float32 on the disk is shared: the file stays memory-mapped.
    keyed.vectors = vectors if isinstance(vectors, np.ndarray) and vectors.dtype == np.float32 \
        else np.asarray(vectors, np.float32)
    keyed.next_index = len(words)
    # gensim's own way to these needs as much memory again as the vectors.
    keyed.norms = np.concatenate([
        np.linalg.norm(keyed.vectors[start:start + _CHUNK_WORDS], axis=1)
        for start in range(0, len(words), _CHUNK_WORDS)])
    return keyed
