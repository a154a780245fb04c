"""Hearing a command: text -> what the network hears, and the answer that the sender gets."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field

from w2b_core.controller.file import Controller
from w2b_core.hearing import Ear, Refused
from w2b_core.hearing.heard import Heard
from w2b_core.status import Level
from w2b_core.vocabulary import UnknownWordError, Vocabulary, VocabularyError

#: Of a command's text in its answer and in the log.
CHARACTERS_SHOWN = 300
#: What ROS puts in the place of bytes that are no UTF-8: a damaged word must not pass for another.
REPLACEMENT = '\ufffd'
#: A word whose nearest trained word has a lower cosine is like none of them.
LIKE_NOTHING = 0.25
#: Trained words that an answer compares each word with.
NEAREST_SHOWN = 3


@dataclass(frozen=True)
class Answer:
    """
    What became of a command.

    `received` counts the commands so far, so that a sender can tell the answer to its own from an
    earlier one; `heard` is the text as `quoted` shows it, `follows` what the robot does now;
    `repeated` says that the words are those that are followed already.
    """

    level: Level
    message: str
    received: int
    heard: str
    values: Mapping[str, str] = field(default_factory=dict)
    follows: str = ''
    repeated: bool = False


def quoted(text: str) -> str:
    """Return the text on one line, and no longer than is shown."""
    cut = text if len(text) <= CHARACTERS_SHOWN else text[:CHARACTERS_SHOWN - 1] + '…'
    return ''.join(character if character.isprintable() else ' ' for character in cut)


class Listener(ABC):
    """Turns commands into what a network hears, and counts them."""

    def __init__(self, vocabulary: Vocabulary) -> None:
        self.vocabulary = vocabulary
        self.received = 0
        self.warning = ''

    @property
    def source(self) -> str:
        """Where the vectors come from."""
        return self.vocabulary.source

    def hear(self, text: str) -> tuple[Answer, Heard | None]:
        """Return the answer and what the network hears, None if the command is refused."""
        self.received += 1
        if REPLACEMENT in text:
            return self._refusal(text, 'command: expected text in UTF-8, got other bytes'), None
        return self._understand(text)

    def refuse(self, text: str, reason: str) -> Answer:
        """Count a command and return an ERROR answer with the reason."""
        self.received += 1
        return self._refusal(text, reason)

    @abstractmethod
    def greet(self) -> Answer:
        """Return the answer before any command."""

    @abstractmethod
    def _understand(self, text: str) -> tuple[Answer, Heard | None]:
        """Return what `hear` returns, for text."""

    def _refusal(self, text: str, reason: str, **values: str) -> Answer:
        return Answer(Level.ERROR, quoted(reason), self.received, quoted(text),
                      {'vocabulary': self.source, **values})


def listener_of(controller: Controller, vocabulary: Vocabulary) -> Listener:
    """
    Return what hears for a controller.

    Raises
    ------
    ValueError
        If the vocabulary is not one that the controller was trained on.

    """
    if isinstance(controller.ear, Ear):
        return EarListener(controller.ear, vocabulary)
    return SerialListener(controller, vocabulary)


class EarListener(Listener):
    """
    Hears by projection: a behaviour, or a refusal; see `w2b_core.hearing`.

    Raises
    ------
    EarError
        If the vocabulary has other vectors than those that the ear was trained on.

    """

    def __init__(self, ear: Ear, vocabulary: Vocabulary) -> None:
        super().__init__(vocabulary)
        self._ear = ear
        self._words = ear.bind(vocabulary)

    def greet(self) -> Answer:
        """See `Listener`."""
        return Answer(Level.OK, 'listening: no command yet', self.received, '', {
            'vocabulary': self.source, 'behaviours': ', '.join(self._ear.behaviours)})

    def _understand(self, text: str) -> tuple[Answer, Heard | None]:
        found = self._words.understand(text)
        values = {'vocabulary': self.source,
                  'words': '; '.join(f'{word.text}: {word.role.value}'
                                     + (f' {word.behaviour}' if word.behaviour else '')
                                     for word in found.words),
                  'nearest': ', '.join(f'{word} {cosine:.2f}' for word, cosine in found.nearest)}
        if isinstance(found, Refused):
            return self._refusal(text, found.reason, **values), None
        known = any(word.text in self._ear.words and word.behaviour == found.behaviour
                    for word in found.words)
        new = '' if known else ', never heard in training'
        return Answer(
            Level.OK, f'following {found.behaviour!r} (probability {found.probability:.2f}{new})',
            self.received, quoted(text), {
                'behaviour': found.behaviour, 'probability': f'{found.probability:.4f}',
                'trained': 'yes' if known else 'no', **values},
            found.behaviour), Heard(command=found.command)


class SerialListener(Listener):
    """
    Hears by serial priming, and knows which words were trained.

    Raises
    ------
    VocabularyError
        If the vocabulary's vectors have another length than those the controller was evolved with.

    """

    def __init__(self, controller: Controller, vocabulary: Vocabulary) -> None:
        if vocabulary.dimensions != controller.vector_length:
            raise VocabularyError(
                f'vocabulary {vocabulary.source}: expected vectors of length '
                f'{controller.vector_length}, as the controller was evolved with, '
                f'got {vocabulary.dimensions}')
        super().__init__(vocabulary)
        # As the vocabulary spells them, which is how commands are compared with them.
        self._trained = tuple(vocabulary.known(word.word) if word.word in vocabulary
                              else word.word for word in controller.words)
        changed = controller.changed_words(vocabulary)
        self.warning = (f'vectors of {", ".join(changed)} are not those of the training: the '
                        'behaviour may differ') if changed else ''

    def greet(self) -> Answer:
        """See `Listener`."""
        return Answer(Level.OK, 'listening: no command yet', self.received, '',
                      {'vocabulary': self.source, 'trained': ', '.join(self._trained)})

    def _understand(self, text: str) -> tuple[Answer, Heard | None]:
        try:
            phrase = self.vocabulary.phrase(text)
        except UnknownWordError as error:
            return self._refusal(text, str(error), unknown=quoted(error.word),
                                 suggestions=', '.join(error.suggestions)), None
        except VocabularyError as error:
            return self._refusal(text, str(error)), None
        new = [word for word in phrase.words if word not in self._trained]
        message = f'following {" ".join(phrase.words)!r}'
        if new:
            message += f' (never heard in training: {", ".join(new)})'
            message += ''.join(map(self._like_nothing, new))
        if self.warning:
            message += f'; {self.warning}'
        values = {'words': ', '.join(phrase.words), 'vocabulary': self.source,
                  'nearest': '; '.join(map(self._nearest, phrase.words))}
        return Answer(Level.WARN if self.warning else Level.OK, message, self.received,
                      quoted(text), values, ', '.join(phrase.words)), Heard(signal=phrase.signal)

    def _like_nothing(self, word: str) -> str:
        """Return a note about a word that is like no trained one, else nothing."""
        for near, cosine in self.vocabulary.neighbours(word, self._trained, 1):
            if cosine < LIKE_NOTHING:
                return f'; nothing like {word} was trained (nearest: {near} {cosine:.2f})'
        return ''

    def _nearest(self, word: str) -> str:
        """Return the trained words nearest in meaning, with their cosines."""
        nearest = self.vocabulary.neighbours(word, self._trained, NEAREST_SHOWN)
        return f'{word}: ' + ', '.join(f'{near} {cosine:.2f}' for near, cosine in nearest)
