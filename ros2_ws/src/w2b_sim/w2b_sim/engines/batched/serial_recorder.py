"""Serial networks whose every frame is recorded, or summed up in an outcome with all figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from w2b_core.network import Network
from w2b_core.outcome import Outcome
from w2b_sim.engines.batched import complete
from w2b_sim.engines.batched.compilation import compiled_prime
from w2b_sim.engines.batched.contacts import TOUCH_GAP_M
from w2b_sim.engines.batched.machine import Machine, columns, noisy
from w2b_sim.engines.batched.parameters import NOMINAL_LEAKY
from w2b_sim.engines.batched.recording_kernel import RecordedBatch
from w2b_sim.engines.batched.variations import Variations
from w2b_sim.engines.interface import Start
from w2b_sim.recording import Recording

Array = NDArray[np.float64]

#: Beyond this a robot did not walk: the evaluation counts as failed.
FARTHEST_M = 1e4


class SerialRecorder(Machine):
    """A machine that records serial networks; see `engine.BatchedEngine`."""

    def record(self, network: Network, signals: ArrayLike, starts: Sequence[Start],
               variations: Variations | None = None, *, seconds: Sequence[float] | None = None
               ) -> Recording:
        """
        Return the recordings (C, W, K, T, ...) of a batch of controllers; NaN of failed ones.

        Parameters
        ----------
        network, starts, variations
            As in `evaluate`.
        signals: shape (W, T) or (C, W, T); with `seconds` (W, P, T) or (C, W, P, T)
            The words, or W sequences of P words.
        seconds
            How long each of P words is followed; None: one word, for the world's steps. A new word
            primes the hidden neurons anew, and the motor neurons start from 0.

        Raises
        ------
        ValueError
            If the shapes do not belong together or to the body.

        """
        if seconds is None:
            heard = signals_of(signals, 3)[:, :, None]
            phase = np.zeros(self.world.steps, dtype=np.int64)
        else:
            heard, phase = signals_of(signals, 4), self._phases(seconds)
            if heard.shape[2] != len(seconds):
                raise ValueError(f'signals: expected {len(seconds)} words a sequence, as there '
                                 f'are seconds, got {heard.shape[2]}')
        batch, shape, failed = self._recorded_batch(network, heard, phase, starts, variations)
        recording = self._recorded(batch, shape)
        for values in vars(recording).values():
            if np.ndim(values):
                values[failed] = np.nan
        return recording

    def _complete(self, network: Network, signals: Array, starts: Sequence[Start],
                  variations: Variations | None) -> Outcome:
        phase = np.zeros(self.world.steps, dtype=np.int64)
        batch, shape, failed = self._recorded_batch(network, signals[:, :, None], phase, starts,
                                                    variations)
        found = complete.joined([
            complete.complete_outcome(self._recorded(piece, part))
            for piece, part in complete.pieces(batch, shape, len(phase) * sum(self._frame_widths),
                                               self.layout.lanes)])
        figures = np.concatenate([found.final_position_m, found.path_length_m[..., None],
                                  found.largest_step_m[..., None]], axis=-1)
        return complete.without(found, failed | wrong(figures))

    def _recorded_batch(self, network: Network, signals: Array, phase: NDArray[np.int64],
                        starts: Sequence[Start], variations: Variations | None
                        ) -> tuple[RecordedBatch, tuple[int, int, int], NDArray[np.bool_]]:
        """Return the batch of signals (C or 1, W, P, T), its shape, and what fails (C, W, K)."""
        controllers = self._check(network, signals, starts)
        layout, phases = self.layout, signals.shape[2]
        shape = (controllers, signals.shape[1], len(starts))
        failed = self._failed(network)
        given = (variations or Variations()).arrays(shape, self.world, TOUCH_GAP_M)
        hidden, motor = (finite(weights, failed) for weights in (
            network.hidden_weights, network.motor_weights))
        primed = np.zeros((controllers, shape[1] * phases, layout.hidden))
        compiled_prime()(replace(layout, bits=64), hidden, numbers(
            signals.reshape(len(signals), -1, signals.shape[3])), primed)
        # A serial network has neither leaks nor drives, and holds nothing.
        unread, phases_said = np.zeros((controllers, 0)), controllers * shape[1] * phases
        batch = RecordedBatch(
            hidden_weights=np.ascontiguousarray(np.delete(hidden, layout.hidden, axis=2)),
            hidden_leak=unread, rest=unread, motor_weights=motor, motor_leak=unread,
            heard_hidden=primed.reshape(-1, layout.hidden),
            heard_motor=np.zeros((phases_said, 0)), holds=np.zeros((phases_said, 2)),
            phase=phase, phases=phases, start=columns(self._starts(starts, given), shape),
            parameters=columns([*self._parameters(given), *map(np.asarray, NOMINAL_LEAKY)], shape),
            zeros=np.zeros((int(np.prod(shape)), layout.joints)),
            seeds=self._seeds(given, shape), noisy=noisy(given))
        broken = failed[:, None] | ~np.isfinite(signals).all((2, 3))
        return batch, shape, np.broadcast_to(broken[..., None], shape)

    def _failed(self, network: Network) -> NDArray[np.bool_]:
        """Return which controllers (C,) have weights that the engine's precision does not hold."""
        with np.errstate(over='ignore'):
            found: NDArray[np.bool_] = ~(
                np.isfinite(network.hidden_weights.astype(self._dtype)).all((1, 2))
                & np.isfinite(network.motor_weights.astype(self._dtype)).all((1, 2)))
        return found

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
        if signals.shape[0] not in (1, got[0]):
            raise ValueError(f'signals: expected {got[0]} controllers, got {signals.shape}')
        if not starts:
            raise ValueError('starts: expected at least one')
        return int(got[0])


def signals_of(signals: ArrayLike, axes: int) -> Array:
    """Return signals (C or 1, W, ..., T) with so many axes (ValueError)."""
    heard = np.asarray(signals, dtype=np.float64)
    if heard.ndim not in (axes - 1, axes) or 0 in heard.shape:
        inner = 'W, T' if axes == 3 else 'W, P, T'
        raise ValueError(f'signals: expected ({inner}) or (C, {inner}), got {heard.shape}')
    return heard if heard.ndim == axes else heard[None]


def numbers(values: Array) -> Array:
    """Return values with 0 for what is not finite: what fails is set to NaN afterwards."""
    return np.nan_to_num(np.ascontiguousarray(values), posinf=0.0, neginf=0.0)


def wrong(figures: Array) -> NDArray[np.bool_]:
    """Return which evaluations (...) are not finite or left all bounds; the first are x, y, z."""
    return np.asarray(~np.isfinite(figures).all(-1)
                      | (np.abs(figures[..., :3]) > FARTHEST_M).any(-1))


def finite(weights: Array, failed: NDArray[np.bool_]) -> Array:
    """Return the weights with those of failed controllers set to zero."""
    return np.ascontiguousarray(np.where(failed[:, None, None], 0.0, weights))
