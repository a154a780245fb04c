"""A table of words and vectors while it is read, in memory or in a file."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType
from typing import BinaryIO, NamedTuple, Self

import numpy as np

from w2b_core.vocabulary.errors import VocabularyFileError
from w2b_core.vocabulary.store import Array
from w2b_core.vocabulary.vector_file import damaged

#: Words between two reports of progress, or looked at together.
CHUNK_WORDS = 4096
#: Larger elements belong to no word vector, and their squares soon to no float32.
LARGEST_ELEMENT = 1e6


class Table(NamedTuple):
    """Words, their vectors (N, D) float32, and how many words were left out for zero vectors."""

    words: list[str]
    vectors: Array
    zeros: int = 0


class TableWriter:
    """
    Takes words with their vectors one by one, and refuses what cannot be one.

    Parameters
    ----------
    path
        That is read, for errors.
    dimensions
        D, of a vector.
    onto
        A new file for the vectors; None for memory.

    """

    def __init__(self, path: Path, dimensions: int, onto: Path | None) -> None:
        self._path, self._dimensions, self._onto = path, dimensions, onto
        self._file: BinaryIO | None = onto.open('xb') if onto else None
        self._words: dict[str, None] = {}
        self._zeros = 0
        self._full: list[Array] = []
        self._chunk = np.empty((CHUNK_WORDS, dimensions), dtype=np.float32)
        self._names: list[str] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, _kind: type[BaseException] | None, _error: BaseException | None,
                 _trace: TracebackType | None) -> None:
        if self._file:
            self._file.close()

    def add(self, word: str, vector: Array) -> None:
        """
        Take a word and its vector (D,), unless the word has come before.

        Raises
        ------
        VocabularyFileError
            If it is an impossible word, or one before had an impossible vector.

        """
        if not word or any(letter in word for letter in ' \n\r\t\0'):
            raise damaged(self._path, f'an impossible word, {word[:40]!r}: damaged, or another '
                                      'number of dimensions than its first line says')
        if word in self._words:
            return
        self._words[word] = None
        self._chunk[len(self._names)] = vector
        self._names.append(word)
        if len(self._names) == CHUNK_WORDS:
            self._flush()

    def _flush(self) -> None:
        rows = self._chunk[:len(self._names)]
        for row in np.flatnonzero(~(np.abs(rows) <= LARGEST_ELEMENT).all(axis=1)):
            number = rows[row][~(np.abs(rows[row]) <= LARGEST_ELEMENT)][0]
            what = f'{number:g}' if np.isfinite(number) else 'NaN or infinity'
            raise damaged(self._path, f'{what} in the vector of {self._names[row][:40]!r}, where '
                                      f'no number is beyond {LARGEST_ELEMENT:,.0f}')
        some = rows.any(axis=1)
        for row in np.flatnonzero(~some):
            del self._words[self._names[row]]
        self._zeros += int(np.count_nonzero(~some))
        if self._file:
            self._file.write(rows[some].tobytes())
        else:
            self._full.append(rows[some])
        self._names.clear()

    def close(self) -> Table:
        """
        Return what was taken.

        Raises
        ------
        VocabularyFileError
            As `add`; also if every vector is zero.

        """
        self._flush()
        words, shape = list(self._words), (len(self._words), self._dimensions)
        if not words:
            raise VocabularyFileError(f'{self._path}: expected vectors with a direction, got '
                                      f'{self._zeros:,} that are all zeros')
        if not self._file or not self._onto:
            return Table(words, np.concatenate(self._full), self._zeros)
        self._file.close()
        vectors: Array = np.memmap(self._onto, np.float32, 'r', shape=shape)
        return Table(words, vectors, self._zeros)
