"""
Ears that heard all words of a lexicon but some families, one after the other, warm-started.

What is judged, and what nothing is claimed about, is background of none of them.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from training.grounding.ear import lesson_of
from training.grounding.lexicon import Lexicon
from w2b_core.behaviours import DEFAULT_BEHAVIOURS
from w2b_core.hearing import Ear, judge, learning, places
from w2b_core.hearing.judge import Judge
from w2b_core.hearing.metric import Metric
from w2b_core.vocabulary import Vocabulary

Array = NDArray[np.float64]

#: Letters by which near misses are grouped, as most stems are at least this long.
STEM_LETTERS = 5


class Folds:
    """
    A lexicon behind a metric, and the ears that it teaches.

    Attributes
    ----------
    words, vocabulary, metric
        As they were given.
    classes
        The behaviours that are learned.
    near: shape (m, E)
        Where the near misses lie.

    """

    def __init__(self, words: Lexicon, vocabulary: Vocabulary, metric: Metric) -> None:
        self.words, self.vocabulary, self.metric = words, vocabulary, metric
        # Sentences may ask for what the lexicon has no words for: *sit down*, *turn left*.
        self._behaviours = tuple(dict.fromkeys((*words.behaviours, *DEFAULT_BEHAVIOURS)))
        lesson = lesson_of(words, self._behaviours)
        self.classes = lesson.classes
        names = [word for word, kind in lesson.words.items() if kind in self.classes]
        self._names = np.array(names)
        self._labels = np.array([self.classes.index(lesson.words[word]) for word in names])
        self._families = np.array([lesson.families[word] for word in names])
        self._points = self.project(names)
        self.near = self.project(words.near_miss)
        self._stems = np.array([word[:STEM_LETTERS] for word in words.near_miss], dtype=str)
        unheard = {*words.words, *words.near_miss, *words.random, *words.common, *words.excluded,
                   *learning.with_inflections(lesson, vocabulary).words}
        sample, kept_out = learning.background(vocabulary, unheard)
        self._background, self._kept_out = self.project(sample), self.project(kept_out)
        self._full: Judge | None = None
        self._full = self.judge((), np.ones(len(self.near), dtype=bool))

    @property
    def families(self) -> tuple[str, ...]:
        """Of the scored behaviours."""
        return tuple(family for name in self.words.scored for family in self.words.of(name))

    def project(self, words: tuple[str, ...] | list[str]) -> Array:
        """Return words behind the metric, shape (n, E)."""
        return places.project(words, self.vocabulary, self.metric)

    def points(self, family: str) -> tuple[list[str], Array]:
        """Return a family's words and where they lie."""
        here = self._families == family
        return list(self._names[here]), self._points[here]

    def near_folds(self) -> NDArray[np.intp]:
        """Return the place (m,) of the family with which each near miss is left out, by stem."""
        _stems, places = np.unique(self._stems, return_inverse=True)
        return np.asarray(places % len(self.families), dtype=np.intp)

    def judge(self, without: Collection[str], near: NDArray[np.bool_]) -> Judge:
        """Return a judge that never heard some families, and of the near misses these (m,)."""
        heard = ~np.isin(self._families, list(without))
        return judge.learn(self._points[heard], self._labels[heard], self.classes,
                           self.near[near], self._background, start=self._full)

    def ear(self, without: Collection[str] = ()) -> Ear:
        """Return an ear that never heard some families."""
        learned = self.judge(without, np.ones(len(self.near), dtype=bool))
        out = [word for word, entry in self.words.words.items() if entry.family in without]
        return learning.assemble(lesson_of(self.words, self._behaviours, out), self.vocabulary,
                                 self.metric, learned.with_threshold(self._kept_out))
