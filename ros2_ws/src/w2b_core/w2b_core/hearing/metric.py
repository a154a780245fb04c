"""
A learned metric over word vectors: where synonyms lie near each other and opposites apart.

`training/grounding` builds it in closed form; here it is applied. It belongs to vectors, not to a
controller: it is kept with the vocabulary, and an ear names it by its hash.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from w2b_core.hearing.errors import EarError
from w2b_core.vocabulary import Vocabulary, VocabularyError, metrics

Array = NDArray[np.float64]

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
        """Round to the stored float32 and check the shapes (EarError if not)."""
        for name in ('mean', 'matrix'):
            value = np.asarray(getattr(self, name), dtype=np.float32).astype(np.float64)
            object.__setattr__(self, name, value)
        if self.matrix.ndim != 2 or self.mean.shape != self.matrix.shape[:1]:
            raise EarError(f'metric: expected a mean (D,) and a matrix (D, E), got '
                           f'{self.mean.shape} and {self.matrix.shape}')
        if not (np.isfinite(self.mean).all() and np.isfinite(self.matrix).all()):
            raise EarError('metric: expected finite numbers, got NaN or infinity')

    @property
    def dimensions(self) -> int:
        """Length of the vectors that it takes, D."""
        return int(self.matrix.shape[0])

    @property
    def sha256(self) -> str:
        """Hash of its numbers."""
        return metrics.sha256(self.arrays())

    def arrays(self) -> metrics.Metric:
        """Return what is stored: see `w2b_core.vocabulary.metrics`."""
        return {'mean': self.mean.astype(np.float32), 'matrix': self.matrix.astype(np.float32)}

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


def load(sha256: str, vocabulary: Vocabulary) -> Metric:
    """
    Return the metric with this hash: one that ships, or that was trained here.

    Raises
    ------
    EarError
        If there is none, it is damaged, or it is for vectors of another length.

    """
    try:
        arrays = vocabulary.metric(sha256)
    except VocabularyError as error:
        raise EarError(str(error)) from None
    if set(arrays) != {'mean', 'matrix'}:
        raise EarError(f'metric {sha256[:12]}: expected a mean and a matrix, got '
                       f'{", ".join(sorted(arrays))}; train the ear again')
    return Metric(arrays['mean'].astype(np.float64), arrays['matrix'].astype(np.float64))
