"""Training an ear: words and their behaviours in, an ear out; the same way for teaching."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from w2b_core.hearing import english, judge
from w2b_core.hearing.ear import PRIORITY, Ear, vectors_sha256
from w2b_core.hearing.errors import EarError
from w2b_core.hearing.inflections import inflections
from w2b_core.hearing.judge import Judge
from w2b_core.hearing.metric import Metric
from w2b_core.hearing.places import SEARCHED_WORDS, project, spelt
from w2b_core.hearing.softmax import Softmax
from w2b_core.vocabulary import Vocabulary

Array = NDArray[np.float64]

#: Of the background, all of the most frequent words, so many, and a sample of the others.
FREQUENT_WORDS, OTHER_WORDS = 1500, 4000
#: Every so many words are kept out of the gate's training: they set its threshold.
KEPT_OUT = 5
SHARPNESSES = np.geomspace(0.5, 8.0, 33)
DECIMALS = 5


@dataclass(frozen=True)
class Lesson:
    """
    What an ear learns.

    Attributes
    ----------
    behaviours
        All behaviours of the controller in the order of its command.
    words
        Words -> behaviours.
    families
        Words -> stem families, for the calibration; words without one are their own.
    near
        Words that are like commands and are none.
    unclaimed
        Words that nothing is claimed about, neither commands nor background.
    forms
        Whether a word's inflections count where it lies: see `places`.

    """

    behaviours: tuple[str, ...]
    words: Mapping[str, str]
    families: Mapping[str, str] = field(default_factory=dict)
    near: tuple[str, ...] = ()
    unclaimed: tuple[str, ...] = ()
    forms: bool = True

    @property
    def classes(self) -> tuple[str, ...]:
        """The behaviours that are learned rather than taken literally."""
        return tuple(name for name in self.behaviours
                     if name not in english.SIDES and name in self.words.values())


def with_inflections(lesson: Lesson, vocabulary: Vocabulary) -> Lesson:
    """Return the lesson with all inflections of its words that the vocabulary has."""
    taken, known = {*lesson.words, *lesson.near, *lesson.unclaimed}, spelt(vocabulary)
    words, families = dict(lesson.words), dict(lesson.families)
    for word, behaviour in lesson.words.items():
        if behaviour in english.SIDES:
            continue
        for form in inflections(word, known.__contains__):
            if form not in taken:
                words.setdefault(form, behaviour)
                families.setdefault(form, lesson.families.get(word, word))
    return replace(lesson, words=words, families=families)


def background(vocabulary: Vocabulary, without: Collection[str]
               ) -> tuple[list[str], list[str]]:
    """Return a sample of a vocabulary for the gate's training, and another for its threshold."""
    usable = list(_usable(vocabulary, frozenset(without)))
    kept_out = usable[KEPT_OUT - 1::KEPT_OUT]
    others = [word for index, word in enumerate(usable) if index % KEPT_OUT != KEPT_OUT - 1]
    rare = others[FREQUENT_WORDS:]
    return others[:FREQUENT_WORDS] + rare[::max(1, len(rare) // OTHER_WORDS)], kept_out


def _usable(vocabulary: Vocabulary, without: frozenset[str]) -> Iterator[str]:
    for word in vocabulary.words[:SEARCHED_WORDS]:
        if word.isalpha() and word.islower() and word not in without:
            yield word


def train(lesson: Lesson, vocabulary: Vocabulary, metric: Metric, *,
          how: Mapping[str, Any] | None = None) -> Ear:
    """
    Return an ear; the same inputs give the same ear.

    Raises
    ------
    EarError
        If a word is not in the vocabulary or asks for an unknown behaviour, or a behaviour lacks
        words.

    """
    for word, behaviour in lesson.words.items():
        if behaviour not in lesson.behaviours:
            raise EarError(f'word {word!r}: expected one of {", ".join(lesson.behaviours)}, got '
                           f'{behaviour!r}')
    if english.STOP not in lesson.behaviours:
        raise EarError(f'behaviours: expected {english.STOP!r} among them, got '
                       f'{", ".join(lesson.behaviours)}')
    missing = [word for word in (*lesson.words, *lesson.near) if word not in vocabulary]
    if missing:
        raise EarError(f'words: expected words of the vocabulary {vocabulary.source}, got '
                       f'{len(missing)} others, such as {missing[0]!r}')
    learned = fit(lesson, vocabulary, metric, sharpness=calibrate(lesson, vocabulary, metric))
    return assemble(lesson, vocabulary, metric, learned, how)


def assemble(lesson: Lesson, vocabulary: Vocabulary, metric: Metric, learned: Judge,
             how: Mapping[str, Any] | None = None) -> Ear:
    """Return the ear of a lesson and what was learned from it."""
    priority = tuple(sorted(lesson.behaviours, key=lambda name: (
        PRIORITY.index(name) if name in PRIORITY else len(PRIORITY))))
    return Ear(lesson.behaviours, dict(lesson.words), lesson.near, learned, metric.sha256,
               vocabulary.source, vectors_sha256(list(lesson.words), vocabulary),
               vocabulary.dimensions, priority, lesson.unclaimed, dict(how or {}), lesson.forms)


def fit(lesson: Lesson, vocabulary: Vocabulary, metric: Metric, *, sharpness: float,
        start: Judge | None = None) -> Judge:
    """Return the judge of a lesson, with its threshold, rounded as files hold it."""
    classes = lesson.classes
    names = [word for word, behaviour in lesson.words.items() if behaviour in classes]
    labels = np.array([classes.index(lesson.words[word]) for word in names])
    known = spelt(vocabulary)
    related = {form for word in names for form in inflections(word, known.__contains__)}
    sample, kept_out = background(
        vocabulary, {*lesson.words, *related, *lesson.near, *lesson.unclaimed})

    def place(words: Sequence[str]) -> Array:
        return project(words, vocabulary, metric, forms=lesson.forms, among=known)

    learned = judge.learn(place(names), labels, classes, place(lesson.near), place(sample),
                          sharpness=sharpness, start=start)
    return rounded(learned.with_threshold(place(kept_out)))


def calibrate(lesson: Lesson, vocabulary: Vocabulary, metric: Metric) -> float:
    """Return the factor of the logits under which words of left-out families are likeliest."""
    classes = lesson.classes
    names = [word for word, behaviour in lesson.words.items() if behaviour in classes]
    points = project(names, vocabulary, metric, forms=lesson.forms)
    labels = np.array([classes.index(lesson.words[word]) for word in names])
    families = np.array([lesson.families.get(word, word) for word in names])
    logits = np.zeros((len(names), len(classes)))
    start = judge.classify(points, labels, len(classes))
    for family in dict.fromkeys(families):
        out = families == family
        if np.bincount(labels[~out], minlength=len(classes)).all():
            logits[out] = judge.classify(points[~out], labels[~out], len(classes),
                                         start).logits(points[out])
    best = min(SHARPNESSES, key=lambda factor: _loss(logits * factor, labels))
    return float(round(best, DECIMALS))


def rounded(learned: Judge) -> Judge:
    """Return a judge with the decimals that files keep."""
    def softmax(value: Softmax) -> Softmax:
        return Softmax(np.round(value.weights, DECIMALS), np.round(value.biases, DECIMALS))
    return replace(learned, classifier=softmax(learned.classifier), gate=softmax(learned.gate),
                   means=np.round(learned.means, DECIMALS),
                   threshold=round(learned.threshold, DECIMALS),
                   margins=tuple(round(margin, DECIMALS) for margin in learned.margins))


def _loss(logits: Array, labels: NDArray[np.intp]) -> float:
    """Return the mean negative log likelihood, every class with the same weight."""
    peak = logits.max(axis=1, keepdims=True)
    losses = np.log(np.exp(logits - peak).sum(axis=1)) + peak[:, 0] \
        - logits[np.arange(len(labels)), labels]
    return float(np.mean([losses[labels == label].mean() for label in np.unique(labels)]))
