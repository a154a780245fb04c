"""
Accuracy on words of unseen stem families: k words a behaviour, and one family left out.

k words: one word from each of k families of every behaviour is heard, with its inflections; all
words of all other families are asked. All words: every family in turn is left out and asked.
Accuracy is macro: the mean of the behaviours' shares of right words.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from training.grounding.lexicon import Lexicon
from w2b_core.hearing import judge
from w2b_core.hearing.inflections import inflections

Array = NDArray[np.float64]
Labels = NDArray[np.intp]

#: Points (n, E), labels (n,) and the number of classes -> a function of points to labels.
Learner = Callable[[Array, Labels, int], Callable[[Array], Labels]]
#: Words -> points (n, E).
Points = Callable[[Sequence[str]], Array]

BOOTSTRAPS = 2000
INTERVAL = (2.5, 97.5)


@dataclass(frozen=True)
class Accuracy:
    """
    How many words are right.

    Attributes
    ----------
    macro, low, high
        Mean of the behaviours' shares, and the middle 95 % of it: over the splits, or over
        families drawn with replacement.
    per_behaviour
        Shares.
    splits
        Macro accuracy of each split; empty for left-out families.
    answers
        Word -> what it was taken for, of left-out families.

    """

    macro: float
    low: float
    high: float
    per_behaviour: Mapping[str, float]
    splits: tuple[float, ...] = ()
    answers: Mapping[str, str] | None = None


def logistic(points: Array, labels: Labels, classes: int) -> Callable[[Array], Labels]:
    """Learn as the ear does: logistic regression that weighs every class the same."""
    classifier = judge.classify(points, labels, classes)
    return lambda others: classifier.logits(others).argmax(axis=-1)


def nearest_mean(points: Array, labels: Labels, classes: int) -> Callable[[Array], Labels]:
    """Learn the classes' mean directions; the cosine decides."""
    means = np.array([points[labels == label].mean(axis=0) for label in range(classes)])
    means /= np.linalg.norm(means, axis=1, keepdims=True)
    return lambda others: (others @ means.T).argmax(axis=-1)


def of_few_words(words: Lexicon, points: Points, count: int, splits: int, *,
                 learner: Learner = logistic, forms: frozenset[str] = frozenset(),
                 shuffled: bool = False) -> Accuracy | None:
    """
    Return the accuracy of ears that heard `count` words a behaviour, None if families are lacking.

    Parameters
    ----------
    words, points
        What is judged, and where the words lie.
    count, splits
        Words a behaviour (k), and how often they are drawn anew.
    learner
        What learns.
    forms
        Words among which the inflections of the heard ones are looked for.
    shuffled
        Whether the labels of the heard words are shuffled: a control.

    """
    families = [words.of(behaviour) for behaviour in words.scored]
    if any(len(found) <= count for found in families):
        return None
    draw = np.random.default_rng(count)
    shares = np.array([_split(families, points, count, draw, learner, forms, shuffled)
                       for _ in range(splits)])
    macros = shares.mean(axis=1)
    low, high = np.percentile(macros, INTERVAL)
    return Accuracy(float(macros.mean()), float(low), float(high),
                    dict(zip(words.scored, map(float, shares.mean(axis=0)), strict=True)),
                    tuple(map(float, macros)))


def _split(families: Sequence[Mapping[str, Sequence[str]]], points: Points, count: int,
           draw: np.random.Generator, learner: Learner, forms: frozenset[str], shuffled: bool
           ) -> list[float]:
    """Return the behaviours' shares of right words in one split."""
    heard: list[str] = []
    asked: list[list[str]] = []
    for found in families:
        names = sorted(found)
        chosen = {names[index] for index in draw.choice(len(names), count, replace=False)}
        heard += [found[name][int(draw.integers(len(found[name])))]
                  for name in names if name in chosen]
        asked.append([word for name in names if name not in chosen for word in found[name]])
    kinds = np.repeat(np.arange(len(families)), count)
    if shuffled:
        kinds = draw.permutation(kinds)
    others = {word for group in asked for word in group}
    learned: list[str] = []
    labels: list[int] = []
    for word, kind in zip(heard, kinds, strict=True):
        group = [form for form in inflections(word, forms.__contains__)
                 if form not in others and form not in learned]
        learned += group
        labels += [int(kind)] * len(group)
    answer = learner(points(learned), np.array(labels), len(families))
    return [float((answer(points(group)) == index).mean()) for index, group in enumerate(asked)]


def of_left_out_families(words: Lexicon, points: Points, *, learner: Learner = logistic
                         ) -> Accuracy:
    """Return the accuracy on each family by ears that heard all the others."""
    names = [word for word, entry in words.words.items() if entry.behaviour in words.scored]
    labels = np.array([words.scored.index(words.words[word].behaviour) for word in names])
    families = np.array([words.words[word].family for word in names])
    every = points(names)
    answers = np.zeros(len(names), dtype=np.intp)
    for family in dict.fromkeys(families):
        out = families == family
        answers[out] = learner(every[~out], labels[~out], len(words.scored))(every[out])
    right = answers == labels
    shares = {behaviour: float(right[labels == index].mean())
              for index, behaviour in enumerate(words.scored)}
    low, high = _interval(right, labels, families)
    return Accuracy(float(np.mean(list(shares.values()))), low, high, shares, (),
                    {word: words.scored[answer]
                     for word, answer in zip(names, answers, strict=True)})


def _interval(right: NDArray[np.bool_], labels: Labels, families: NDArray[np.str_]
              ) -> tuple[float, float]:
    """Return the middle 95 % of the macro accuracy over families drawn with replacement."""
    draw = np.random.default_rng(0)
    macros = np.zeros(BOOTSTRAPS)
    kinds = np.unique(labels)
    for label in kinds:
        names = np.unique(families[labels == label])
        counts = np.array([(families == name).sum() for name in names])
        hits = np.array([right[families == name].sum() for name in names])
        drawn = draw.integers(0, len(names), (BOOTSTRAPS, len(names)))
        macros += hits[drawn].sum(axis=1) / counts[drawn].sum(axis=1) / len(kinds)
    low, high = np.percentile(macros, INTERVAL)
    return float(low), float(high)
