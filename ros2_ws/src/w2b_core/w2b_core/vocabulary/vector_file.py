"""Opening files of word vectors: gzipped or not, regular or a pipe."""

from __future__ import annotations

import gzip
import io
import shutil
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from w2b_core.vocabulary.errors import VocabularyFileError

GZIP = b'\x1f\x8b'
#: How other files begin, what they are, and what to do.
_OTHERS = ((b'PK\x03\x04', 'a zip archive', 'unpack it first with `unzip`'),
           (b'\xfd7zXZ\0', 'an xz file', 'unpack it first with `xz -d`'),
           (b'BZh', 'a bzip2 file', 'unpack it first with `bzip2 -d`'),
           (b'\x28\xb5\x2f\xfd', 'a zstd file', 'unpack it first with `zstd -d`'),
           (b'7z\xbc\xaf\x27\x1c', 'a 7z archive', 'unpack it first with `7z x`'),
           (b'\xba\x16\x4f\x2f', "a model of fastText's", 'take its file of vectors, .vec'),
           (b'\x89HDF', 'an HDF5 file', 'write its vectors as text'),
           (b'\x93NUMPY', 'an array without words', 'write words and vectors as text'),
           (b'\xff\xfe', 'text in UTF-16', 'save it as UTF-8'),
           (b'\xfe\xff', 'text in UTF-16', 'save it as UTF-8'))
#: gzip's reader is slow with small pieces.
_BUFFER_BYTES = 1 << 20


def damaged(path: Path, got: str) -> VocabularyFileError:
    """Return the error for a file that is not as expected."""
    return VocabularyFileError(f'{path}: expected a word2vec file, got {got}')


def is_pipe(path: Path) -> bool:
    """
    Return whether `path` is a pipe, which can be read once only, such as /dev/stdin may be.

    Raises
    ------
    VocabularyFileError
        If there is nothing, or neither a file nor a pipe.

    """
    try:
        mode = path.stat().st_mode
    except OSError as error:
        raise VocabularyFileError(f'{path}: expected a word2vec file, got '
                                  f'{error.strerror or error}') from None
    except ValueError as error:  # a zero byte in the name
        raise VocabularyFileError(f'{str(path)[:200]!r}: expected the name of a file, got one '
                                  f'with {error}') from None
    if stat.S_ISREG(mode):
        return False
    if stat.S_ISFIFO(mode) or stat.S_ISSOCK(mode):
        return True
    kind = 'a folder' if stat.S_ISDIR(mode) else 'a device'
    raise VocabularyFileError(f'{path}: expected a file or pipe with word vectors, got {kind}')


def spooled(path: Path, scratch: Path) -> Path:
    """Return a file with what `path` holds: itself, or, of a pipe, a copy in `scratch`."""
    if not is_pipe(path):
        return path
    copy = scratch / 'piped'
    with path.open('rb') as pipe, copy.open('wb') as file:
        shutil.copyfileobj(pipe, file)
    with copy.open('rb') as file:
        packed = file.read(2) == GZIP
    # The names say to the reader what a pipe's name cannot.
    return copy.rename(copy.with_suffix('.gz')) if packed else copy


@contextmanager
def unpacked(path: Path) -> Iterator[tuple[BinaryIO, bool]]:
    """
    Give a reader of a regular file's content, and whether it is gzipped.

    Several gzip members one after the other (as `bgzip` and `cat` make) are one content, and zeros
    after the last do not matter.

    Raises
    ------
    VocabularyFileError
        If there is no such file, or it is packed in another way.

    """
    if is_pipe(path):
        raise VocabularyFileError(f'{path}: expected a file that can be read again, got a pipe; '
                                  f'run `vocabulary install {path} --name NAME` first')
    with path.open('rb') as raw:
        packed = raw.read(2) == GZIP
        raw.seek(0)
        if packed and path.suffix != '.gz':
            raise VocabularyFileError(f'{path}: expected a gzipped file to be called .gz, got '
                                      f'{path.suffix or "no suffix"}; rename it')
        if not packed:
            with io.BufferedReader(raw, _BUFFER_BYTES) as file:
                yield file, False
            return
        with gzip.GzipFile(fileobj=raw) as archive, \
                io.BufferedReader(archive, _BUFFER_BYTES) as file:
            yield file, True


def read_until(file: BinaryIO, end: bytes, longest: int) -> bytes:
    """Return the bytes up to the byte `end`, with it unless the file ends or more are read."""
    found = bytearray()
    while len(found) <= longest:
        byte = file.read(1)
        found += byte
        if not byte or byte == end:
            break
    return bytes(found)


def refuse_others(path: Path, start: bytes) -> None:
    """Raise VocabularyFileError if a file's start is that of a kind that others can turn first."""
    for magic, what, remedy in _OTHERS:
        if start.startswith(magic):
            raise damaged(path, f'{what}; {remedy}')
    if start[257:262] == b'ustar':
        raise damaged(path, 'a tar archive; unpack it first with `tar xf`')
    refuse_separators(path, start.split(b'\n', 1)[0])


def refuse_separators(path: Path, line: bytes) -> None:
    """Raise VocabularyFileError if the fields of a line of text are parted by other than space."""
    for sign, name in ((b',', 'commas'), (b';', 'semicolons')):
        fields = line.strip().split(sign)
        try:
            numbers = [float(field) for field in fields[1:]]
        except ValueError:
            continue
        if len(numbers) > 1 or (numbers and fields[0].strip().isdigit()):
            raise damaged(path, f'{name} between the numbers; put spaces or tabs there, with '
                                f"`tr '{sign.decode()}' ' '`")
