"""Reading files of word vectors in word2vec's own formats, with gensim."""

from __future__ import annotations

import gzip
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from w2b_core.vocabulary.errors import VocabularyFileError
from w2b_core.vocabulary.norms import TYPICAL_NORM, is_unit_length
from w2b_core.vocabulary.store import Array

if TYPE_CHECKING:
    from gensim.models import KeyedVectors

#: Length given to vectors whose own lengths were normalised away.
DEFAULT_NORM = TYPICAL_NORM
#: Deflate packs zeros 1:1032; no file can hold more than that.
MOST_COMPRESSION = 1100
#: Words between two reports of progress, or looked at together.
CHUNK_WORDS = 4096

#: Called with the numbers of words that have been read and that there are.
Progress = Callable[[int, int], object]


class Table(NamedTuple):
    """Words and their vectors (N, D) float32."""

    words: list[str]
    vectors: Array


def default_scale(vectors: Array) -> float:
    """Return the factor for vectors as they came: `DEFAULT_NORM` for unit length, else 1."""
    return DEFAULT_NORM if is_unit_length(vectors) else 1.0


def read(path: Path, progress: Progress | None = None, onto: Path | None = None) -> Table:
    """
    Read a word2vec file, binary or text, gzipped or not.

    Parameters
    ----------
    path
        The file; its first line says how many words and dimensions it has.
    progress
        Called now and then with the numbers of words that have been read and that there are.
    onto
        A file that does not exist yet: the vectors are put there, memory-mapped, instead of into
        memory.

    Raises
    ------
    VocabularyFileError
        If the file is missing, damaged or of another kind.

    """
    if path.suffix in ('.kv', '.model', '.pkl', '.pickle'):
        raise VocabularyFileError(
            f'{path}: expected a word2vec file (.bin or .txt), got what looks like a pickle, which '
            'can run code; export it with KeyedVectors.save_word2vec_format')
    try:
        return _read(path, progress or (lambda _done, _all: None), onto)
    except VocabularyFileError:
        raise
    except UnicodeDecodeError as error:
        raise _damaged(path, f'byte 0x{error.object[error.start]:02x}, which is not UTF-8, in a '
                             'word: damaged, or another number of dimensions than its header '
                             'says') from None
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise _damaged(path, f'a truncated or damaged one ({error})') from None
    except OSError as error:
        raise VocabularyFileError(f'{path}: expected a readable word2vec file, got '
                                  f'{error.strerror or error}') from None
    except (ValueError, TypeError, IndexError, AssertionError) as error:
        reason = (str(error) or type(error).__name__).splitlines()[0][:100]
        raise _damaged(path, f'a damaged one ({reason})') from None


def _damaged(path: Path, got: str) -> VocabularyFileError:
    return VocabularyFileError(f'{path}: expected a word2vec file, got {got}')


def _read(path: Path, progress: Progress, onto: Path | None) -> Table:
    with path.open('rb') as raw:
        packed = raw.read(2) == b'\x1f\x8b'
    if packed and path.suffix != '.gz':
        raise VocabularyFileError(f'{path}: expected a gzipped file to be called .gz, got '
                                  f'{path.suffix or "no suffix"}; rename it')
    with gzip.open(path) if packed else path.open('rb') as file:
        header = file.readline(200)
        count, dimensions = _counts(path, header, packed)
        binary = not _is_text_row(file.read(64 + 40 * dimensions), dimensions)
    table = _table_class(progress, onto)
    # An absolute path, as gensim would take a name such as `http://...` for an address.
    keyed = table.load_word2vec_format(str(path.resolve()), binary=binary)
    # Where a word came twice, gensim keeps the first, and leaves as many places empty at the end.
    words = list(keyed.index_to_key[:keyed.next_index])
    vectors = keyed.vectors[:keyed.next_index]
    for word in words:
        if not word or any(letter in word for letter in ' \n\r\t\0'):
            raise _damaged(path, f'an impossible word, {word[:40]!r}: damaged, or another number '
                                 'of dimensions than its first line says')
    if len(words) == count:  # else how long the repeated words were is not known any more
        (_check_binary_end if binary else _check_text_end)(path, words, dimensions, len(header),
                                                           packed)
    _check_finite(path, words, vectors)
    return Table(words, vectors)


