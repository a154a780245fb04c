"""Teach an ear one more word: the legs stay as they are; other changed answers are listed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from w2b_core.hearing import english, learning, places
from w2b_core.hearing import metric as metrics
from w2b_core.hearing.ear import Ear, vectors_sha256
from w2b_core.hearing.errors import EarError
from w2b_core.hearing.inflections import inflections
from w2b_core.hearing.metric import Metric
from w2b_core.vocabulary import Vocabulary, VocabularyError

#: Words that the rules of sentences answer.
BY_RULE = english.NEGATIONS | english.FUNCTION_WORDS | english.TURNS
#: Words whose answers are projected at a time.
CHUNK_WORDS = 4096


@dataclass(frozen=True)
class Change:
    """A word that is answered otherwise; a behaviour is empty where the word is refused."""

    word: str
    before: str
    after: str


@dataclass(frozen=True)
class Taught:
    """
    The result of teaching.

    Attributes
    ----------
    ear
        The new one.
    words
        The word and those of its inflections that were added with it.
    changes
        All other words of the vocabulary that are answered otherwise now, frequent ones first.

    """

    ear: Ear
    words: tuple[str, ...]
    changes: tuple[Change, ...]


def teach(ear: Ear, vocabulary: Vocabulary, word: str, behaviour: str) -> Taught:
    """
    Return an ear that also knows `word`, and what else it answers otherwise.

    Raises
    ------
    EarError
        If the behaviour is none of the ear's, the word is not in the vocabulary or belongs to the
        rules, or the vocabulary has other vectors.

    """
    if behaviour not in ear.behaviours:
        raise EarError(f'behaviour: expected one of {", ".join(ear.behaviours)}, got '
                       f'{behaviour[:60]!r}')
    try:
        known = vocabulary.known(word)
    except VocabularyError as error:
        raise EarError(str(error)) from None
    _check(known, behaviour)
    metric = ear.bind(vocabulary).metric
    added = [known] if behaviour in english.SIDES else [
        form for form in inflections(known, places.spelt(vocabulary).__contains__)
        if form == known or form not in ear.words]
    words = {**ear.words, **dict.fromkeys(added, behaviour)}
    near = tuple(other for other in ear.near if other not in added)
    unclaimed = tuple(other for other in ear.unclaimed if other not in added)
    lesson = learning.Lesson(ear.behaviours, words, {}, near, unclaimed, ear.forms)
    for lost in set(ear.judge.classes) - set(words.values()):
        raise EarError(f'word {known!r}: expected to leave {lost} a word, got its last one')
    judge = learning.fit(lesson, vocabulary, metric, sharpness=ear.judge.sharpness,
                         start=ear.judge)
    how = {**ear.how, 'taught': [*ear.how.get('taught', []),
                                 {'word': known, 'behaviour': behaviour}]}
    taught = replace(ear, words=words, near=near, unclaimed=unclaimed, judge=judge, how=how,
                     vectors_sha256=vectors_sha256(list(words), vocabulary))
    return Taught(taught, tuple(added), tuple(_changes(ear, taught, vocabulary, metric, added)))


def _check(word: str, behaviour: str) -> None:
    """Raise an EarError for words that the rules of sentences decide."""
    if word == english.STOP and behaviour != english.STOP:
        raise EarError(f'word {word!r}: expected another word; it stops in any sentence without a '
                       'negation')
    if word in english.SIDES and behaviour != word:
        raise EarError(f'word {word!r}: expected another word; it is taken literally')
    for kind, words in (('negation', english.NEGATIONS), ('function word', english.FUNCTION_WORDS),
                        ('turn', english.TURNS)):
        if word in words:
            raise EarError(f'word {word!r}: expected a word that the vectors decide about, got a '
                           f'{kind}, about which the rules of sentences do')


def _changes(before: Ear, after: Ear, vocabulary: Vocabulary, metric: Metric,
             added: list[str]) -> Iterator[Change]:
    known = places.spelt(vocabulary)
    for start in range(0, min(len(vocabulary), places.SEARCHED_WORDS), CHUNK_WORDS):
        words = [word for word in vocabulary.words[start:start + CHUNK_WORDS]
                 if word not in added and (word in before.words or word not in BY_RULE)]
        points = places.project(words, vocabulary, metric, forms=before.forms, among=known)
        old, new = (_answers(ear, words, points) for ear in (before, after))
        yield from (Change(word, first, second) for word, first, second
                    in zip(words, old, new, strict=True) if first != second)


def _answers(ear: Ear, words: list[str], points: metrics.Array) -> list[str]:
    """Return what each word is answered by itself, '' if it is refused."""
    passes = ear.judge.familiarity(points) > 0
    best = ear.judge.classifier.logits(points).argmax(axis=1)
    return [ear.words.get(word) or (ear.judge.classes[index] if accepted and word not in ear.near
                                    else '')
            for word, accepted, index in zip(words, passes, best, strict=True)]
