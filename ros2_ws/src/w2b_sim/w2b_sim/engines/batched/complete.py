"""Outcomes with every figure: what the plain kernel does not sum up comes from recorded frames."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from w2b_core.outcome import Outcome
from w2b_sim.engines.batched.recording_kernel import RecordedBatch
from w2b_sim.recording import Recording, outcome

#: Recorded numbers that are held at a time.
LARGEST_LOG = 16_000_000
#: Arrays of a `RecordedBatch` with one row a controller, and one an evaluation.
OF_CONTROLLERS = ('hidden_weights', 'motor_weights', 'hidden_leak', 'rest', 'motor_leak')
OF_EVALUATIONS = ('start', 'parameters', 'zeros')


def pieces(batch: RecordedBatch, shape: tuple[int, int, int], numbers: int, lanes: int
           ) -> Iterator[tuple[RecordedBatch, tuple[int, int, int]]]:
    """
    Yield a batch of shape (C, W, K) in pieces of so many controllers that their frames fit.

    `numbers` are those recorded of one evaluation.
    """
    controllers, words, starts = shape
    each = words * starts
    step = max(1, LARGEST_LOG // (each * numbers))
    for first in range(0, controllers, step):
        last = min(first + step, controllers)
        rows = slice(first * each, last * each)
        said = slice(first * words * batch.phases, last * words * batch.phases)
        seeds = np.zeros(-(-(last - first) * each // lanes) * lanes, dtype=np.uint32)
        seeds[:(last - first) * each] = batch.seeds[rows]
        yield batch._replace(
            **{name: getattr(batch, name)[first:last] for name in OF_CONTROLLERS},
            **{name: getattr(batch, name)[rows] for name in OF_EVALUATIONS},
            heard_hidden=batch.heard_hidden[said], heard_motor=batch.heard_motor[said],
            holds=batch.holds[said], seeds=seeds), (last - first, words, starts)


def complete_outcome(recording: Recording) -> Outcome:
    """
    Return the outcome of recordings (C, W, K, T, ...).

    The figures that the plain kernel sums up have its bits: its order of summation, its precision.
    """
    place = recording.position_m
    step = np.diff(place[..., :2], axis=-2)
    steps = np.sqrt(step[..., 0] * step[..., 0] + step[..., 1] * step[..., 1])
    apart = place[..., 0] * place[..., 0] + place[..., 1] * place[..., 1]
    path = np.cumsum(steps, axis=-1)[..., -1] if steps.shape[-1] else np.zeros_like(apart[..., 0])
    touch = np.cumsum(recording.touching, axis=-2)[..., -1, :] / place.dtype.type(recording.frames)
    found = replace(
        outcome(recording), path_length_m=path, largest_step_m=steps.max(-1, initial=0.0),
        touch_fraction=touch, farthest_m=np.sqrt(apart.max(-1)))
    return found.apply(lambda values: np.asarray(values, dtype=np.float64))


def joined(outcomes: list[Outcome]) -> Outcome:
    """Return complete outcomes of some controllers each as one of all."""
    values: dict[str, Any] = {field.name: np.concatenate(
        [getattr(one, field.name) for one in outcomes]) for field in fields(Outcome)}
    return Outcome(**values)


def without(found: Outcome, failed: NDArray[np.bool_]) -> Outcome:
    """Return an outcome with NaN for the evaluations (C, W, K) that failed."""
    return found.apply(lambda values: np.where(
        failed.reshape(failed.shape + (1,) * (values.ndim - 3)), np.nan, values))
