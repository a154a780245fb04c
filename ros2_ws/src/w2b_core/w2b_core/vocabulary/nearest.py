"""Words that are near to one in meaning."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from w2b_core.vocabulary.store import Vectors

#: Vectors that are looked at together.
_CHUNK_WORDS = 1024


def nearest(vectors: Vectors, own: NDArray[np.float64], place: int, count: int
            ) -> list[tuple[int, float]]:
    """
    Return the places and cosines of up to `count` vectors (N, D) that are nearest to one.

    Parameters
    ----------
    vectors
        Those that are zero or not finite are near to none.
    own: shape (D,)
        Vector to compare with.
    place
        Of a vector that is left out: its own.
    count
        How many at most.

    """
    own = own / np.linalg.norm(own)
    cosines = np.empty(len(vectors))
    for start in range(0, len(vectors), _CHUNK_WORDS):
        rows = np.asarray(vectors[start:start + _CHUNK_WORDS], dtype=np.float64)
        lengths = np.linalg.norm(rows, axis=1)
        usable = (lengths > 0) & np.isfinite(lengths)
        part = cosines[start:start + len(rows)]
        part[usable] = rows[usable] @ own / lengths[usable]
        part[~usable] = -np.inf
    cosines[place] = -np.inf
    first = np.argsort(-cosines, kind='stable')[:count]
    return [(int(index), float(cosines[index])) for index in first if np.isfinite(cosines[index])]
