"""One of a few words in a sound, or none: PocketSphinx with the model that its wheel brings."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from itertools import islice

from w2b_core.vocabulary import store
from w2b_web.voice.sound import Samples, is_steady, without_noise

#: Of 45 words that the ear understands, those that voices of two synthesisers said and that were
#: heard right most often in noise.
WORDS = (
    'stop', 'halt', 'standstill', 'motionless', 'freeze',
    'forward', 'march', 'walk', 'proceed', 'continue', 'gallop', 'progress', 'trotting',
    'approach', 'backward', 'reverse', 'retreat', 'escape', 'left', 'right', 'sit', 'kneeling')
#: Said without waiting for a person, also where they are misheard: they only ever stop a robot.
#: They are listened for a second time among `WORDS` alone, without `DECOYS`: to miss one is worse
#: than to hear one too many.
DIRECT = frozenset({'stop', 'halt'})
#: Topic on which `listen` publishes what it heard, for the page's box.
HEARD_TOPIC = 'heard'
#: Words that are listened for only to be refused: the most frequent of the vocabulary that sound
#: unlike `WORDS`. How likely each is against a word: more refuses more, of what is right too.
DECOYS, DECOY_WEIGHT = 300, 1e-24
#: Sounds (phones) in which a decoy differs from every word at least, and how many it has.
_LEAST_UNLIKE, _LEAST_PHONES = 3, 3
MISSING = ('push to talk needs pocketsphinx: python -m pip install -r requirements/listen.txt '
           "-c requirements/constraints.txt (or '.[listen]')")


class MissingError(RuntimeError):
    """There is no pocketsphinx here; one line says how to get it."""


@dataclass(frozen=True)
class Heard:
    """
    What was heard.

    Attributes
    ----------
    text
        One of the words; empty: none of them.
    took_s
        How long it took to recognise, in seconds.

    """

    text: str
    took_s: float


def is_there() -> bool:
    """Return whether pocketsphinx is installed, without loading it."""
    return find_spec('pocketsphinx') is not None


class Recogniser:
    """
    Hears words.

    Parameters
    ----------
    words
        The words to hear; each has to be in the model's dictionary (CMUdict).

    Raises
    ------
    MissingError
        If there is no pocketsphinx.
    ValueError
        If the dictionary lacks a word.

    """

    def __init__(self, words: Sequence[str] = WORDS) -> None:
        try:
            from pocketsphinx import Decoder, get_model_path
        except (ImportError, OSError) as error:
            raise MissingError(f'{MISSING}: {error}') from error
        self.words = tuple(words)
        model = get_model_path('en-us')
        self._decoder = Decoder(hmm=f'{model}/en-us', dict=f'{model}/cmudict-en-us.dict', lm=None,
                                cmn='batch', loglevel='FATAL')
        said = {word: self._phones(word) for word in words}
        if lacking := [word for word, phones in said.items() if not phones]:
            raise ValueError(f'words: expected words of the dictionary, got {lacking}')
        #: Words that are refused by being heard.
        self.decoys = tuple(islice(self._decoys(list(said.values())), DECOYS))
        weights = dict.fromkeys(self.words, 1.0)
        self._decoder.add_jsgf_string('alone', _grammar(weights))
        self._decoder.add_jsgf_string('refusing', _grammar(
            weights | dict.fromkeys(self.decoys, DECOY_WEIGHT)))

    def _phones(self, word: str) -> list[str]:
        return (self._decoder.lookup_word(word) or '').split()

    def _decoys(self, said: Sequence[Sequence[str]]) -> Iterator[str]:
        for word in _frequent():
            phones = self._phones(word)
            if len(phones) >= _LEAST_PHONES and all(
                    distance(phones, other) >= _LEAST_UNLIKE for other in said):
                yield word

    def recognise(self, samples: Samples) -> Heard:
        """Return which word a sound is, if any."""
        began_s = time.perf_counter()
        text = ''
        if not is_steady(samples):
            sound = without_noise(samples).tobytes()
            text = self._best('refusing', sound)
            if text not in self.words:
                # Heard as nothing else: a stop that is a little unlike one is one.
                alone = self._best('alone', sound)
                text = alone if alone in DIRECT else ''
        return Heard(text, time.perf_counter() - began_s)

    def _best(self, grammar: str, sound: bytes) -> str:
        self._decoder.activate_search(grammar)
        self._decoder.start_utt()
        self._decoder.process_raw(sound, full_utt=True)
        self._decoder.end_utt()
        found = self._decoder.hyp()
        return '' if found is None else str(found.hypstr)


def _grammar(weights: dict[str, float]) -> str:
    return ('#JSGF V1.0; grammar words; public <said> = '
            + ' | '.join(f'/{weight:g}/ {word}' for word, weight in weights.items()) + ';')


@cache
def _frequent() -> tuple[str, ...]:
    """Return the default vocabulary's plain words, frequent ones first."""
    folder = store.find(store.DEFAULT)
    if folder is None:
        return ()
    words = (folder / 'words.txt').read_text(encoding='utf-8').split('\n')
    return tuple(word for word in words if word.isalpha() and word.islower())


def distance(one: Sequence[str], other: Sequence[str]) -> int:
    """Return how many sounds are to be changed, added or left out (Levenshtein)."""
    row = list(range(len(other) + 1))
    for index, sound in enumerate(one, 1):
        last, row = row, [index]
        for place, heard in enumerate(other, 1):
            row.append(min(last[place] + 1, row[-1] + 1, last[place - 1] + (sound != heard)))
    return row[-1]
