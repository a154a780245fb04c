"""
The original lengths of word2vec's Google News vectors, from copies of unit length.

A network that is primed element by element hears how long a vector is, and the study's networks
heard the original vectors, of length 1 to 8. The copy that a Python package holds is of unit
length. But the originals were published with 8 significant bits an element, so the factor that
brings all 300 elements of a word back onto that grid gives its length away, but for a power of two:
a wrong factor misses the grid by a quarter of its spacing on average, the right one by less than
0.001. Which power of two is decided by a regression of the length on the word's place in the file
(frequent words have short vectors) and on the direction of its vector.

Checked against 13 original vectors: equal to the last digit that those are printed with. Where the
regression and the nearest power of two differ by more than `CERTAIN_OCTAVES`, as for 0.7% of the
words, most of them boilerplate such as `reprinted_elsewhere`, the length may be twice or half the
original.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from w2b_core.vocabulary.errors import VocabularyFileError
from w2b_core.vocabulary.store import Vectors

Array = NDArray[np.float64]
Single = NDArray[np.float32]

#: The originals' significands, as whole numbers.
SIGNIFICANDS = np.arange(128, 256)
CERTAIN_OCTAVES = 0.35
#: Elements that choose among the candidate factors, and largest distance of the chosen one's
#: elements from the grid, in its spacing; wrong factors are 0.25 away on average.
PROBES = 24
LARGEST_MISS = 0.05
#: Median lengths of vectors in use: untrained ones of word2vec have 0.02, GloVe's 5 to 10.
SHORTEST, LONGEST = 0.001, 1000.0
#: Of the Google News vectors: where the search for the powers of two begins.
TYPICAL_NORM = 2.9


class Originals(NamedTuple):
    """Vectors (N, D) of the original lengths, and whether each length is certain (N,)."""

    vectors: Single
    certain: NDArray[np.bool_]


def is_unit_length(vectors: NDArray[np.floating]) -> bool:
    """Return whether vectors (N, D) are of unit length, judged by up to a thousand of them."""
    some = _some_lengths(vectors)
    return bool(len(some)) and bool(np.median(np.abs(some - 1)) < 0.01)


def check_lengths(vectors: Vectors, source: str, scale: float = 1.0) -> None:
    """
    Refuse vectors (N, D) that are, times `scale`, too short or too long for a network.

    Raises
    ------
    VocabularyFileError
        If the median length of up to a thousand of them is not within `SHORTEST` and `LONGEST`.

    """
    median = float(np.median(_some_lengths(vectors))) * scale if len(vectors) else 0.0
    if not SHORTEST <= median <= LONGEST:
        raise VocabularyFileError(f'{source}: expected vectors of a median length of {SHORTEST:g} '
                                  f'to {LONGEST:,.0f}, got {median:.3g}; choose another scale')


def _some_lengths(vectors: Vectors) -> Array:
    some = np.asarray(vectors[::max(1, len(vectors) // 1000)], dtype=np.float64)
    lengths: Array = np.linalg.norm(some, axis=1)
    return lengths


def originals(unit: NDArray[np.floating]) -> Originals:
    """
    Return the original vectors of copies of unit length.

    Parameters
    ----------
    unit: shape (N, D)
        In the order of the words' frequency.

    Raises
    ------
    ValueError
        If these are not such copies: no factor brings them onto the grid.

    """
    snapped = np.concatenate([_snap(np.asarray(unit[start:start + 256], dtype=np.float64))
                              for start in range(0, len(unit), 256)])
    octaves, certain = _octaves(np.log2(np.linalg.norm(snapped, axis=1)), unit)
    return Originals((snapped * np.exp2(octaves)[:, None]).astype(np.float32), certain)


def _snap(unit: Array) -> Array:
    """Return vectors (n, D) times the factor that brings them onto the grid of 8-bit numbers."""
    largest = np.argsort(-np.abs(unit), axis=1)[:, :PROBES]
    probes = np.take_along_axis(unit, largest, axis=1)
    factors = SIGNIFICANDS / 256 / np.frexp(np.abs(probes[:, :1]))[0]
    misses = np.abs(_off_grid(probes[:, None, :] * factors[:, :, None])).mean(axis=2)
    best = np.take_along_axis(factors, misses.argmin(axis=1)[:, None], axis=1)
    scaled = unit * best
    miss = np.abs(_off_grid(scaled))
    if miss.max(initial=0.0) > LARGEST_MISS:
        raise ValueError('expected the Google News vectors at unit length, got vectors whose '
                         'originals did not have 8 significant bits')
    exponents = np.frexp(scaled)[1]
    snapped: Array = np.ldexp(np.rint(np.ldexp(scaled, 8 - exponents)), exponents - 8)
    return snapped


def _off_grid(values: Array) -> Array:
    significands = np.frexp(values)[0] * 256
    distance: Array = significands - np.rint(significands)
    return distance


def _octaves(log2_norms: Array, unit: NDArray[np.floating]) -> tuple[Array, NDArray[np.bool_]]:
    """Return the power of two (N,) that each norm lacks, and whether it is certain (N,)."""
    place = np.log(np.arange(len(unit)) + 10.0)
    curve = np.stack([place ** power for power in range(4)], axis=1)
    direction = np.concatenate([curve, unit, np.abs(unit)], axis=1)
    octaves = np.rint(np.log2(TYPICAL_NORM) - log2_norms)
    misses = np.zeros(len(unit))
    # First by frequency alone: the direction's many coefficients need a fair start.
    for features in (curve, direction):
        gram = features.T @ features + 1e-3 * np.eye(features.shape[1])
        for _ in range(30):
            known = log2_norms + octaves
            misses = features @ np.linalg.solve(gram, features.T @ known) - known
            change = np.rint(misses)
            if not change.any():
                break
            octaves = octaves + change
    return octaves, np.abs(misses) <= CERTAIN_OCTAVES
