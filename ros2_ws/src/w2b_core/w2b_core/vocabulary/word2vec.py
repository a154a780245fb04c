"""
Reading files of word vectors: word2vec's binary and text formats, and GloVe's text.

gensim reads these too, but trusts the first line: of a file that holds more words than that line
says it drops the rest in silence, and one that holds fewer it fills up with nothing.
"""

from __future__ import annotations

import gzip
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import BinaryIO, NamedTuple

import numpy as np

from w2b_core.vocabulary import vector_file
from w2b_core.vocabulary.errors import VocabularyFileError
from w2b_core.vocabulary.norms import TYPICAL_NORM, is_unit_length
from w2b_core.vocabulary.store import Array
from w2b_core.vocabulary.table import CHUNK_WORDS, Table, TableWriter
from w2b_core.vocabulary.vector_file import damaged

#: Length given to vectors whose own lengths were normalised away.
DEFAULT_NORM = TYPICAL_NORM
#: Deflate packs zeros 1:1032; no file can hold more than that.
MOST_COMPRESSION = 1100
#: Longest line of text before its numbers: a word and what is between.
LONGEST_WORD = 4096
#: Characters of a number in text, at most, with its space: 17 digits, sign, point and exponent.
LONGEST_NUMBER = 64
#: Longest first line; it may be a whole row.
LONGEST_HEADER = LONGEST_WORD + LONGEST_NUMBER * 20_000
UTF_8_MARK = b'\xef\xbb\xbf'

#: Called with the numbers of words that have been read and that there are (0 if unknown).
Progress = Callable[[int, int], object]


class Shape(NamedTuple):
    """What a file promises; `words` is None if it does not say how many there are."""

    words: int | None
    dimensions: int
    binary: bool


def default_scale(vectors: Array) -> float:
    """Return the factor for vectors as they came: `DEFAULT_NORM` for unit length, else 1."""
    return DEFAULT_NORM if is_unit_length(vectors) else 1.0


