"""
Learned metrics: arrays that go with a vocabulary's vectors, kept and found by their hash.

A metric is a few named float32 arrays, such as a projection (D, d) and the mean (D,) that is taken
off before. It is too large for a controller file, which therefore holds its SHA-256 only. The one
that ships lies in the program's `vocabularies/metrics`, others in `$W2B_DATA/metrics` (see `store`
for where that is by default), each as `SHA256.npz`. No pickle is read.
"""

from __future__ import annotations

import hashlib
import io
import re
import zipfile
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from w2b_core.files import write_atomically
from w2b_core.vocabulary import store
from w2b_core.vocabulary.errors import VocabularyError, VocabularyFileError

Metric = dict[str, NDArray[np.float32]]

_SHA256 = re.compile(r'[0-9a-f]{64}')
_NAME = re.compile(r'[a-z][a-z0-9_]{0,39}')
#: More is no metric: ten times (D, D) of the longest vectors in use, of 1,024 elements.
_MOST_BYTES = 40 << 20


def shipped_folder() -> Path:
    """Return the folder of the metrics that come with the program."""
    return Path(str(resources.files('w2b_core') / 'vocabularies' / 'metrics'))


def user_folder() -> Path:
    """Return the folder of the metrics that were trained here, which need not exist yet."""
    return store.data_folder().parent / 'metrics'


def sha256(metric: Mapping[str, NDArray[Any]]) -> str:
    """Return the SHA-256 of the arrays' names, shapes and little-endian float32 bytes."""
    digest = hashlib.sha256()
    for name in sorted(metric):
        array = np.ascontiguousarray(metric[name], dtype='<f4')
        digest.update(f'{name} {array.shape}\n'.encode())
        digest.update(array.tobytes())
    return digest.hexdigest()


def write(metric: Mapping[str, NDArray[Any]], folder: Path | None = None) -> str:
    """
    Keep a metric, whole or not at all, and return its hash.

    Parameters
    ----------
    metric
        Arrays by name (a-z, 0-9, _); kept as float32.
    folder
        By default `user_folder()`, which is made if need be.

    Raises
    ------
    VocabularyError
        If there is no array, a name is another, a number is not finite, or the folder cannot be
        written.

    """
    arrays = {name: np.ascontiguousarray(array, dtype='<f4') for name, array in metric.items()}
    for name, array in arrays.items():
        if not _NAME.fullmatch(name) or not np.isfinite(array).all():
            raise VocabularyError(f'metric: expected finite numbers under names of a-z, 0-9 and _, '
                                  f'got {name[:60]!r}'
                                  + (' with others' if _NAME.fullmatch(name) else ''))
    if not arrays or sum(array.nbytes for array in arrays.values()) > _MOST_BYTES:
        raise VocabularyError(f'metric: expected arrays of at most {_MOST_BYTES >> 20} MiB, got '
                              f'{len(arrays)} arrays of other sizes')
    digest = sha256(arrays)
    buffer = io.BytesIO()
    np.savez(buffer, allow_pickle=False, **{name: arrays[name] for name in sorted(arrays)})
    folder = folder or user_folder()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_atomically(folder / f'{digest}.npz', buffer.getvalue())
    except OSError as error:
        raise VocabularyError(f'{folder}: expected to write a metric there, got '
                              f'{error.strerror or error}; W2B_DATA names another place') from None
    return digest


def read(digest: str, dimensions: int) -> Metric:
    """
    Return the metric with the hash `digest`.

    Parameters
    ----------
    digest
        64 lower-case hexadecimal digits.
    dimensions
        Length D of the vectors that it is for.

    Raises
    ------
    VocabularyError
        If `digest` is no such hash.
    VocabularyFileError
        If there is no such metric, it is damaged, or it is for vectors of another length.

    """
    if not isinstance(digest, str) or not _SHA256.fullmatch(digest):
        raise VocabularyError(f'metric: expected a SHA-256 of 64 digits 0-9 and a-f, got '
                              f'{str(digest)[:80]!r}')
    places = shipped_folder(), user_folder()
    path = next((place / f'{digest}.npz' for place in places
                 if (place / f'{digest}.npz').is_file()), None)
    if path is None:
        raise VocabularyFileError(
            f'metric {digest[:12]}...: expected it in {places[0]} or {places[1]}, got none there; '
            f'train the ear again, or bring {digest}.npz from where it was trained')
    metric = _read(path)
    if sha256(metric) != digest:
        raise VocabularyFileError(f'{path}: expected arrays with SHA-256 {digest}, got '
                                  f'{sha256(metric)}: damaged; train the ear again')
    for name, array in metric.items():
        if array.ndim == 0 or array.shape[0] != dimensions:
            raise VocabularyFileError(f'{path}: expected arrays for vectors of {dimensions} '
                                      f'elements, got {name!r} of shape {array.shape}; the metric '
                                      'is of another vocabulary')
    return metric


def _read(path: Path) -> Metric:
    try:
        with zipfile.ZipFile(path) as archive:  # numpy would unpack whatever size it is told
            size = sum(item.file_size for item in archive.infolist())
        if size > 2 * _MOST_BYTES:
            raise ValueError(f'{size:,} bytes')
        with np.load(path, allow_pickle=False) as archive:
            return {name: np.asarray(archive[name], dtype=np.float32) for name in archive.files}
    except OSError as error:
        raise VocabularyFileError(f'{path}: expected a readable metric, got '
                                  f'{error.strerror or error}') from None
    except (ValueError, EOFError, KeyError, zipfile.BadZipFile) as error:
        reason = (str(error) or type(error).__name__).splitlines()[0][:80]
        raise VocabularyFileError(f'{path}: expected float32 arrays, got a damaged file '
                                  f'({reason}); train the ear again') from None
