"""
A learned metric over word vectors: where synonyms lie near each other and opposites apart.

`training/grounding` builds it in closed form; here it is read and applied. It belongs to vectors,
not to a controller: an ear names the metric that it was trained behind by its hash.

A metric is a folder: `metric.npy`, float32 of shape (1 + D, E), whose first row is the mean of the
vocabulary's unit vectors (zeros beyond D) and whose others are the projection; and `about.json`.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from w2b_core.hearing.errors import EarError
from w2b_core.vocabulary import store

Array = NDArray[np.float64]

FOLDER = 'metrics'
#: A vector shorter than this has no direction.
LEAST_NORM = 1e-12


@dataclass(frozen=True, eq=False)
class Metric:
    """
    Projection of word vectors: `unit(unit(vector) - mean)` times a matrix, to unit length.

    Attributes
    ----------
    mean: shape (D,)
        Mean of the vocabulary's unit vectors.
    matrix: shape (D, E)
        The projection.

    """

    mean: Array
    matrix: Array

    def __post_init__(self) -> None:
        """Round to float32, which is what is stored, and check the shapes (EarError if not)."""
        for name in ('mean', 'matrix'):
            value = np.asarray(getattr(self, name), dtype=np.float32).astype(np.float64)
            object.__setattr__(self, name, value)
        if self.matrix.ndim != 2 or self.mean.shape != self.matrix.shape[:1]:
            raise EarError(f'metric: expected a mean (D,) and a matrix (D, E), got '
                           f'{self.mean.shape} and {self.matrix.shape}')
        if not (np.isfinite(self.mean).all() and np.isfinite(self.matrix).all()):
            raise EarError('metric: expected finite numbers, got NaN or infinity')
        object.__setattr__(self, '_sha256', hashlib.sha256(self.table().tobytes()).hexdigest())

    @property
    def dimensions(self) -> int:
        """Length of the vectors that it takes, D."""
        return int(self.matrix.shape[0])

    @property
    def sha256(self) -> str:
        """Hash of its numbers."""
        return str(self._sha256)  # type: ignore[attr-defined]

    def table(self) -> NDArray[np.float32]:
        """Return what is stored: the mean over the matrix, shape (1 + D, E)."""
        rows, columns = self.matrix.shape
        table = np.zeros((1 + rows, max(columns, rows)), np.float32)
        table[0, :rows] = self.mean
        table[1:, :columns] = self.matrix
        return table

    def project(self, vectors: ArrayLike) -> Array:
        """
        Return vectors (..., D) behind the metric: unit vectors (..., E).

        Raises
        ------
        EarError
            If the vectors have another length or are not finite.

        """
        vectors = np.asarray(vectors, dtype=np.float64)
        if vectors.ndim == 0 or vectors.shape[-1] != self.dimensions:
            raise EarError(f'metric: expected vectors of {self.dimensions} elements, got '
                           f'{vectors.shape}')
        if not np.isfinite(vectors).all():
            raise EarError('metric: expected finite vectors, got NaN or infinity')
        centred = unit(unit(vectors) - self.mean)
        projected: Array = unit(centred @ self.matrix)
        return projected


def unit(vectors: Array) -> Array:
    """Return vectors (..., D) at unit length; a zero vector stays zero."""
    norms = np.linalg.norm(vectors, axis=-1, keepdims=True)
    scaled: Array = vectors / np.maximum(norms, LEAST_NORM)
    return scaled


def load(sha256: str) -> Metric:
    """
    Return the metric with this hash: of those that ship, then of the installed ones.

    Raises
    ------
    EarError
        If there is none, or it is damaged.

    """
    for folder in folders():
        if about(folder).get('sha256') == sha256:
            return read(folder)
    raise EarError(f'metric {sha256[:12]}: expected one that ships or is installed, got none with '
                   'this hash; train the ear again with `python -m training ear`')


def folders() -> Iterator[Path]:
    """Yield the folders of all metrics: those that ship, then the installed ones."""
    shipped = Path(str(resources.files('w2b_core') / 'vocabularies' / FOLDER))
    for home in (shipped, store.data_folder().parent / FOLDER):
        if home.is_dir():
            yield from (path for path in sorted(home.iterdir()) if (path / 'about.json').is_file())


def about(folder: Path) -> dict[str, Any]:
    """Return what `about.json` says of a metric; EarError if it is damaged."""
    path = folder / 'about.json'
    try:
        value = json.loads(path.read_text(encoding='utf-8'))
    except (OSError, ValueError, RecursionError) as error:
        raise EarError(f'{path}: expected the description of a metric, got '
                       f'{str(error).splitlines()[0][:100]}') from None
    if not isinstance(value, dict):
        raise EarError(f'{path}: expected a JSON object, got {type(value).__name__}')
    return value


def read(folder: Path) -> Metric:
    """
    Return the metric in a folder.

    Raises
    ------
    EarError
        If it is missing or damaged, or its hash is another than `about.json` says.

    """
    path = folder / 'metric.npy'
    try:
        table = np.load(path, allow_pickle=False)
    except (OSError, ValueError, EOFError) as error:
        raise EarError(f'{path}: expected a metric, got '
                       f'{str(error).splitlines()[0][:100]}') from None
    if not isinstance(table, np.ndarray) or table.ndim != 2 or len(table) < 2 \
            or table.dtype != np.float32 or table.shape[1] < len(table) - 1:
        raise EarError(f'{path}: expected float32 of shape (1 + D, E), got another array')
    described = about(folder)
    columns = described.get('dimensions')
    if not isinstance(columns, int) or not 0 < columns <= table.shape[1]:
        raise EarError(f'{folder}: expected `dimensions` in about.json, got {columns!r:.40}')
    metric = Metric(table[0, :len(table) - 1], table[1:, :columns])
    if metric.sha256 != described.get('sha256'):
        raise EarError(f'{path}: expected SHA-256 {str(described.get("sha256"))[:12]}, got '
                       f'{metric.sha256[:12]}; install it again')
    return metric
