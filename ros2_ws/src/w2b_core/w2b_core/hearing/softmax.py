"""Multinomial logistic regression in numpy: the classifier behind the ear, and its gate."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Largest gradient element, relative to the summed weights, at which the fit has converged.
TOLERANCE = 1e-5
MAX_ITERATIONS = 2000


class Softmax(NamedTuple):
    """Weights (K, E) and biases (K,) of K classes over E elements."""

    weights: Array
    biases: Array

    def logits(self, points: Array) -> Array:
        """Return the logits (..., K) of points (..., E)."""
        values: Array = points @ self.weights.T + self.biases
        return values

    def probabilities(self, points: Array, sharpness: float = 1.0) -> Array:
        """Return probabilities (..., K), of logits times `sharpness`."""
        return _softmax(self.logits(points) * sharpness)


def balanced(labels: NDArray[np.intp], classes: int) -> Array:
    """Return weights (n,) that give every class the same sum, n in all."""
    counts = np.bincount(labels, minlength=classes)
    present = np.count_nonzero(counts)
    weights: Array = len(labels) / (present * counts[labels])
    return weights


def fit(points: Array, labels: NDArray[np.intp], weights: Array, classes: int, strength: float,
        start: Softmax | None = None) -> Softmax:
    """
    Return the softmax that minimises half its squared weights plus `strength` times the loss.

    Nesterov's method, preconditioned with Boehning's bound of the Hessian, with restarts.

    Parameters
    ----------
    points: shape (n, E)
        What to classify.
    labels: shape (n,)
        Classes, 0 to `classes` - 1.
    weights: shape (n,)
        Of each point's loss.
    classes
        Their number, K.
    strength
        C of logistic regression: the larger, the closer to the points.
    start
        Where to begin; at zero by default.

    """
    count, elements = points.shape
    with_bias = np.concatenate([points, np.ones((count, 1))], axis=1)
    targets = np.eye(classes)[labels]
    ridge = np.append(np.ones(elements), 1e-8)
    bound = 0.5 * strength * (with_bias * weights[:, None]).T @ with_bias + np.diag(ridge)
    inverse = np.linalg.inv(bound)
    current = np.zeros((classes, elements + 1)) if start is None else np.concatenate(
        [start.weights, start.biases[:, None]], axis=1)
    ahead, momentum = current, 1.0
    enough = TOLERANCE * strength * float(weights.sum())
    for _ in range(MAX_ITERATIONS):
        errors = (_softmax(with_bias @ ahead.T) - targets) * weights[:, None]
        gradient = strength * errors.T @ with_bias + ahead * ridge
        if np.abs(gradient).max() < enough:
            break
        following = ahead - gradient @ inverse
        if np.vdot(gradient, following - current) > 0:  # it overshot: forget the momentum
            momentum = 1.0
        grown = (1 + np.sqrt(1 + 4 * momentum**2)) / 2
        ahead = following + (momentum - 1) / grown * (following - current)
        current, momentum = following, grown
    return Softmax(ahead[:, :-1].copy(), ahead[:, -1].copy())


def _softmax(logits: Array) -> Array:
    shifted = np.exp(logits - logits.max(axis=-1, keepdims=True))
    shares: Array = shifted / shifted.sum(axis=-1, keepdims=True)
    return shares
