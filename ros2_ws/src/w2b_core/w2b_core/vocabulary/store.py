"""
Vocabularies as folders of a few files, which load at once and run no code.

`words.txt`    the words, one a line, UTF-8, in the order of the source (most frequent first)
`vectors.npy`  their vectors (N, D), float16 or float32, memory-mapped when used
`coded.npy`    the default vocabulary only: the vectors of the last words, coded (see `coding`)
`about.json`   format, version, name, where the vectors come from and what was done to them

The default vocabulary comes with the program; installed ones live in the user's data folder:
`$W2B_DATA/vocabularies`, else `$XDG_DATA_HOME/w2b/vocabularies`, else
`~/.local/share/w2b/vocabularies`.
"""

from __future__ import annotations

import json
import os
import re
from dataclasses import asdict, dataclass, fields
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from w2b_core.shell import w2b_command
from w2b_core.vocabulary import coding
from w2b_core.vocabulary.errors import VocabularyFileError

Array = NDArray[np.floating[Any]]
#: Vectors (N, D), read by rows.
Vectors = Array | coding.PartlyCoded

DEFAULT = 'default'
FORMAT = 'w2b-vocabulary'
VERSION = 1
NAME_PATTERN = re.compile(r'[a-z0-9][a-z0-9_-]{0,39}')


@dataclass(frozen=True)
class About:
    """
    Where a vocabulary comes from.

    Attributes
    ----------
    source
        In words, for people.
    source_sha256
        Of the file that the vectors were read from.
    norms
        What was done to the lengths of the vectors.
    selection
        By which rule words were chosen from the source.
    coded_words, coding
        How many of the last words have coded vectors, and in which code.

    """

    name: str
    words: int
    dimensions: int
    source: str
    source_sha256: str
    norms: str
    selection: str = 'all words'
    coded_words: int = 0
    coding: str = ''
    format: str = FORMAT
    version: int = VERSION


def default_folder() -> Path:
    """Return the folder of the vocabulary that comes with the program."""
    return Path(str(resources.files('w2b_core') / 'vocabularies' / DEFAULT))


def data_folder() -> Path:
    """Return the folder of the installed vocabularies, which need not exist yet."""
    if chosen := os.environ.get('W2B_DATA'):
        return Path(chosen) / 'vocabularies'
    home = os.environ.get('XDG_DATA_HOME')
    return (Path(home) if home else Path.home() / '.local' / 'share') / 'w2b' / 'vocabularies'


def installed() -> dict[str, Path]:
    """Return the folders of the installed vocabularies by name."""
    folder = data_folder()
    if not folder.is_dir():
        return {}
    return {path.name: path for path in sorted(folder.iterdir())
            if NAME_PATTERN.fullmatch(path.name) and (path / 'about.json').is_file()}


def find(spec: str) -> Path | None:
    """
    Return the folder that `spec` means: a name's, or itself; None if it is a file.

    Raises
    ------
    VocabularyFileError
        If there is no such name, folder or file.

    """
    if spec == DEFAULT:
        return default_folder()
    found = installed().get(spec)
    if found is not None or os.path.isdir(spec):
        return Path(found or spec)
    if os.path.exists(spec):  # a pipe or device is refused when it is opened
        return None
    names = ', '.join((DEFAULT, *installed()))
    raise VocabularyFileError(
        f'vocabulary {spec[:200]!r}: expected one of {names}, a folder or a word2vec file, got no '
        f'such name or file; install one with `{w2b_command("vocabulary install")}`')


def write_folder(folder: Path, about: About, words: list[str],
                 vectors: Array, coded: coding.Bytes | None = None) -> None:
    """Write a vocabulary into `folder`, which must exist and be empty."""
    np.save(folder / 'vectors.npy', vectors, allow_pickle=False)
    if coded is not None:
        np.save(folder / 'coded.npy', coded, allow_pickle=False)
    write_words(folder, about, words)


def write_words(folder: Path, about: About, words: list[str]) -> None:
    """Write everything but the vectors."""
    (folder / 'words.txt').write_text('\n'.join(words) + '\n', encoding='utf-8')
    (folder / 'about.json').write_text(json.dumps(asdict(about), indent=1, ensure_ascii=False)
                                       + '\n', encoding='utf-8')


