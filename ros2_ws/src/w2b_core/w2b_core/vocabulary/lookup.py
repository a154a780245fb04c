"""Words, their vectors, and how near in meaning or spelling words are to each other."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from w2b_core.vocabulary import norms, store
from w2b_core.vocabulary.errors import (
    UnknownWordError,
    VocabularyError,
    VocabularyFileError,
)
from w2b_core.vocabulary.nearest import nearest
from w2b_core.vocabulary.spelling import Spellings
from w2b_core.vocabulary.text import folded, spellings, tokens

if TYPE_CHECKING:
    from gensim.models import KeyedVectors

    from w2b_core.vocabulary.metrics import Metric

Array = NDArray[np.float64]

SUGGESTIONS = 3
#: Most frequent words among which spellings are searched: among 3 million it takes seconds, in
#: which a robot would get no answer, and finds words that nobody means.
SEARCHED_WORDS = 200_000


@dataclass(frozen=True)
class Phrase:
    """
    A command as the network hears it.

    Attributes
    ----------
    words
        As the vocabulary spells them, in order.
    signal: shape (len(words) * D,)
        Their vectors one after the other.

    """

    words: tuple[str, ...]
    signal: Array


class Vocabulary:
    """
    Words with their vectors, looked up as people type them.

    Case, surrounding space and punctuation do not matter. `keyed_vectors` opens the vocabulary in
    gensim, which is imported then only: it takes a second and 80 MB, and a robot needs none of it.
    """

    def __init__(self, name: str, words: list[str], vectors: store.Vectors, *,
                 scale: float = 1.0, about: store.About | None = None) -> None:
        if not (np.isfinite(scale) and scale > 0):
            raise VocabularyError(f'scale: expected a number above 0, got {scale!r}')
        self.name = name
        self.words = words
        self.scale = scale
        self.about = about
        self._vectors = vectors
        self._index = {word: index for index, word in enumerate(words)}
        if len(self._index) != len(words):
            raise VocabularyFileError(f'{name}: expected every word once, got '
                                      f'{len(words) - len(self._index):,} of them twice')

    @classmethod
    def load(cls, spec: str | Path = store.DEFAULT, scale: float | None = None) -> Vocabulary:
        """
        Open a vocabulary.

        Parameters
        ----------
        spec
            'default' (comes with the program), the name of an installed vocabulary, a vocabulary's
            folder, or a word2vec file (binary or text, also gzipped), which is read into memory.
        scale
            Factor for every vector. By default 1, except for word2vec files of vectors of unit
            length: those are scaled to `DEFAULT_NORM`.

        Raises
        ------
        VocabularyFileError
            If there is no such vocabulary, or it is damaged.

        """
        folder = store.find(str(spec))
        if folder is not None:
            about, words, vectors = store.read_folder(folder)
            if scale is not None:
                norms.check_lengths(vectors, f'{spec} times {scale:g}', scale)
            return cls(about.name, words, vectors, scale=1.0 if scale is None else scale,
                       about=about)
        from w2b_core.vocabulary import word2vec

        table = word2vec.read(Path(spec))
        factor = word2vec.default_scale(table.vectors) if scale is None else scale
        norms.check_lengths(table.vectors, f'{spec} times {factor:g}', factor)
        return cls(Path(spec).name, table.words, table.vectors, scale=factor)

    def __len__(self) -> int:
        return len(self.words)

    def __contains__(self, word: object) -> bool:
        """Return whether `word`, however it is typed, is one word of the vocabulary."""
        try:
            return isinstance(word, str) and bool(self.known(word))
        except VocabularyError:
            return False

    @property
    def dimensions(self) -> int:
        """Length of a vector, D."""
        return self._vectors.shape[1]

    @property
    def exact_words(self) -> list[str]:
        """The words with the vectors of the source: all but those with coded ones."""
        return self.words[:len(self.words) - (self.about.coded_words if self.about else 0)]

    @property
    def source(self) -> str:
        """Name and size, for people."""
        return f'{self.name} ({len(self):,} words)'

    def known(self, word: str) -> str:
        """
        Return `word` as the vocabulary spells it.

        Raises
        ------
        UnknownWordError
            If it is not there; names the nearest spellings.
        VocabularyError
            If `word` is not one word.

        """
        found = tokens(word)
        if len(found) != 1:
            raise VocabularyError(f'expected one word, got {len(found)}')
        return self._known(found[0])

    def _known(self, token: str) -> str:
        found = self.find(token)
        if found is None:
            lower = spellings(token)[0]
            raise UnknownWordError(lower, self.suggestions(lower), self.source)
        return found

    def find(self, token: str) -> str | None:
        """Return one word without punctuation as the vocabulary spells it, None if unknown."""
        candidates = spellings(token)
        for candidate in candidates:
            if candidate in self._index:
                return candidate
        for candidate in candidates:  # 'McDonald', or Unicode's other forms of the same letters
            if candidate in self._folded:
                return self._folded[candidate]
        return None

    @cached_property
    def _folded(self) -> dict[str, str]:
        """The frequent words that are not spelt as people's words are looked up, by that."""
        words: dict[str, str] = {}
        for word in islice(self.words, SEARCHED_WORDS):
            if not (word.isascii() and word.islower()) and (plain := folded(word)) != word:
                words.setdefault(plain, word)
        return words

    def suggestions(self, word: str, count: int = SUGGESTIONS) -> tuple[str, ...]:
        """
        Return the known words that are spelt most like `word`, more frequent ones first.

        Only the `SEARCHED_WORDS` most frequent words are looked at.
        """
        return self.spellings.like(word, count)

    def prepare(self) -> None:
        """Make now what the first word that is not there would wait for."""
        self.find('')
        self.suggestions('')

    @cached_property
    def spellings(self) -> Spellings:
        """The frequent words by their letters: made once, in some 20 ms."""
        return Spellings(self.words[:SEARCHED_WORDS])

    def vector(self, word: str) -> Array:
        """
        Return the vector (D,) of one word.

        Raises
        ------
        UnknownWordError, VocabularyError
            As `known`; also if the vector on the disk is damaged.

        """
        return self._vector(self.known(word))

    def _vector(self, known: str) -> Array:
        vector: Array = self._vectors[self._index[known]].astype(np.float64) * self.scale
        if not np.isfinite(vector).all():
            raise VocabularyFileError(f'{self.source}: expected finite numbers for {known!r}, got '
                                      'NaN or infinity; install the vocabulary again')
        if not vector.any():
            raise VocabularyFileError(f'{self.source}: expected a vector with a direction for '
                                      f'{known!r}, got zeros; install the vocabulary again')
        return vector

    def phrase(self, text: str) -> Phrase:
        """
        Return the words of a command and what the network hears: their vectors in order.

        Raises
        ------
        UnknownWordError
            For the first word that is not in the vocabulary.
        VocabularyError
            If `text` is no string, too long or has no words.

        """
        words = tuple(self._known(token) for token in tokens(text))
        return Phrase(words, np.concatenate([self._vector(word) for word in words]))

    def matrix(self, words: Iterable[str] | None = None) -> NDArray[np.float32]:
        """
        Return the vectors (N, D) of words of the vocabulary, by default of all in their order.

        Raises
        ------
        UnknownWordError
            For the first word that the vocabulary does not spell so.

        """
        if words is None:
            every = np.array(self._vectors, dtype=np.float32)
            every *= np.float32(self.scale)
            return every
        places = []
        for word in words:
            if word not in self._index:
                raise UnknownWordError(word, self.suggestions(word), self.source)
            places.append(self._index[word])
        return np.asarray(self._vectors[places], dtype=np.float32) * np.float32(self.scale)

    def metric(self, sha256: str) -> Metric:
        """
        Return the arrays, by name, of a metric that was learned on vectors of this length.

        Each array's first axis is that of a vector's elements (D, ...). `metrics.write` keeps one.

        Raises
        ------
        VocabularyError, VocabularyFileError
            As `metrics.read`.

        """
        from w2b_core.vocabulary import metrics

        return metrics.read(sha256, self.dimensions)

    def cosine(self, first: str, second: str) -> float:
        """Return the cosine of the angle between two words' vectors."""
        a, b = self.vector(first), self.vector(second)
        return float(a @ b / (np.linalg.norm(a) * np.linalg.norm(b)))

    def neighbours(self, word: str, candidates: Iterable[str] | None = None,
                   count: int | None = None) -> tuple[tuple[str, float], ...]:
        """
        Return words and their cosines with `word`, the nearest in meaning first.

        Parameters
        ----------
        word
            One word of the vocabulary.
        candidates
            The words to compare with; those that the vocabulary lacks are left out. By default
            the whole vocabulary but `word` itself.
        count
            How many at most: all candidates, or 10 of the whole vocabulary, by default.

        """
        if candidates is None:
            known = self.known(word)
            found = nearest(self._vectors, self._vector(known), self._index[known], count or 10)
            return tuple((self.words[place], cosine) for place, cosine in found)
        pairs = [(other, self.cosine(word, other)) for other in candidates if other in self]
        return tuple(sorted(pairs, key=lambda pair: -pair[1])[:count])

    @cached_property
    def keyed_vectors(self) -> KeyedVectors:
        """
        The vocabulary as gensim's KeyedVectors (unscaled).

        Raises VocabularyError if gensim is not installed.
        """
        from w2b_core.vocabulary.gensim_view import keyed_vectors

        return keyed_vectors(self.words, self._index, self._vectors)