def _counts(path: Path, header: bytes, packed: bool) -> tuple[int, int]:
    """Return the numbers of words and dimensions that the first line promises."""
    try:
        count, dimensions = (int(part) for part in header.decode('ascii').split())
    except ValueError:
        count = dimensions = 0
    if count < 1 or dimensions < 1:
        raise _damaged(path, 'no first line with the numbers of words and dimensions')
    room = path.stat().st_size * (MOST_COMPRESSION if packed else 1)
    # At least a letter and a space, and for each element two bytes of text ("0 ") or four.
    if count * (2 * dimensions + 2) > room + 1:
        raise _damaged(path, f'a file too small for the {count:,} words of {dimensions:,} '
                             'dimensions that its first line promises: truncated?')
    return count, dimensions


def _is_text_row(start: bytes, dimensions: int) -> bool:
    """Return whether `start` begins with a row of text: a word and numbers."""
    parts = start.split(b'\n', 1)[0].split(b' ')[1:]
    try:
        for part in parts[:min(3, dimensions)]:
            float(part)
    except ValueError:
        return False
    return bool(parts)


def _check_binary_end(path: Path, words: list[str], dimensions: int, header: int,
                      packed: bool) -> None:
    """Refuse a file that holds more than its first line says: that line is wrong then."""
    size, wrap = path.stat().st_size, 1 << 64
    if packed:  # gzip's last four bytes are the unpacked size modulo 2^32
        with path.open('rb') as raw:
            raw.seek(-4, 2)
            size, wrap = int.from_bytes(raw.read(4), 'little'), 1 << 32
    count = len(words)
    needed = header + sum(len(word.encode()) for word in words) + count * (1 + 4 * dimensions)
    # Some writers end each vector with a line feed.
    if size not in ((needed + feeds) % wrap for feeds in (0, count, count - 1)):
        raise _damaged(path, f'{size:,} bytes instead of the {needed:,} of {count:,} words of '
                             f'{dimensions:,} dimensions, as its first line promises')


def _check_text_end(path: Path, words: list[str], dimensions: int, _header: int,
                    packed: bool) -> None:
    """Refuse a text that goes on after the words that its first line promises."""
    if packed:
        return
    with path.open('rb') as file:
        file.seek(max(0, path.stat().st_size - 200 - 60 * dimensions))
        last = file.read().rstrip().rsplit(b'\n', 1)[-1]
    if last.split(b' ')[0] != words[-1].encode():
        raise _damaged(path, f'more than the {len(words):,} words that its first line promises')


def _check_finite(path: Path, words: list[str], vectors: Array) -> None:
    for begin in range(0, len(words), CHUNK_WORDS):
        finite = np.isfinite(vectors[begin:begin + CHUNK_WORDS]).all(axis=1)
        if not finite.all():
            bad = words[begin + int(finite.argmin())]
            raise _damaged(path, f'NaN or infinity in the vector of {bad[:40]!r}')


def _table_class(progress: Progress, onto: Path | None) -> type[KeyedVectors]:
    """Return gensim's KeyedVectors that report how they fill, in memory or in the file `onto`."""
    from gensim.models import KeyedVectors

    class Filling(KeyedVectors):
        def __init__(self, vector_size: int, count: int = 0, dtype: Any = np.float32,
                     mapfile_path: None = None) -> None:
            super().__init__(vector_size, 0 if onto else count, dtype)
            if onto:
                self.index_to_key = [None] * count
                self.vectors = np.lib.format.open_memmap(onto, 'w+', dtype, (count, vector_size))

        def add_vector(self, key: str, vector: Any) -> int:
            if self.next_index % CHUNK_WORDS == 0:
                progress(self.next_index, len(self.index_to_key))
            return int(super().add_vector(key, vector))
    return Filling