def read(path: Path, progress: Progress | None = None, onto: Path | None = None) -> Table:
    """
    Read a file of word vectors, gzipped or not.

    Of a word that comes twice the first vector counts; words whose vectors are zero are left out.

    Parameters
    ----------
    path
        A regular file; see `vector_file.spooled` for others.
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
        shape = _shape(path)
        with vector_file.unpacked(path) as (file, _packed):
            return _read(path, file, shape, progress or (lambda _done, _all: None), onto)
    except VocabularyFileError:
        raise
    except UnicodeDecodeError as error:
        raise damaged(path, f'byte 0x{error.object[error.start]:02x}, which is not UTF-8, in a '
                            'word: damaged, or another number of dimensions than its header '
                            'says') from None
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise damaged(path, f'a truncated or damaged one ({error})') from None
    except OSError as error:
        raise VocabularyFileError(f'{path}: expected a readable word2vec file, got '
                                  f'{error.strerror or error}') from None


def _read(path: Path, file: BinaryIO, shape: Shape, progress: Progress, onto: Path | None
          ) -> Table:
    rows = (_binary_rows if shape.binary else _text_rows)(path, file, shape)
    with TableWriter(path, shape.dimensions, onto) as table:
        for number, (word, vector) in enumerate(rows):
            if number % CHUNK_WORDS == 0:
                progress(number, shape.words or 0)
            table.add(word, vector)
        return table.close()


def _shape(path: Path) -> Shape:
    """Return what the beginning of a file promises."""
    with vector_file.unpacked(path) as (file, packed):
        line = file.readline(LONGEST_HEADER)
        start = file.read(LONGEST_WORD + 3 * LONGEST_NUMBER)
    vector_file.refuse_others(path, line + start)
    parts = line.removeprefix(UTF_8_MARK).split()
    if len(parts) > 2 and (numbers := _trailing_numbers(parts)) > 1:
        return Shape(None, numbers, False)
    try:
        count, dimensions = (int(part.decode('ascii')) for part in parts)
    except ValueError:
        count = dimensions = 0
    if count < 1 or dimensions < 1:
        raise damaged(path, 'no first line with the numbers of words and dimensions, nor one with '
                            'a word and the numbers of its vector')
    room = path.stat().st_size * (MOST_COMPRESSION if packed else 1)
    # At least a letter and a space, and for each element two bytes of text ("0 ") or four.
    if count * (2 * dimensions + 2) > room + 1:
        raise damaged(path, f'a file too small for the {count:,} words of {dimensions:,} '
                            'dimensions that its first line promises: truncated?')
    row = start.lstrip(b'\r\n').split(b'\n', 1)[0]
    if _is_text_row(row, dimensions):
        return Shape(count, dimensions, False)
    vector_file.refuse_separators(path, row)
    return Shape(count, dimensions, True)


def _is_text_row(start: bytes, dimensions: int) -> bool:
    """Return whether `start` begins with a row of text: a word and numbers."""
    parts = start.split()[1:]
    return bool(parts) and all(map(_is_number, parts[:min(3, dimensions)]))


def _trailing_numbers(parts: list[bytes]) -> int:
    """Return how many fields after the first, counted from the end, are numbers."""
    count = 0
    while count < len(parts) - 1 and _is_number(parts[-1 - count]):
        count += 1
    return count


def _is_number(part: bytes) -> bool:
    try:
        float(part)
    except ValueError:
        return False
    return b'_' not in part  # which Python allows within numbers


def _binary_rows(path: Path, file: BinaryIO, shape: Shape) -> Iterator[tuple[str, Array]]:
    size, count = 4 * shape.dimensions, shape.words or 0
    done = len(file.readline(LONGEST_HEADER))
    for number in range(count):
        name = vector_file.read_until(file, b' ', LONGEST_WORD)
        row = file.read(size)
        if not name.endswith(b' ') and name and row:
            raise damaged(path, f'an impossible word of more than {LONGEST_WORD} bytes: damaged, '
                                'or another number of dimensions than its first line says')
        if len(row) < size:
            raise damaged(path, f'a truncated one: {number:,} whole words instead of '
                                f'{count:,}, as its first line promises')
        done += len(name) + size
        # Some writers end each vector with a line feed.
        yield name[:-1].lstrip(b'\n').decode('utf-8'), np.frombuffer(row, '<f4')
    rest = file.read(1 << 26).removeprefix(b'\n')
    if rest:
        more = 'at least ' if len(rest) >= (1 << 26) - 1 else ''
        raise damaged(path, f'{more}{done + len(rest):,} bytes instead of the {done:,} of '
                            f'{count:,} words of {shape.dimensions:,} dimensions, as its '
                            'first line promises')


def _text_rows(path: Path, file: BinaryIO, shape: Shape) -> Iterator[tuple[str, Array]]:
    dimensions, number = shape.dimensions, 0
    longest = LONGEST_WORD + LONGEST_NUMBER * dimensions
    if shape.words is not None:
        file.readline(LONGEST_HEADER)
    while line := file.readline(longest):
        parts = (line if number else line.removeprefix(UTF_8_MARK)).split()
        if not parts:
            continue
        if number == shape.words:
            raise damaged(path, f'more than the {number:,} words that its first line promises')
        number += 1
        yield _text_row(path, number, line, parts, dimensions)
    if shape.words is not None and number < shape.words:
        raise damaged(path, f'a truncated one: {number:,} words instead of {shape.words:,}, as '
                            'its first line promises')


def _text_row(path: Path, number: int, line: bytes, parts: list[bytes], dimensions: int
              ) -> tuple[str, Array]:
    """Return the word and vector of a line; spaces within a word become underscores."""
    name, numbers = parts[:-dimensions], parts[-dimensions:]
    if line[:1] in (b' ', b'\t') and len(parts) <= dimensions:
        name = [b'']
    # A space within a word is fine (GloVe has such), a number too many is not.
    if not name or any(map(_is_number, name[1:])) or not all(map(_is_number, numbers)):
        found = _trailing_numbers(parts)
        raise damaged(path, f'a damaged one: {found:,} numbers instead of {dimensions:,} in the '
                            f'row of word {number:,}')
    with np.errstate(over='ignore'):  # infinity is refused with all that is not finite
        return b'_'.join(name).decode('utf-8'), np.array(
            [float(part) for part in numbers], dtype=np.float64).astype(np.float32)
