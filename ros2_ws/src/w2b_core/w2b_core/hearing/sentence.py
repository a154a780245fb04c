"""
What a sentence asks for, once each of its words is judged: negation, clauses, priority.

No rule here looks at vectors. In doubt a robot is not moved: a stop word wins over any motion, a
negated motion is a stop, a negated stop changes nothing, two motions in two clauses are refused.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from w2b_core.hearing import english
from w2b_core.hearing.answers import Role, WordHeard
from w2b_core.hearing.english import STOP
from w2b_core.vocabulary.text import tokens

#: Judges one word by itself.
JudgeWord = Callable[[str], WordHeard]

_APOSTROPHES = re.compile(r"['’‘´`]")
_BREAKS = re.compile(r'[,;:!?\n]+|\.+(?!\d)')
_HYPHENS = re.compile(r'[-‐‑_]')


@dataclass(frozen=True)
class Clause:
    """Words of a sentence up to a comma or a conjunction; `carried`: a negation goes on in it."""

    words: tuple[str, ...]
    carried: bool = False


@dataclass(frozen=True)
class Asked:
    """
    What a sentence asks for.

    Attributes
    ----------
    behaviour
        Empty if it asks for nothing, or the sentence is ambiguous.
    because
        The word that decided; None if none did.
    problem
        Why it is refused although it has commands; empty otherwise.
    words
        What each word did.

    """

    behaviour: str
    because: WordHeard | None
    problem: str
    words: tuple[WordHeard, ...]


def clauses(text: str) -> tuple[Clause, ...]:
    """
    Return the clauses of a text, in lower case, without apostrophes and hyphens.

    Raises
    ------
    VocabularyError
        If the text is no string, too long or has no words.

    """
    tokens(text)
    parts = _BREAKS.split(_HYPHENS.sub(' ', unicodedata.normalize('NFKC', text)))
    found: list[Clause] = []
    for part in parts:
        words: list[str] = []
        carried = False
        for word in (_APOSTROPHES.sub('', word.lower()) for word in _words(part)):
            if word in english.CARRYING or word in english.ENDING:
                found.append(Clause(tuple(words), carried))
                carried = word in english.CARRYING
                words = []
            else:
                words.append(word)
        found.append(Clause(tuple(words), carried))
    return tuple(clause for clause in found if clause.words)


def asked(sentence: Sequence[Clause], judge: JudgeWord, priority: Sequence[str],
          margins: Sequence[float] = (0.0,)) -> Asked:
    """
    Return what a sentence asks for.

    Parameters
    ----------
    sentence
        Its clauses.
    judge
        Judges one word by itself.
    priority
        The behaviours; of two that one clause asks for, the earlier wins.
    margins
        Least familiarity of the word that decides a sentence of 1, 2, 3 ... words with a meaning,
        unless it is known by heart. What only stops another command needs none.

    """
    parts: list[list[WordHeard]] = []
    turns = negated = False
    alone = sum(len(clause.words) for clause in sentence) == 1
    for clause in sentence:
        negated = negated and clause.carried
        words, negated, turn = _clause(clause.words, judge, negated, alone, priority)
        turns |= turn
        parts.append(words)
    parts = _without_guesses(parts)
    heard = tuple(word for part in parts for word in part)
    wanted = [min(commands, key=lambda word: priority.index(word.behaviour)) for part in parts
              if (commands := [word for word in part if word.behaviour])]
    if not wanted:
        return Asked('', None, 'left or right?' if turns else '', heard)
    first = min(wanted, key=lambda word: priority.index(word.behaviour))
    rivals = sorted({word.behaviour for word in wanted}, key=priority.index)
    problem = ''
    if _too_unlike(first.behaviour, parts, margins):
        problem = f'has {first.text!r}, which is too unlike a command for a sentence'
    elif first.behaviour != STOP and len(rivals) > 1:
        problem = f'asks for {" and ".join(rivals)}: say one at a time'
    elif first.behaviour != STOP:
        problem = _doubt(sentence, heard)
    return Asked('' if problem else first.behaviour, first, problem, heard)


def _without_guesses(parts: Sequence[Sequence[WordHeard]]) -> list[list[WordHeard]]:
    """
    Beside a command that is known by heart, take guessed ones for no command.

    But for stops, and for what directly follows a known motion: in *walk backwards* it says how.
    """
    if not any(word.by_heart and word.behaviour for part in parts for word in part):
        return [list(part) for part in parts]
    return [[_no_command(word) if _is_guessed_motion(word) and not _says_how(part, place) else word
             for place, word in enumerate(part)] for part in parts]


def _is_guessed_motion(word: WordHeard) -> bool:
    return word.behaviour not in ('', STOP) and not word.by_heart


def _no_command(word: WordHeard) -> WordHeard:
    return replace(word, role=Role.OTHER, behaviour='')


def _says_how(part: Sequence[WordHeard], place: int) -> bool:
    """Return whether a word directly follows a motion that is known by heart."""
    before = part[place - 1] if place else None
    return before is not None and before.by_heart and before.behaviour not in ('', STOP)


def _too_unlike(behaviour: str, parts: Sequence[Sequence[WordHeard]], margins: Sequence[float]
                ) -> bool:
    """Return whether nothing of a behaviour is enough like a command for the whole sentence."""
    heard = [word for part in parts for word in part]
    meant = sum(word.role in (Role.COMMAND, Role.NEGATED, Role.OTHER, Role.UNKNOWN)
                for word in heard)
    margin = margins[min(meant, len(margins)) - 1]
    if behaviour == STOP and any(word.behaviour not in ('', STOP) for word in heard):
        return False
    return not any(word.by_heart or word.role is Role.NEGATED or word.familiarity > margin
                   or _says_how(part, place)
                   for part in parts for place, word in enumerate(part)
                   if word.behaviour == behaviour)


def _words(part: str) -> tuple[str, ...]:
    """Return the words between two commas; none are no error."""
    return tokens(part) if any(letter.isalnum() for letter in part) else ()


def _clause(words: Sequence[str], judge: JudgeWord, negated: bool, alone: bool,
            priority: Sequence[str]) -> tuple[list[WordHeard], bool, bool]:
    """Return what the words of a clause do, whether it ends negated, and whether it turns."""
    heard: list[WordHeard] = []
    spent = turns = False
    position = 0
    while position < len(words):
        word, taken = _entry(words[position:], judge, alone, priority)
        if not negated and position and words[position - 1] in english.DEFINITE \
                and _is_guessed_motion(word):
            word = _no_command(word)  # *the table* is a thing
        position += taken
        if word.role is Role.NEGATION:
            negated, spent = True, False
        elif word.role is Role.COMMAND and negated:
            # What follows the negated word in its clause is negated with it.
            behaviour = '' if spent or word.behaviour == STOP else STOP
            spent = True
            word = replace(word, role=Role.NEGATED, behaviour=behaviour)
        turns |= word.role is Role.DIRECTION and word.text in english.TURNS
        heard.append(word)
    return heard, negated, turns and not negated


def _entry(words: Sequence[str], judge: JudgeWord, alone: bool, priority: Sequence[str]
           ) -> tuple[WordHeard, int]:
    """Return the first word or known pair of words, and how many words it takes."""
    first = words[0]
    if first in english.NEGATIONS:
        return WordHeard(first, Role.NEGATION), 1
    second = next((index for index in range(1, len(words))
                   if words[index] not in english.ARTICLES), len(words))
    if second < len(words):
        behaviour = english.PAIRS.get((first, words[second]), '')
        if behaviour in priority:
            text = ' '.join(words[:second + 1])
            return WordHeard(text, Role.COMMAND, behaviour, 1.0,
                             nearest=((text, 1.0),), by_heart=True), second + 1
    if first in english.SIDES and not alone:
        return WordHeard(first, Role.DIRECTION), 1
    return judge(first), 1


def _doubt(sentence: Sequence[Clause], heard: Sequence[WordHeard]) -> str:
    """Return why a motion is not believed: the sentence states or asks something, else ''."""
    words = [word for clause in sentence for word in clause.words]
    commands = sum(bool(word.behaviour) for word in heard)
    others = sum(word.role in (Role.OTHER, Role.UNKNOWN) for word in heard)
    if len(words) > 1 and words[0] in english.STATEMENTS \
            and not english.WISHES.intersection(words):
        return 'is a statement or a question, not a command'
    if others > 2 * commands:
        return 'speaks of too much else to be a command'
    return ''
