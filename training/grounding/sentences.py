"""How many phrases of a lexicon are understood, by the ear with all its rules."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
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

    Attributes
    ----------
    shares
        By the ear that heard all words of the lexicon.
    one_left_out
        By ears that never heard one family of the phrase's words; mean over these families.
    all_left_out
        By ears that never heard any of them.
    wrong
        What the ear that heard all words gets wrong.

    """

    shares: Mapping[str, float | None]
    one_left_out: Mapping[str, float | None]
    all_left_out: Mapping[str, float | None]
    wrong: tuple[Heard, ...]


def measure(folds: Folds) -> Sentences:
    """Return how many phrases are right."""
    ears: dict[frozenset[str], Listener] = {}
    words = folds.words

    def right(phrase: TestPhrase, without: Iterable[str] = ()) -> float:
        families = frozenset(without)
        if families not in ears:
            ears[families] = Listener(folds.ear(families), folds.vocabulary, folds.metric)
        return float(_answer(ears[families], phrase) == phrase.label)

    scores = []
    for phrase in words.phrases:
        families = sorted({words.words[word].family for word in _words(phrase.text)
                           if word in words.words and word not in english.SIDES})
        one = [right(phrase, [family]) for family in families] or [right(phrase)]
        scores.append((right(phrase), sum(one) / len(one), right(phrase, families)))
    wrong = tuple(Heard(phrase, _answer(ears[frozenset()], phrase))
                  for phrase, score in zip(words.phrases, scores, strict=True) if not score[0])
    every, one_out, all_out = ([score[place] for score in scores] for place in range(3))
    return Sentences(_shares(words.phrases, every), _shares(words.phrases, one_out),
                     _shares(words.phrases, all_out), wrong)


def _answer(ear: Listener, phrase: TestPhrase) -> str:
    found = ear.understand(phrase.text)
    return found.behaviour if isinstance(found, Understood) else NONE


def _words(text: str) -> list[str]:
    try:
        return [word for clause in clauses(text) for word in clause.words]
    except VocabularyError:
        return []


def _shares(phrases: Sequence[TestPhrase], scores: Sequence[float]) -> dict[str, float | None]:
    shares: dict[str, float | None] = {}
    for kind in KINDS:
        found = [score for phrase, score in zip(phrases, scores, strict=True)
                 if phrase.kind == kind]
        shares[kind] = sum(found) / len(found) if found else None
    return shares
