"""Words to suggest while a person types: those of the training first, then the vocabulary's."""

from __future__ import annotations

from functools import cached_property
from itertools import chain

from w2b_core.controller import file as controller_file
from w2b_core.hearing import Ear
from w2b_core.vocabulary import store
from w2b_core.vocabulary.default import behaviour_words

#: Of one prefix.
MOST = 8
Suggestion = dict[str, str]


def trained_words(controller: str) -> dict[str, str]:
    """
    Return the words of a controller's training with the behaviour of each.

    Parameters
    ----------
    controller
        Name or path, as the brain's parameter has it.

    Raises
    ------
    ValueError, OSError
        If there is no such controller here: the brain may run on another machine.

    """
    found = controller_file.load(controller_file.resolve(controller))
    if isinstance(found.ear, Ear):
        return dict(found.ear.words)
    return {word.word: word.behaviour for word in found.words}


class Words:
    """The words of the default vocabulary, by prefix."""

    @cached_property
    def _everyday(self) -> list[str]:
        """What people would say to a robot."""
        return list(behaviour_words())

    @cached_property
    def _all(self) -> list[str]:
        """All words, frequent ones first."""
        folder = store.find(store.DEFAULT)
        if folder is None:
            return []
        words = (folder / 'words.txt').read_text(encoding='utf-8').split('\n')
        return [word for word in words if word.isalpha()]

    def suggest(self, text: str, trained: dict[str, str]) -> list[Suggestion]:
        """
        Return words that complete the last word of a text, at most `MOST`.

        Each has `word`, and `behaviour` if it is one of the training. Without a text: one trained
        word of each behaviour after another.
        """
        prefix = text.split(' ')[-1].lower()
        if not prefix:
            return [] if text else self._opening(trained)
        found = {word: behaviour for word, behaviour in trained.items()
                 if word.startswith(prefix)}
        for word in chain(self._everyday, self._all):
            if len(found) >= MOST:
                break
            if word.startswith(prefix):
                found.setdefault(word, '')
        return _suggestions(found)[:MOST]

    @staticmethod
    def _opening(trained: dict[str, str]) -> list[Suggestion]:
        chosen: dict[str, str] = {}
        for behaviour in dict.fromkeys(trained.values()):
            own = [word for word, asked in trained.items() if asked == behaviour]
            chosen[behaviour if behaviour in own else own[0]] = behaviour
        return _suggestions(chosen)


def _suggestions(behaviours: dict[str, str]) -> list[Suggestion]:
    return [{'word': word, 'behaviour': behaviour} for word, behaviour in behaviours.items()]
