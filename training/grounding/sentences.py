"""How many phrases of a lexicon are understood, by the ear with all its rules."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from training.grounding.folds import Folds
from training.grounding.lexicon import KINDS, NONE, TestPhrase
from w2b_core.hearing import Understood, english
from w2b_core.hearing.ear import Listener
from w2b_core.hearing.sentence import clauses
from w2b_core.vocabulary import VocabularyError


@dataclass(frozen=True)
class Heard:
    """A phrase, and what it was taken for (`NONE` for a refusal)."""

    phrase: TestPhrase
    answer: str


@dataclass(frozen=True)
class Sentences:
    """
    Shares of right answers by kind, None where a lexicon has no such phrases.

    `left_out`: by ears that never heard a family of any word of the phrase.
    """

    shares: Mapping[str, float | None]
    left_out: Mapping[str, float | None]
    wrong: tuple[Heard, ...]


def measure(folds: Folds) -> Sentences:
    """Return how many phrases are right: with all words, and with their families left out."""
    ears: dict[frozenset[str], Listener] = {}
    words = folds.words
    heard: list[Heard] = []
    unheard: list[Heard] = []
    for phrase in words.phrases:
        families = frozenset(words.words[word].family for word in _words(phrase.text)
                             if word in words.words and word not in english.SIDES)
        for without, answers in ((frozenset[str](), heard), (families, unheard)):
            if without not in ears:
                ears[without] = Listener(folds.ear(without), folds.vocabulary, folds.metric)
            answers.append(Heard(phrase, _answer(ears[without], phrase)))
    return Sentences(_shares(heard), _shares(unheard),
                     tuple(one for one in heard if one.answer != one.phrase.label))


def _answer(ear: Listener, phrase: TestPhrase) -> str:
    found = ear.understand(phrase.text)
    return found.behaviour if isinstance(found, Understood) else NONE


def _words(text: str) -> list[str]:
    try:
        return [word for clause in clauses(text) for word in clause.words]
    except VocabularyError:
        return []


def _shares(heard: list[Heard]) -> dict[str, float | None]:
    shares: dict[str, float | None] = {}
    for kind in KINDS:
        right = [one.answer == one.phrase.label for one in heard if one.phrase.kind == kind]
        shares[kind] = sum(right) / len(right) if right else None
    return shares

