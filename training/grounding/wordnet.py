"""
WordNet's synonyms, antonyms and inflections among the words of a vocabulary.

Reads the database of Princeton's WordNet 3.0 as Debian's `wordnet-base` installs it (format:
wndb(5WN)); its licence allows any use that names it.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from pathlib import Path

import snowballstemmer

FOLDER = Path('/usr/share/wordnet')
PARTS = {'n': 'noun', 'v': 'verb', 'a': 'adj', 'r': 'adv'}
#: Ending -> what it replaced, for nouns and verbs.
ENDINGS = (('s', ''), ('es', ''), ('ies', 'y'), ('ed', ''), ('ed', 'e'), ('ing', ''), ('ing', 'e'),
           ('ied', 'y'))

Pair = tuple[str, str]


class WordNetError(ValueError):
    """WordNet is not installed, or damaged."""


@dataclass(frozen=True)
class Relations:
    """Pairs of words, each in alphabetical order."""

    synonyms: tuple[Pair, ...]
    antonyms: tuple[Pair, ...]
    inflections: tuple[Pair, ...]


@dataclass(frozen=True)
class Synset:
    """Words of one meaning; `opposites`: (word's place, other synset, place there)."""

    words: tuple[str, ...]
    opposites: tuple[tuple[int, str, int], ...]


def stemmer() -> Callable[[str], str]:
    """Return what takes a word to its stem: Porter's second stemmer."""
    stem: Callable[[str], str] = snowballstemmer.stemmer('english').stemWord
    return stem


class WordNet:
    """
    The database in a folder.

    Raises
    ------
    WordNetError
        If it is not there or not WordNet's.

    """

    def __init__(self, folder: Path = FOLDER) -> None:
        self._folder = folder
        try:
            self._synsets = dict(entry for part in PARTS for entry in self._read(part))
            self._exceptions = {form: base for part in PARTS.values()
                                for form, base in self._read_exceptions(part)}
        except OSError as error:
            raise WordNetError(f'{folder}: expected WordNet, got {error.strerror or error}; '
                               'install it with `apt-get install wordnet-base`') from None
        except (ValueError, IndexError):
            raise WordNetError(f'{folder}: expected WordNet 3.0, got damaged files; install '
                               'wordnet-base again') from None
        self._stems: dict[str, frozenset[str]] = {}
        self._stem = stemmer()

    def relations(self, words: Collection[str], without: Collection[str] = ()) -> Relations:
        """
        Return the pairs among `words`, but for those that touch a stem of a word of `without`.

        Words are of lower-case letters; others have no relations.
        """
        stems = {stem for word in without for stem in self.stems(word)}
        known = {word for word in words if word.isalpha() and word.islower()
                 and not stems.intersection(self.stems(word))}
        return Relations(*(tuple(sorted(pairs)) for pairs in (
            self._synonyms(known), self._antonyms(known), self._inflections(known))))

    def stems(self, word: str) -> frozenset[str]:
        """Return the stems of a word: of itself, and of its base form if that is irregular."""
        if word not in self._stems:
            base = self._exceptions.get(word, word)
            first = self._stem(word)
            self._stems[word] = frozenset((first, first if base == word else self._stem(base)))
        return self._stems[word]

    def _synonyms(self, known: set[str]) -> set[Pair]:
        return {_pair(*pair) for synset in self._synsets.values()
                for pair in combinations([word for word in synset.words if word in known], 2)
                if pair[0] != pair[1]}

    def _antonyms(self, known: set[str]) -> set[Pair]:
        pairs = set()
        for synset in self._synsets.values():
            for place, other, there in synset.opposites:
                first, second = synset.words[place - 1], self._synsets[other].words[there - 1]
                if first in known and second in known and first != second:
                    pairs.add(_pair(first, second))
        return pairs

    def _inflections(self, known: set[str]) -> set[Pair]:
        forms: dict[str, set[str]] = {}
        for word in known:
            for base in self._bases(word):
                if base in known and base in self._inflected:
                    forms.setdefault(base, {base}).add(word)
        return {_pair(*pair) for group in forms.values() for pair in combinations(group, 2)}

    def _bases(self, word: str) -> Iterator[str]:
        if word in self._exceptions and self._exceptions[word] != word:
            yield self._exceptions[word]
        for ending, instead in ENDINGS:
            stem = word.removesuffix(ending)
            if stem != word and len(stem) > 1:
                yield stem + instead
                if ending in ('ed', 'ing') and not instead and len(stem) > 2 \
                        and stem[-1] == stem[-2]:
                    yield stem[:-1]

    @cached_property
    def _inflected(self) -> frozenset[str]:
        """The nouns and verbs."""
        return frozenset(word for key, synset in self._synsets.items() if key[0] in 'nv'
                         for word in synset.words)

    def _read(self, part: str) -> Iterator[tuple[str, Synset]]:
        path = self._folder / f'data.{PARTS[part]}'
        with path.open(encoding='latin-1') as file:
            for line in file:
                if line.startswith('  '):  # the licence
                    continue
                fields = line.partition(' | ')[0].split()
                count = int(fields[3], 16)
                words = tuple(word.partition('(')[0] for word in fields[4:4 + 2 * count:2])
                pointers = fields[4 + 2 * count:]
                opposites = tuple(
                    (int(places[:2], 16), ('a' if pos == 's' else pos) + offset,
                     int(places[2:], 16))
                    for kind, offset, pos, places in (
                        pointers[1 + 4 * index:5 + 4 * index] for index in range(int(pointers[0])))
                    if kind == '!')
                yield part + fields[0], Synset(words, opposites)

    def _read_exceptions(self, part: str) -> Iterator[Pair]:
        with (self._folder / f'{part}.exc').open(encoding='latin-1') as file:
            for line in file:
                form, *bases = line.split()
                for base in bases[-1:]:
                    yield form, base


def _pair(first: str, second: str) -> Pair:
    return (first, second) if first < second else (second, first)
