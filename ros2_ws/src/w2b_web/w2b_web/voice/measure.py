"""`w2b listen --measure`: how well words are heard, how often what is none, and how soon."""

from __future__ import annotations

import time
from collections import Counter, defaultdict
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from w2b_web.voice.recogniser import DIRECT, Recogniser
from w2b_web.voice.sound import RATE_HZ, Samples
from w2b_web.voice.synthesis import CHOSEN_WITH, MISSING, Voice, in_noise, noise, voices

#: Speech over noise, in dB: a quiet room, a room with a fan, a loud room.
SNR_DB = (30.0, 20.0, 12.0)
#: None of the recogniser's words, nor of those that it listens for to refuse them.
FOREIGN = (
    'banana', 'window', 'yellow', 'hello', 'robot', 'computer', 'garden', 'orange', 'monday',
    'kitchen', 'doctor', 'please', 'thanks', 'seventeen', 'mountain', 'elephant', 'coffee',
    'telephone', 'happy', 'teacher', 'jump', 'dance', 'asleep', 'upstairs')
#: Sounds without speech of each loudness.
_NOISES = 20


@dataclass
class Heard:
    """What became of the words said in one condition."""

    right: int = 0
    other: int = 0
    none: int = 0

    def add(self, said: str, heard: str) -> None:
        """Count one word."""
        if heard == said:
            self.right += 1
        elif heard:
            self.other += 1
        else:
            self.none += 1

    @property
    def count(self) -> int:
        """How many were said."""
        return self.right + self.other + self.none

    def shares(self) -> str:
        """Return the shares, as a row has them."""
        count = max(1, self.count)
        return f'{self.right / count:.2f} | {self.other / count:.2f} | {self.none / count:.2f}'


@dataclass
class Figures:
    """All that is measured; see `table`."""

    load_s: float = 0.0
    conditions: dict[tuple[str, float], Heard] = field(
        default_factory=lambda: defaultdict(Heard))
    words: dict[str, Heard] = field(default_factory=lambda: defaultdict(Heard))
    taken_for: dict[str, Counter[str]] = field(default_factory=lambda: defaultdict(Counter))
    foreign: dict[float, Counter[str]] = field(default_factory=lambda: defaultdict(Counter))
    without: dict[str, Counter[str]] = field(default_factory=lambda: defaultdict(Counter))
    took_s: list[float] = field(default_factory=list)


def measure(found: list[Voice] | None = None, recogniser: Recogniser | None = None) -> Figures:
    """
    Say all words, foreign words, noise and silence to a recogniser.

    Raises
    ------
    MissingError
        If there is no pocketsphinx.
    ValueError
        If there is no synthesiser.

    """
    speakers = voices() if found is None else found
    if not speakers:
        raise ValueError(MISSING)
    figures, began_s = Figures(), time.perf_counter()
    recogniser = recogniser or Recogniser()
    figures.load_s = time.perf_counter() - began_s

    def hear(sound: Samples) -> str:
        heard = recogniser.recognise(sound)
        figures.took_s.append(heard.took_s)
        return heard.text
    for voice in speakers:
        group = 'chosen with' if f'{voice.program}:{voice.name}' in CHOSEN_WITH else 'others'
        for seed, word in enumerate(recogniser.words):
            said = voice.say(word)
            for snr_db in SNR_DB:
                heard = hear(in_noise(said, snr_db, seed))
                figures.conditions[group, snr_db].add(word, heard)
                figures.words[word].add(word, heard)
                if heard != word:
                    figures.taken_for[word][heard or 'none'] += 1
        for seed, word in enumerate(sorted(set(FOREIGN) - set(recogniser.decoys))):
            said = voice.say(word)
            for snr_db in SNR_DB:
                figures.foreign[snr_db][hear(in_noise(said, snr_db, seed))] += 1
    for seed in range(_NOISES):
        for name, sound in _without_speech(seed).items():
            figures.without[name][hear(sound)] += 1
    return figures


def _without_speech(seed: int) -> dict[str, Samples]:
    steady = noise(int(1.5 * RATE_HZ), seed)
    turns = (1 + seed % 4) * np.arange(len(steady)) / RATE_HZ
    swelling = steady * (1.0 + np.sin(2 * np.pi * turns))
    clicks = np.zeros(len(steady))
    clicks[np.random.default_rng(seed).integers(0, len(clicks), 6)] = 20_000
    return {'silence': np.zeros_like(steady), 'steady noise': steady,
            'swelling noise': swelling.astype(np.int16), 'clicks': clicks.astype(np.int16)}


def table(figures: Figures) -> str:
    """Return the figures as Markdown."""
    lines = ['| voices | speech over noise | right | another word | none |',
             '|---|---|---|---|---|']
    lines += [f'| {group} | {snr_db:g} dB | {heard.shares()} |'
              for (group, snr_db), heard in sorted(figures.conditions.items(),
                                                   key=lambda item: (item[0][0], -item[0][1]))]
    lines += ['', '| word, all conditions | right | another word | none | mostly taken for |',
              '|---|---|---|---|---|']
    for word, heard in figures.words.items():
        mostly = ', '.join(f'{other} {count}' for other, count in
                           figures.taken_for[word].most_common(2))
        lines.append(f'| {word} | {heard.shares()} | {mostly} |')
    lines += ['', '| said, though none of the words | taken for a word | for stop or halt |',
              '|---|---|---|']
    rows: list[tuple[str, Counter[str]]] = [
        *((f'other words, {snr_db:g} dB', heard) for snr_db, heard in figures.foreign.items()),
        *figures.without.items()]
    for name, counts in rows:
        total = sum(counts.values())
        stops = sum(counts[word] for word in DIRECT)
        lines.append(f'| {name} | {(total - counts[""]) / total:.2f} | {stops / total:.3f} |')
    took_s = np.array(figures.took_s)
    lines += ['', f'Loading takes {figures.load_s:.1f} s, a word {np.median(took_s):.2f} s '
              f'(95 %: {np.quantile(took_s, 0.95):.2f} s).']
    return '\n'.join(lines)


def as_json(figures: Figures) -> dict[str, Any]:
    """Return the figures for a program."""
    return {
        'load_s': figures.load_s, 'took_s': float(np.median(figures.took_s)),
        'conditions': [{'voices': group, 'snr_db': snr_db, 'right': heard.right / heard.count,
                        'other': heard.other / heard.count, 'count': heard.count}
                       for (group, snr_db), heard in figures.conditions.items()],
        'words': {word: heard.right / heard.count for word, heard in figures.words.items()},
        'taken_for': {word: dict(counts) for word, counts in figures.taken_for.items()},
        'foreign': {f'{snr_db:g}': 1.0 - counts[''] / sum(counts.values())
                    for snr_db, counts in figures.foreign.items()},
        'without': {name: 1.0 - counts[''] / sum(counts.values())
                    for name, counts in figures.without.items()}}
