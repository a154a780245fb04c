"""
Which words are spelt most like one: edit distances, for many words at a time.

The similarity of two words is 1 - distance / length of the longer one, with the distance in
letters put in, left out, replaced, or swapped with their neighbour (optimal string alignment).
Letter counts bound it, so that only words near enough are aligned: 26,423 words take 1 to 2 ms.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

#: Least similarity of a suggestion.
LEAST_SIMILARITY = 0.55
#: Words with bounds above these are aligned first; mostly, those below can then not be better.
_STEPS = (0.85, 0.7, LEAST_SIMILARITY)
#: Letters of one machine word; a longer word is like none.
LONGEST = 64
#: Kinds of letters that are counted: ASCII letters have one each, other characters share them.
_KINDS = 32
_ONE = np.uint64(1)


class Spellings:
    """
    Words as numbers.

    Attributes
    ----------
    words
        In the order in which equally similar ones are suggested.

    """

    def __init__(self, words: Sequence[str]) -> None:
        self.words = words
        lengths = np.array([len(word) for word in words], dtype=np.int32)
        self._lengths = lengths
        self._starts = np.concatenate([[0], np.cumsum(lengths)])
        letters = np.frombuffer(''.join(words).encode('utf-32-le'), dtype=np.uint32)
        self._letters = np.append(letters, np.uint32(0))  # what is read past the last word
        cells = np.repeat(np.arange(len(words)) * _KINDS, lengths) + letters % _KINDS
        counts = np.bincount(cells, minlength=len(words) * _KINDS).reshape(-1, _KINDS)
        # (kinds, words): a column of it is what one letter of a query is compared with.
        self._counts = np.ascontiguousarray(np.minimum(counts, 255).T.astype(np.uint8))

    def like(self, word: str, count: int) -> tuple[str, ...]:
        """Return up to `count` words that are spelt most like `word`, the most similar first."""
        if not 0 < len(word) <= LONGEST or not len(self.words):
            return ()
        query = np.frombuffer(word.encode('utf-32-le', 'replace'), dtype=np.uint32)
        bounds = self._bounds(query)
        places, similarities = np.empty(0, dtype=np.intp), np.empty(0)
        above = np.inf
        for step in _STEPS:
            found = np.flatnonzero((bounds >= step) & (bounds < above))
            places = np.append(places, found)
            similarities = np.append(similarities, self._similarities(query, found))
            order = np.lexsort((places, -similarities))[:count]
            places, similarities = places[order], similarities[order]
            above = step
            if len(places) == count and similarities[-1] >= above:
                break
        return tuple(self.words[int(place)] for place, similarity
                     in zip(places, similarities, strict=True) if similarity >= LEAST_SIMILARITY)

    def _bounds(self, query: NDArray[np.uint32]) -> NDArray[np.float64]:
        """Return how similar each word (N,) is at most, by its length and its letters."""
        kinds, numbers = np.unique(query % _KINDS, return_counts=True)
        shared = np.zeros(len(self.words), dtype=np.uint8)
        for kind, number in zip(kinds, numbers, strict=True):
            shared += np.minimum(self._counts[kind], np.uint8(number))
        # Every letter of the longer word that the other one lacks costs an edit.
        bounds: NDArray[np.float64] = shared / np.maximum(self._lengths, len(query))
        return bounds

    def _similarities(self, query: NDArray[np.uint32], places: NDArray[np.intp]
                      ) -> NDArray[np.float64]:
        """
        Return the similarity of words (n,) with a query of at most `LONGEST` letters.

        Hyyroe (2003), "A bit-vector algorithm for computing Levenshtein and Damerau edit
        distances": a column of the alignment is one machine word.
        """
        lengths = self._lengths[places]
        distances = np.full(len(places), len(query), dtype=np.int32)
        starts = self._starts[places]
        last = np.uint64(len(query) - 1)
        zeros = np.zeros(len(places), dtype=np.uint64)
        up, down, diagonal, before = ~zeros, zeros, zeros, zeros
        bits = np.zeros(int(self._letters.max()) + 1, dtype=np.uint64)  # of each character
        for place, letter in enumerate(query):
            if letter < len(bits):
                bits[letter] |= _ONE << np.uint64(place)
        for position in range(int(lengths.max(initial=0))):
            inside = position < lengths
            matches = bits[self._letters[np.minimum(starts + position, len(self._letters) - 1)]]
            swapped = ((~diagonal & matches) << _ONE) & before
            diagonal = (((matches & up) + up) ^ up) | matches | down | swapped
            more = down | ~(diagonal | up)
            less = diagonal & up
            step = ((more >> last) & _ONE).astype(np.int32) - ((less >> last) & _ONE).astype(
                np.int32)
            distances += np.where(inside, step, 0)
            more = (more << _ONE) | _ONE
            up = (less << _ONE) | ~(diagonal | more)
            down = more & diagonal
            before = matches
        similarities: NDArray[np.float64] = 1 - distances / np.maximum(lengths, len(query))
        return similarities
