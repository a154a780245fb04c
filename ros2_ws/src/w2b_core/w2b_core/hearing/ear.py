"""
The ear: words in, a behaviour or a refusal out.

A sentence is judged once, not at every step: vector, learned metric, probabilities of the
behaviours and familiarity; then the rules of `sentence`. The words of the training are known by
heart. An ear belongs to one vocabulary's vectors and refuses others.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from w2b_core.hearing import english, places
from w2b_core.hearing import metric as metrics
from w2b_core.hearing.answers import Near, Refused, Role, Understood, WordHeard
from w2b_core.hearing.errors import EarError
from w2b_core.hearing.judge import Judge
from w2b_core.hearing.metric import Metric
from w2b_core.hearing.sentence import Asked, asked, clauses
from w2b_core.vocabulary import UnknownWordError, Vocabulary, VocabularyError

Array = NDArray[np.float64]

NEAREST_SHOWN = 3
#: Which behaviour wins where one clause asks for several; behaviours of other names come last.
PRIORITY = ('stop', 'sit', 'backward', 'left', 'right', 'forward')


@dataclass(frozen=True, eq=False)
class Ear:
    """
    What a controller needs to understand words.

    Attributes
    ----------
    behaviours
        All behaviours of the controller in the order of its command, K; the judge may know fewer.
    words
        The words of the training -> their behaviours.
    near
        Words of the training that are like commands and are none.
    judge
        What was learned from them.
    metric_sha256
        Of the metric that the judge stands behind.
    vocabulary, vectors_sha256
        Where the vectors came from, and a hash of those of `words`.
    vector_length
        Of the vectors, D.
    priority
        The behaviours, the one first that wins in a clause.
    unclaimed
        Words that nothing was claimed about: teaching takes none of them for background.
    how
        How the ear was made, for people.
    forms
        Whether a word's inflections count where it lies: see `places`.

    """

    behaviours: tuple[str, ...]
    words: Mapping[str, str]
    near: tuple[str, ...]
    judge: Judge
    metric_sha256: str
    vocabulary: str
    vectors_sha256: str
    vector_length: int
    priority: tuple[str, ...]
    unclaimed: tuple[str, ...] = ()
    how: Mapping[str, Any] = field(default_factory=dict)
    forms: bool = True
    _bound: dict[int, Listener] = field(default_factory=dict, init=False, repr=False)

    def to_json(self) -> dict[str, Any]:
        """Return the ear as JSON values, for a controller file."""
        from w2b_core.hearing import ear_json

        return ear_json.to_json(self)

    @classmethod
    def from_json(cls, value: object) -> Ear:
        """Return the ear that `to_json` returned; JsonFileError names what is damaged."""
        from w2b_core.hearing import ear_json

        return ear_json.from_json(value)

    def tuned(self, strictness: float = 0.0, priority: Sequence[str] = ()) -> Ear:
        """
        Return the ear with another threshold or priority.

        Parameters
        ----------
        strictness
            Added to the threshold: how much more a guessed word must be like a command.
        priority
            All behaviours, stop first, the others in the order in which they win; by default as
            it is.

        Raises
        ------
        EarError
            If a number is not finite, or the priority lacks a behaviour or begins with a motion.

        """
        if not np.isfinite(strictness):
            raise EarError(f'strictness: expected a finite number, got {strictness!r}')
        if priority and (sorted(priority) != sorted(self.behaviours)
                         or priority[0] != english.STOP):
            raise EarError(f'priority: expected {english.STOP} and then the others of '
                           f'{", ".join(self.behaviours)}, got {", ".join(priority)[:200]}')
        judge = replace(self.judge, threshold=self.judge.threshold + strictness)
        return replace(self, judge=judge, priority=tuple(priority) or self.priority)

    def understand(self, text: str | Sequence[str], vocabulary: Vocabulary
                   ) -> Understood | Refused:
        """
        Return what a command asks for, or why it is refused.

        Parameters
        ----------
        text
            A word or a sentence, or its words.
        vocabulary
            The vectors that the ear was trained on.

        Raises
        ------
        EarError
            If the vocabulary has other vectors, or the metric is not installed.

        """
        if not isinstance(text, str):
            text = ' '.join(text)
        return self.bind(vocabulary).understand(text)

    def bind(self, vocabulary: Vocabulary) -> Listener:
        """Return the ear with its vocabulary, checked; made once (EarError as `understand`)."""
        listener = self._bound.get(id(vocabulary))
        if vocabulary.dimensions != self.vector_length:
            raise EarError(f'vocabulary {vocabulary.source}: expected vectors of '
                           f'{self.vector_length} elements, got {vocabulary.dimensions}; train '
                           'the ear on it with `python -m training ear --vocabulary NAME`')
        if listener is None or listener.vocabulary is not vocabulary:
            listener = Listener(self, vocabulary, metrics.load(self.metric_sha256, vocabulary))
            self._bound.clear()
            self._bound[id(vocabulary)] = listener
        return listener


def vectors_sha256(words: Sequence[str], vocabulary: Vocabulary) -> str:
    """Return a hash of words' vectors, as float32 in alphabetical order of the words."""
    digest = hashlib.sha256()
    digest.update(vocabulary.matrix(sorted(words)).astype('<f4').tobytes())
    return digest.hexdigest()