def read_folder(folder: Path) -> tuple[About, list[str], Vectors]:
    """
    Open a vocabulary; its vectors stay on the disk until they are used.

    Raises
    ------
    VocabularyFileError
        If a file is missing or damaged, or they do not belong together.

    """
    about = _read_about(folder / 'about.json')
    words = _read_words(folder / 'words.txt')
    exact = _read_array(folder / 'vectors.npy', (np.float16, np.float32))
    if exact.shape[1] != about.dimensions:
        raise VocabularyFileError(f'{folder}: expected vectors of {about.dimensions} elements, '
                                  f'got {exact.shape[1]}')
    vectors: Vectors = exact if not about.coded_words else coding.PartlyCoded(
        exact, _read_coded(folder / 'coded.npy', about))
    if not len(words) == len(vectors) == about.words:
        raise VocabularyFileError(f'{folder}: expected {about.words:,} words and vectors, '
                                  f'got {len(words):,} words and {len(vectors):,} vectors')
    return about, words, vectors


def _read_about(path: Path) -> About:
    try:
        value = json.loads(path.read_text(encoding='utf-8'))
        if not isinstance(value, dict):
            raise TypeError('no JSON object')
        if (value.get('format'), value.get('version')) != (FORMAT, VERSION):
            raise TypeError(f'{str(value.get("format"))[:40]!r} version '
                            f'{str(value.get("version"))[:40]}')
        about = About(**value)
        for item in fields(About):
            expected = int if item.type == 'int' else str
            if type(getattr(about, item.name)) is not expected:
                raise TypeError(f'{item.name} of another type')
    except OSError as error:
        raise VocabularyFileError(f'{path}: expected a vocabulary, got '
                                  f'{error.strerror or error}') from None
    except (ValueError, TypeError, RecursionError) as error:
        reason = str(error).splitlines()[0][:120]
        raise VocabularyFileError(f'{path}: expected {FORMAT} version {VERSION}, got {reason}; '
                                  'install the vocabulary again') from None
    return about


def _read_words(path: Path) -> list[str]:
    try:
        text = path.read_bytes().decode('utf-8')
    except OSError as error:
        raise VocabularyFileError(f'{path}: expected a list of words, got '
                                  f'{error.strerror or error}') from None
    except UnicodeDecodeError as error:
        raise VocabularyFileError(f'{path}: expected UTF-8 text, got byte '
                                  f'0x{error.object[error.start]:02x} at {error.start}') from None
    # str.splitlines would also break at characters that words may hold, such as U+0085.
    return text.removesuffix('\n').split('\n')


def _read_coded(path: Path, about: About) -> coding.Bytes:
    if about.coding != coding.NORMAL_6_BIT:
        raise VocabularyFileError(f'{path}: expected the code {coding.NORMAL_6_BIT}, got '
                                  f'{about.coding[:40]!r}; install a newer version of the program')
    rows = _read_array(path, (np.uint8,))
    expected = about.coded_words, coding.row_bytes(about.dimensions)
    if rows.shape != expected:
        raise VocabularyFileError(f'{path}: expected coded vectors of shape {expected}, got '
                                  f'{rows.shape}')
    return rows


def _read_array(path: Path, dtypes: tuple[type[np.generic], ...]) -> NDArray[Any]:
    try:
        array = np.load(path, mmap_mode='r', allow_pickle=False)
    except OSError as error:
        raise VocabularyFileError(f'{path}: expected word vectors, got '
                                  f'{error.strerror or error}') from None
    except (ValueError, EOFError) as error:
        raise VocabularyFileError(f'{path}: expected an array of word vectors, got a damaged '
                                  f'file ({str(error).splitlines()[0][:80]})') from None
    if not isinstance(array, np.ndarray) or array.ndim != 2 or array.dtype not in dtypes:
        names = ' or '.join(dtype.__name__ for dtype in dtypes)
        raise VocabularyFileError(f'{path}: expected {names} of shape (N, D), got another kind of '
                                  'array')
    return array
