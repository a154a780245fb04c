"""Words that are near to one: in meaning, or in spelling."""

from __future__ import annotations

from collections.abc import Sequence
from difflib import SequenceMatcher
from heapq import nlargest

import numpy as np
from numpy.typing import NDArray

from w2b_core.vocabulary.store import Vectors

#: Least normalised Damerau-Levenshtein similarity (OSA) of a suggestion.
LEAST_SIMILARITY = 0.55
#: Of difflib's ratio, which is another measure, the like; and how many words it looks at.
LEAST_RATIO = 0.65
DIFFLIB_WORDS = 30_000
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


def spelt_like(word: str, words: Sequence[str], count: int) -> tuple[str, ...]:
    """
    Return up to `count` of `words` that are spelt most like `word`, the earlier ones first.

    rapidfuzz finds them where it is installed, else Python's difflib.
    """
    try:
        from rapidfuzz.distance import OSA
        from rapidfuzz.process import extract
    except ImportError:
        return _by_difflib(word, words[:DIFFLIB_WORDS], count)
    found = extract(word, words, scorer=OSA.normalized_similarity,
                    score_cutoff=LEAST_SIMILARITY, limit=count)
    return tuple(match for match, _similarity, _index in found)


def _by_difflib(word: str, words: Sequence[str], count: int) -> tuple[str, ...]:
    """Return the like in some 0.2 s: difflib's bounds spare most of the words."""
    matcher = SequenceMatcher(b=word, autojunk=False)
    letters = set(word)
    alike: list[tuple[float, int]] = []
    for index, other in enumerate(words):
        if abs(len(other) - len(word)) > max(2, len(word) // 3) \
                or 2 * len(letters.intersection(other)) < len(letters):
            continue
        matcher.set_seq1(other)
        if matcher.quick_ratio() >= LEAST_RATIO and (ratio := matcher.ratio()) >= LEAST_RATIO:
            alike.append((ratio, -index))
    return tuple(words[-index] for _ratio, index in nlargest(count, alike))
