"""The batched engine's front: networks, words and starts in, an Evaluation out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from w2b_core.network import Network
from w2b_sim.engines.batched import kernel
from w2b_sim.engines.batched.compilation import compiled_evaluate
from w2b_sim.engines.batched.contacts import TOUCH_GAP_M
from w2b_sim.engines.batched.machine import Machine, columns, lane_seeds
from w2b_sim.engines.batched.supported import UnsupportedBodyError
from w2b_sim.engines.batched.variations import Variations
from w2b_sim.engines.interface import Evaluation, Start

Array = NDArray[np.float64]

#: Beyond this a robot did not walk: the evaluation counts as failed.
FARTHEST_M = 1e4


@dataclass(frozen=True)
class Trajectories:
    """
    What was logged at each of T sensor frames of each evaluation.

    `position_m` (C, W, K, T, 3) of the base, `joint_position_rad` (C, W, K, T, M), `touching`
    (C, W, K, T, S_touch), one column a touch-sensitive link in the order of the body's sensors.
    """

    position_m: Array
    joint_position_rad: Array
    touching: Array


class BatchedEngine(Machine):
    """
    Evaluates controllers by the thousand: one compiled call, one robot-word-start a SIMD lane.

    Results are the same bits whatever the batch around an evaluation, the lanes and the threads.
    An evaluation with weights that are not finite in the engine's precision, and one that leaves
    all bounds, has NaN for its outcome; its neighbours are not touched.

    See `Machine` for the options. Words are primed in double precision always.
    """

    def evaluate(self, network: Network, signals: ArrayLike, starts: Sequence[Start],
                 variations: Variations | None = None) -> Evaluation:
        """
        Return the outcome of a batch of controllers.

        Parameters
        ----------
        network
            C controllers: weights of shape (C, H, K).
        signals: shape (W, T) or (C, W, T)
            The words, or each controller's own words.
        starts
            K of them.
        variations
            Deviations of single evaluations.

        Raises
        ------
        ValueError
            If the shapes do not belong together or to the body.

        """
        signals = np.asarray(signals, dtype=np.float64)
        if signals.ndim not in (2, 3) or 0 in signals.shape:
            raise ValueError(f'signals: expected (W, T) or (C, W, T), got {signals.shape}')
        return self._run(network, signals, None, starts, variations, False)[0]

    def record(self, network: Network, signals: ArrayLike, starts: Sequence[Start],
               variations: Variations | None = None) -> tuple[Evaluation, Trajectories]:
        """Return the same as `evaluate`, and what was logged on the way."""
        signals = np.asarray(signals, dtype=np.float64)
        if signals.ndim not in (2, 3) or 0 in signals.shape:
            raise ValueError(f'signals: expected (W, T) or (C, W, T), got {signals.shape}')
        evaluation, log = self._run(network, signals, None, starts, variations, True)
        assert log is not None
        return evaluation, log

    def evaluate_primed(self, network: Network, hidden: ArrayLike, starts: Sequence[Start],
                        variations: Variations | None = None) -> Evaluation:
        """Return the same as `evaluate` for networks primed already to `hidden` (C, W, H)."""
        primed = np.asarray(hidden, dtype=np.float64)
        if primed.ndim != 3 or primed.shape[2] != self.layout.hidden or 0 in primed.shape:
            raise ValueError(f'hidden: expected (C, W, {self.layout.hidden}), got {primed.shape}')
        return self._run(network, np.zeros((1, primed.shape[1], 0)), primed, starts, variations,
                         False)[0]

    def _run(self, network: Network, signals: Array, primed: Array | None,
             starts: Sequence[Start], variations: Variations | None, logging: bool
             ) -> tuple[Evaluation, Trajectories | None]:
        controllers = self._check(network, signals, starts)
        layout, world = self.layout, self.world
        signals = signals if signals.ndim == 3 else signals[None]
        shape = (controllers, signals.shape[1], len(starts))
        with np.errstate(over='ignore'):
            failed = ~(np.isfinite(network.hidden_weights.astype(self._dtype)).all((1, 2))
                       & np.isfinite(network.motor_weights.astype(self._dtype)).all((1, 2)))
        failed_pairs = failed[:, None] | ~np.isfinite(signals).all(2)
        if primed is not None:
            failed_pairs = failed_pairs | ~np.isfinite(primed).all(2)
        given = (variations or Variations()).arrays(shape, world, TOUCH_GAP_M)
        count = shape[0] * shape[1] * shape[2]
        blocks = -(-count // layout.lanes)
        batch = kernel.Batch(
            _finite(network.hidden_weights, failed), _finite(network.motor_weights, failed),
            np.nan_to_num(np.ascontiguousarray(signals), posinf=0.0, neginf=0.0),
            np.zeros((*shape[:2], layout.hidden)) if primed is None
            else np.nan_to_num(np.array(primed), posinf=0.0, neginf=0.0),
            columns(self._starts(starts, given), shape),
            columns(self._parameters(given), shape),
            lane_seeds(np.broadcast_to(given['seed'], shape).reshape(count), blocks * layout.lanes),
            any(given[name].any() for name in ('touch_delay', 'touch_flip_probability',
                                               'push_m_s', 'motor_noise_rad_s')))
        frames = world.steps if logging else 0
        log = kernel.Log(np.zeros((count, layout.outcomes)), frames,
                         *(np.zeros((count if frames else 0, frames, width), dtype=self._dtype)
                           for width in (3, layout.links - 1, layout.touches)))
        self._call(batch, log, blocks)
        outcome = log.outcome.reshape(*shape, -1)
        wrong = ~np.isfinite(outcome).all(3) | (np.abs(outcome[..., :3]) > FARTHEST_M).any(3)
        outcome[wrong | failed_pairs[..., None]] = np.nan
        evaluation = Evaluation(outcome[..., :3], outcome[..., 3], outcome[..., 4],
                                outcome[..., 5:5 + layout.touches],
                                outcome[..., -3:-1], outcome[..., -1])
        if not logging:
            return evaluation, None
        return evaluation, Trajectories(*(
            array.reshape(*shape, *array.shape[1:]).astype(np.float64)
            for array in (log.place, log.angle, log.touch)))

    def _call(self, batch: kernel.Batch, log: kernel.Log, blocks: int) -> None:
        evaluate = compiled_evaluate()
        double = replace(self.layout, bits=64)

        def run(first: int, last: int) -> None:
            evaluate(self.layout, double, self._tables, self._clock, batch, log, first, last)
        self._share(run, blocks)

    def _check(self, network: Network, signals: Array, starts: Sequence[Start]) -> int:
        layout = self.layout
        expected = (layout.hidden, layout.hidden + 1 + layout.sensors)
        got = network.hidden_weights.shape
        if len(got) != 3 or got[1:] != expected or got[0] == 0:
            raise ValueError(f'network: {self.body.name} needs hidden weights of shape '
                             f'(C, {expected[0]}, {expected[1]}), got {got}')
        if network.motor_weights.shape[1] != layout.links - 1:
            raise ValueError(f'network: {self.body.name} has {layout.links - 1} motors, '
                             f'got motor weights of shape {network.motor_weights.shape}')
        if not np.array_equal(network.motor_time_constants, self._compiled.tables.time_constant):
            raise ValueError(
                f'network: {self.body.name} has the motor time constants '
                f'{self._compiled.tables.time_constant}, got {network.motor_time_constants}')
        if signals.ndim == 3 and signals.shape[0] not in (1, got[0]):
            raise ValueError(f'signals: expected {got[0]} controllers, got {signals.shape}')
        if not starts:
            raise ValueError('starts: expected at least one')
        return int(got[0])


def _finite(weights: Array, failed: NDArray[np.bool_]) -> Array:
    """Return the weights with those of failed controllers set to zero."""
    return np.ascontiguousarray(np.where(failed[:, None, None], 0.0, weights))


__all__ = ['BatchedEngine', 'Trajectories', 'UnsupportedBodyError', 'Variations']


