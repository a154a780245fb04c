"""
Judging one word behind the metric: which behaviour, and whether it is a command at all.

Which one says a softmax over the behaviours. Whether says the gate: a softmax over the behaviours
and *other* (near misses and a sample of the vocabulary), plus the cosine to the nearest behaviour's
mean. A confident softmax is no sign of a command: it has seen nothing else.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from w2b_core.hearing import softmax
from w2b_core.hearing.errors import EarError
from w2b_core.hearing.metric import unit
from w2b_core.hearing.softmax import Softmax

Array = NDArray[np.float64]

#: C of the classifier and of the gate.
CLASSIFIER_STRENGTH = 3.0
GATE_STRENGTH = 2.0
#: Summed weights in the gate's training of each behaviour, of the near misses, of the background.
BEHAVIOUR_WEIGHT, NEAR_WEIGHT, BACKGROUND_WEIGHT = 200.0, 200.0, 400.0
#: Weight of the cosine to the nearest behaviour's mean beside the gate's logit.
COSINE_WEIGHT = 5.0
#: Words drawn at random are accepted this often; see `Judge.with_threshold`.
ACCEPTED_AT_RANDOM = 0.10
#: Longer sentences need no more than one of so many words with a meaning.
SENTENCE_WORDS = 5
#: Factor of the classifier's logits where no families are there to calibrate it.
SHARPNESS = 2.5


@dataclass(frozen=True, eq=False)
class Judge:
    """
    What was learned about words.

    Attributes
    ----------
    classes
        The behaviours that it tells apart, C.
    classifier: C classes over E elements
        Which behaviour.
    sharpness
        Factor of its logits that makes its probabilities honest.
    gate: C + 1 classes over E elements
        The last class is *other*.
    means: shape (C, E)
        Mean of each behaviour's words, at unit length.
    threshold
        Least score of a word that is a command by itself.
    margins
        How much more a command needs in a sentence of 1, 2, 3 ... words with a meaning: each may
        be taken for one by chance, and a sentence shall be no oftener than a word.

    """

    classes: tuple[str, ...]
    classifier: Softmax
    sharpness: float
    gate: Softmax
    means: Array
    threshold: float
    margins: tuple[float, ...] = (0.0,)

    def probabilities(self, points: Array) -> Array:
        """Return the behaviours' probabilities (..., C) of words (..., E) that are commands."""
        return self.classifier.probabilities(points, self.sharpness)

    def familiarity(self, points: Array) -> Array:
        """Return how much words (..., E) are like commands (...,); above 0 they pass."""
        return self.score(points) - self.threshold

    def score(self, points: Array) -> Array:
        """Return the gate's score (...,) of words (..., E), before the threshold."""
        logits = self.gate.logits(points)
        ours, other = logits[..., :-1], logits[..., -1]
        peak = ours.max(axis=-1)
        summed = peak + np.log(np.exp(ours - peak[..., None]).sum(axis=-1))
        score: Array = summed - other + COSINE_WEIGHT * (points @ self.means.T).max(axis=-1)
        return score

    def with_threshold(self, random: Array, accepted: float = ACCEPTED_AT_RANDOM) -> Judge:
        """Return the judge that accepts this share of words (n, E) drawn at random."""
        least = np.quantile(self.score(random),
                            [1 - accepted / words for words in range(1, SENTENCE_WORDS + 1)])
        return replace(self, threshold=float(least[0]),
                       margins=tuple(map(float, least - least[0])))


def learn(points: Array, labels: NDArray[np.intp], classes: tuple[str, ...], near: Array,
          background: Array, *, sharpness: float = SHARPNESS, start: Judge | None = None) -> Judge:
    """
    Return a judge, whose threshold is 0, of words behind the metric.

    Parameters
    ----------
    points: shape (n, E)
        Words that ask for a behaviour.
    labels: shape (n,)
        Which of `classes`.
    classes
        The behaviours; each needs at least one word.
    near: shape (m, E)
        Words that are like commands and are none; may be empty.
    background: shape (b, E)
        A sample of the vocabulary.
    sharpness
        Factor of the classifier's logits.
    start
        A judge of nearly the same words, from which the search begins.

    Raises
    ------
    EarError
        If a class has no word, or there are less than two.

    """
    counts = np.bincount(labels, minlength=len(classes))
    if len(classes) < 2 or not counts.all():
        lacking = [name for name, count in zip(classes, counts, strict=False) if not count]
        raise EarError('words: expected some for each of two or more behaviours, got '
                       f'{"none for " + lacking[0] if lacking else "one behaviour"}')
    classifier = classify(points, labels, len(classes),
                          None if start is None else start.classifier)
    gate = softmax.fit(
        np.concatenate([points, near, background]),
        np.concatenate([labels, np.full(len(near) + len(background), len(classes))]),
        np.concatenate([BEHAVIOUR_WEIGHT / counts[labels],
                        np.full(len(near), NEAR_WEIGHT / max(1, len(near))),
                        np.full(len(background), BACKGROUND_WEIGHT / max(1, len(background)))]),
        len(classes) + 1, GATE_STRENGTH, None if start is None else start.gate)
    means = unit(np.array([points[labels == index].mean(axis=0)
                           for index in range(len(classes))]))
    return Judge(classes, classifier, sharpness, gate, means, 0.0)


def classify(points: Array, labels: NDArray[np.intp], classes: int,
             start: Softmax | None = None) -> Softmax:
    """Return the classifier alone: which behaviour words (n, E) ask for."""
    return softmax.fit(points, labels, softmax.balanced(labels, classes), classes,
                       CLASSIFIER_STRENGTH, start)
