"""
What the ear is held against, on the same splits: simpler classifiers, and controls.

The evolved rivals, which close the loop with a body, are in `evolved`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from training.grounding import accuracy
from training.grounding.accuracy import Accuracy, Array, Learner, Points
from training.grounding.lexicon import Lexicon
from w2b_core.hearing import places
from w2b_core.hearing.metric import Metric, unit
from w2b_core.vocabulary import Vocabulary

#: Interval of a mean difference, in standard errors.
WIDTH = 1.96


def measure(words: Lexicon, vocabulary: Vocabulary, metric: Metric, counts: Sequence[int],
            splits: int, ours: Mapping[str, Accuracy | None]) -> dict[str, Any]:
    """
    Return the rivals' accuracy by name and number of words, as JSON values.

    `less`: how much less accurate than the ear on the same splits, with the 95 % interval of the
    mean of the paired difference.
    """
    def centred(names: Sequence[str]) -> Array:
        return unit(unit(vocabulary.matrix(names).astype(np.float64)) - metric.mean)

    def alone(names: Sequence[str]) -> Array:
        return places.project(names, vocabulary, metric, forms=False)

    def projected(names: Sequence[str]) -> Array:
        return places.project(names, vocabulary, metric, among=forms)

    forms = places.spelt(vocabulary)
    moved = _permuted(projected, sorted(forms))
    rows: dict[str, tuple[Points, Learner, frozenset[str], bool]] = {
        'logistic regression': (centred, accuracy.logistic, frozenset(), False),
        'logistic regression, inflections': (centred, accuracy.logistic, forms, False),
        'cosine to the mean': (centred, accuracy.nearest_mean, frozenset(), False),
        'learned metric, no inflections': (alone, accuracy.logistic, frozenset(), False),
        'learned metric, inflections of heard words': (alone, accuracy.logistic, forms, False),
        'learned metric, cosine to the mean': (projected, accuracy.nearest_mean, forms, False),
        'permuted vectors': (moved, accuracy.logistic, forms, False),
        'shuffled labels': (projected, accuracy.logistic, forms, True)}
    found: dict[str, Any] = {}
    for name, (points, learner, among, shuffled) in rows.items():
        found[name] = {}
        for count in counts:
            row = accuracy.of_few_words(words, points, count, splits, learner=learner,
                                        forms=among, shuffled=shuffled)
            best = ours[str(count)]
            if row is not None and best is not None:
                found[name][str(count)] = {'macro': row.macro, 'low': row.low, 'high': row.high,
                                           'less': _less(best, row)}
    return found


def _permuted(points: Points, names: Sequence[str]) -> Points:
    """Return where words lie if every word has the vector of another one, drawn at random."""
    order = np.random.default_rng(0).permutation(len(names))
    other = {name: names[index] for name, index in zip(names, order, strict=True)}
    return lambda asked: points([other[name] for name in asked])


def _less(ours: Accuracy, theirs: Accuracy) -> dict[str, float]:
    """Return the mean of the splits' differences and half its interval."""
    differences = np.array(ours.splits) - np.array(theirs.splits)
    error = differences.std(ddof=1) / np.sqrt(len(differences)) if len(differences) > 1 else 0.0
    return {'mean': float(differences.mean()), 'half_interval': float(WIDTH * error)}