class Listener:
    """
    An ear with its vocabulary.

    Raises
    ------
    EarError
        If the vocabulary's vectors are not those that the ear was trained on.

    """

    def __init__(self, ear: Ear, vocabulary: Vocabulary, metric: Metric) -> None:
        self.ear, self.vocabulary, self.metric = ear, vocabulary, metric
        again = 'train the ear on it with `python -m training ear --vocabulary NAME`'
        missing = next((word for word in ear.words if word not in vocabulary), None)
        if missing is not None:
            raise EarError(f'vocabulary {vocabulary.source}: expected the words of the ear, which '
                           f'was trained on {ear.vocabulary}, got none called {missing!r}; {again}')
        if vectors_sha256(list(ear.words), vocabulary) != ear.vectors_sha256:
            raise EarError(f'vocabulary {vocabulary.source}: expected the vectors of '
                           f'{ear.vocabulary}, which the ear was trained on, got others; {again}')
        vocabulary.prepare()
        self._names = tuple(ear.words)
        self._spelt = places.spelt(vocabulary)
        self._known = self.points(self._names)

    def points(self, words: Sequence[str]) -> Array:
        """Return words of the vocabulary behind the metric, shape (n, E)."""
        return places.project(words, self.vocabulary, self.metric, forms=self.ear.forms,
                              among=self._spelt)

    def understand(self, text: str) -> Understood | Refused:
        """Return what a command asks for, or why it is refused."""
        try:
            sentence = clauses(text)
        except VocabularyError as error:
            return Refused(str(error))
        found = self._misspelt(asked(
            sentence, self.judge_word, self.ear.priority, self.ear.judge.margins))
        if found.behaviour and found.because is not None:
            command = np.array([float(name == found.behaviour) for name in self.ear.behaviours])
            return Understood(found.behaviour, found.because.probability, command,
                              found.because.nearest, found.words)
        return self._refused(text, found)

    def _misspelt(self, found: Asked) -> Asked:
        """Refuse a motion beside a word that may be a misspelt command or negation."""
        if found.behaviour and found.behaviour != english.STOP:
            for word in found.words:
                meant = [near for near in self.vocabulary.suggestions(word.text)
                         if near in self.ear.words] if word.role is Role.UNKNOWN else []
                if meant:
                    return replace(found, behaviour='', problem=f'has the unknown word '
                                   f'{word.text!r}; did you mean {" or ".join(meant)}?')
        return found

    def judge_word(self, word: str) -> WordHeard:
        """Return what one word asks for by itself, by heart or by its vector."""
        if word not in self.ear.words:
            if word in english.TURNS:
                return WordHeard(word, Role.DIRECTION)
            if word in english.FUNCTION_WORDS or word.isdigit():
                return WordHeard(word, Role.FUNCTION)
        known = self.vocabulary.find(word)
        if known is None:
            return WordHeard(word, Role.UNKNOWN)
        point = self.points([known])[0]
        nearest = self._nearest(known, point)
        familiarity = float(self.ear.judge.familiarity(point))
        if known in self.ear.words or known == english.STOP:
            behaviour = self.ear.words.get(known, english.STOP)
            return WordHeard(known, Role.COMMAND, behaviour, 1.0, familiarity, nearest,
                             by_heart=True)
        if familiarity <= 0 or known in self.ear.near:
            return WordHeard(known, Role.OTHER, '', 0.0, familiarity, nearest)
        probabilities = self.ear.judge.probabilities(point)
        best = int(probabilities.argmax())
        return WordHeard(known, Role.COMMAND, self.ear.judge.classes[best],
                         float(probabilities[best]), familiarity, nearest)

    def _nearest(self, word: str, point: Array) -> tuple[Near, ...]:
        """Return the nearest known words but `word` itself, with their cosines."""
        cosines = self._known @ point
        order = np.argsort(-cosines)[:NEAREST_SHOWN + 1]
        return tuple((self._names[index], float(cosines[index])) for index in order
                     if self._names[index] != word)[:NEAREST_SHOWN]

    def _refused(self, text: str, found: Asked) -> Refused:
        """Return a refusal with the reason that helps most."""
        measured = [word for word in found.words if word.nearest]
        closest = max(measured, key=lambda word: word.familiarity, default=None)
        nearest = () if closest is None else closest.nearest
        unknown = [word for word in found.words if word.role is Role.UNKNOWN]
        asks = ', '.join(self.ear.behaviours)
        if found.problem:
            reason = found.problem if found.problem == 'left or right?' else f'it {found.problem}'
        elif any(word.role is Role.NEGATED for word in found.words):
            reason = 'a negated stop changes nothing'
        elif unknown:
            word = unknown[0].text
            reason = str(UnknownWordError(word, self.vocabulary.suggestions(word),
                                          self.vocabulary.source))
        elif closest is not None:
            near, cosine = nearest[0]
            reason = (f'{closest.text!r} is no command: expected one that asks for {asks}; '
                      f'the nearest known word is {near!r} ({cosine:.2f})')
        elif any(word.text in english.SIDES for word in found.words):
            reason = 'left or right of what? say "turn left" or "turn right"'
        else:
            reason = f'no command in it: expected a word that asks for {asks}'
        return Refused(reason, nearest, found.words)
