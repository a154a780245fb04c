"""Hearing a command: text -> signal for the network, and the answer that the sender gets."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from w2b_controller.controller_file import Controller
from w2b_controller.status import Level
from w2b_controller.vocabulary import UnknownWordError, Vocabulary

#: Longest command, and most words in one: priming takes time for each word, and the robot waits.
MAX_CHARACTERS = 200
MAX_WORDS = 16
#: Trained words that an answer compares each word with.
NEAREST_SHOWN = 3


@dataclass(frozen=True)
class Answer:
    """
    What became of a command.

    `received` counts the commands so far, so that a sender can tell the answer to its own from an
    earlier one; `heard` is the text, cut short as `quoted` does.
    """

    level: Level
    message: str
    received: int
    heard: str
    values: Mapping[str, str] = field(default_factory=dict)


def quoted(text: str) -> str:
    """Return the text on one line and no longer than a command may be."""
    line = ''.join(character if character.isprintable() else ' ' for character in text)
    return line if len(line) <= MAX_CHARACTERS else line[:MAX_CHARACTERS - 1] + '…'


class Ear:
    """Turns commands into signals with one vocabulary, and knows which words were trained."""

    def __init__(self, controller: Controller, vocabulary: Vocabulary) -> None:
        self._vocabulary = vocabulary
        self._trained = {word.word: word.behaviour for word in controller.words}
        self.received = 0
        changed = controller.changed_words(vocabulary)
        self.warning = (f'vectors of {", ".join(changed)} are not those of the training: the '
                        'behaviour may differ') if changed else ''

    @property
    def source(self) -> str:
        """Where the vectors come from."""
        return self._vocabulary.source

    def greet(self) -> Answer:
        """Return the answer before any command."""
        return Answer(Level.OK, 'listening: no command yet', self.received, '',
                      {'vocabulary': self.source, 'trained': ', '.join(self._trained)})

    def refuse(self, text: str, reason: str) -> Answer:
        """Count a command and return an ERROR answer with the reason."""
        self.received += 1
        return self._refusal(text, reason)

    def hear(self, text: str) -> tuple[Answer, NDArray[np.float64] | None]:
        """Return the answer and the signal to prime the network with, None if it is refused."""
        self.received += 1
        if not text.strip():
            return self._refusal(text, 'empty command: expected a word, such as '
                                 f'{next(iter(self._trained), "forward")!r}'), None
        if len(text) > MAX_CHARACTERS:
            return self._refusal(text, f'command too long: expected at most {MAX_CHARACTERS} '
                                 f'characters, got {len(text)}'), None
        if len(text.split()) > MAX_WORDS:
            return self._refusal(text, f'command too long: expected at most {MAX_WORDS} words, '
                                 f'got {len(text.split())}'), None
        try:
            phrase = self._vocabulary.phrase(text)
        except UnknownWordError as error:
            return self._refusal(text, str(error), unknown=error.word,
                                 suggestions=', '.join(error.suggestions)), None
        except ValueError as error:
            return self._refusal(text, str(error)), None
        words = ', '.join(phrase.words)
        values = {'words': words, 'vocabulary': self.source,
                  'nearest': '; '.join(map(self._nearest, phrase.words))}
        new = [word for word in phrase.words if word not in self._trained]
        message = f'following {quoted(text)!r}'
        if new:
            message += f' (never heard in training: {", ".join(new)})'
        return Answer(Level.WARN if self.warning else Level.OK,
                      message + (f'; {self.warning}' if self.warning else ''),
                      self.received, quoted(text), values), phrase.signal

    def _refusal(self, text: str, reason: str, **values: str) -> Answer:
        return Answer(Level.ERROR, reason, self.received, quoted(text),
                      {'vocabulary': self.source, **values})

    def _nearest(self, word: str) -> str:
        """Return the trained words nearest in meaning, with their cosines."""
        cosines = self._vocabulary.neighbours(word, tuple(self._trained))
        best = sorted(cosines, key=lambda pair: -pair[1])[:NEAREST_SHOWN]
        return f'{word}: ' + ', '.join(f'{near} {cosine:.2f}' for near, cosine in best)
