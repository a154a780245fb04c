"""
Building the metric in closed form from WordNet's relations; seconds, and no search.

x = unit(unit(vector) - mean). With S the mean outer product of the pairs' differences,
D = S_synonyms / 2 + S_inflections / 2 is what shall shrink, N = S_antonyms / tr + Cov / tr what
shall stay large. The directions q solve N q = d (D + ridge tr(D) / dimensions) q; the projection is
Q sqrt(d).
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from training.grounding.wordnet import Pair, WordNet, WordNetError
from w2b_core.hearing.metric import Metric, unit
from w2b_core.vocabulary import Vocabulary

Array = NDArray[np.float64]

#: Of the mean of D's eigenvalues.
RIDGE = 0.2
#: Most frequent words of a vocabulary that the metric is built from.
MOST_WORDS = 50_000
#: Least pairs of each relation.
LEAST_PAIRS = 50


@dataclass(frozen=True)
class Built:
    """A metric, and how it was built, for people."""

    metric: Metric
    how: dict[str, Any]


def build(vocabulary: Vocabulary, wordnet: WordNet, without: Collection[str], *,
          ridge: float = RIDGE) -> Built:
    """
    Return a metric built without any pair that touches a stem of `without`.

    Raises
    ------
    WordNetError
        If the vocabulary's words have too few relations: it is not English.

    """
    words = vocabulary.words[:MOST_WORDS]
    directions = unit(vocabulary.matrix(words).astype(np.float64))
    mean = directions.mean(axis=0)
    centred = unit(directions - mean)
    found = wordnet.relations(words, without)
    place = {word: index for index, word in enumerate(words)}
    for name in ('synonyms', 'antonyms', 'inflections'):
        if len(getattr(found, name)) < LEAST_PAIRS:
            raise WordNetError(f'vocabulary {vocabulary.source}: expected {LEAST_PAIRS} or more '
                               f'pairs of {name} in English, got {len(getattr(found, name))}')
    shrink = (_scatter(centred, place, found.synonyms)
              + _scatter(centred, place, found.inflections)) / 2
    opposite = _scatter(centred, place, found.antonyms)
    spread = np.cov(centred.T)
    stay = opposite / np.trace(opposite) + spread / np.trace(spread)
    size = len(mean)
    values, vectors = scipy.linalg.eigh(
        stay, shrink + ridge * np.trace(shrink) / size * np.eye(size))
    matrix = vectors * np.sqrt(np.maximum(values, 0))
    # The sign of an eigenvector is arbitrary; its largest element shall be positive.
    matrix *= np.sign(matrix[np.abs(matrix).argmax(axis=0), np.arange(size)])
    how = {'recipe': 'generalised eigenvectors of WordNet relations', 'ridge': ridge,
           'vocabulary': vocabulary.source,
           'source_sha256': vocabulary.about.source_sha256 if vocabulary.about else '',
           'relations': 'WordNet 3.0',
           'synonyms': len(found.synonyms), 'antonyms': len(found.antonyms),
           'inflections': len(found.inflections),
           'without_stems': sorted({stem for word in without for stem in wordnet.stems(word)})}
    return Built(Metric(mean, matrix), how)


def _scatter(points: Array, place: dict[str, int], pairs: Sequence[Pair]) -> Array:
    """Return the mean outer product (D, D) of the pairs' differences."""
    differences = points[[place[first] for first, _second in pairs]] \
        - points[[place[second] for _first, second in pairs]]
    scatter: Array = differences.T @ differences / len(pairs)
    return scatter
