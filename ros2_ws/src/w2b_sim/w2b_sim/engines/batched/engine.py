"""The batched engine's front: networks, words and starts in, an Evaluation out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from w2b_core.bodies.model import Body
from w2b_core.network import Network
from w2b_sim.engines.batched import kernel
from w2b_sim.engines.batched.compilation import compiled_evaluate
from w2b_sim.engines.batched.contacts import TOUCH_GAP_M
from w2b_sim.engines.batched.machine import columns, noisy
from w2b_sim.engines.batched.serial_recorder import (
    SerialRecorder,
    finite,
    numbers,
    signals_of,
    wrong,
)
from w2b_sim.engines.batched.supported import UnsupportedBodyError
from w2b_sim.engines.batched.variations import Variations
from w2b_sim.engines.interface import Evaluation, Start
from w2b_sim.worlds import World

Array = NDArray[np.float64]


class BatchedEngine(SerialRecorder):
    """
    Evaluates controllers by the thousand: one compiled call, one robot-word-start a SIMD lane.

    Results are the same bits whatever the batch around an evaluation, the lanes and the threads.
    An evaluation with weights that are not finite in the engine's precision, and one that leaves
    all bounds, has NaN for its outcome; its neighbours are not touched.

    Words are primed in double precision always.

    Parameters
    ----------
    body, world, precision, threads
        See `Machine`.
    complete
        True: an outcome has all its figures, for behaviours that need more than the plain ones
        (see `w2b_core.behaviours.Behaviour.figures`). The plain ones keep their bits; it takes
        longer (docs/engine.md), and code of its own is compiled.
    **options
        See `Machine`.

    """

    def __init__(self, body: Body, world: World, precision: str = 'double', threads: int = 1, *,
                 complete: bool = False, **options: Any) -> None:
        super().__init__(body, world, precision, threads, **options)
        self.complete = complete

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
        heard = signals_of(signals, 3)
        if self.complete:
            return self._complete(network, heard, starts, variations)
        return self._run(network, heard, None, starts, variations)

    def evaluate_primed(self, network: Network, hidden: ArrayLike, starts: Sequence[Start],
                        variations: Variations | None = None) -> Evaluation:
        """Return the plain outcome of networks primed already to `hidden` (C, W, H)."""
        primed = np.asarray(hidden, dtype=np.float64)
        if primed.ndim != 3 or primed.shape[2] != self.layout.hidden or 0 in primed.shape:
            raise ValueError(f'hidden: expected (C, W, {self.layout.hidden}), got {primed.shape}')
        return self._run(network, np.zeros((1, primed.shape[1], 0)), primed, starts, variations)

    def _run(self, network: Network, signals: Array, primed: Array | None,
             starts: Sequence[Start], variations: Variations | None,
             clock: kernel.Clock | None = None) -> Evaluation:
        controllers = self._check(network, signals, starts)
        layout, world = self.layout, self.world
        shape = (controllers, signals.shape[1], len(starts))
        failed = self._failed(network)
        failed_pairs = failed[:, None] | ~np.isfinite(signals).all(2)
        if primed is not None:
            failed_pairs = failed_pairs | ~np.isfinite(primed).all(2)
        given = (variations or Variations()).arrays(shape, world, TOUCH_GAP_M)
        count = shape[0] * shape[1] * shape[2]
        blocks = -(-count // layout.lanes)
        batch = kernel.Batch(
            finite(network.hidden_weights, failed), finite(network.motor_weights, failed),
            numbers(signals),
            np.zeros((*shape[:2], layout.hidden)) if primed is None else numbers(primed),
            columns(self._starts(starts, given), shape),
            columns(self._parameters(given), shape),
            self._seeds(given, shape), noisy(given))
        outcome = self._call(batch, blocks, clock).reshape(*shape, -1)
        outcome[wrong(outcome) | failed_pairs[..., None]] = np.nan
        return Evaluation(outcome[..., :3], outcome[..., 3], outcome[..., 4],
                          outcome[..., 5:5 + layout.touches],
                          outcome[..., -3:-1], outcome[..., -1])

    def _call(self, batch: kernel.Batch, blocks: int, clock: kernel.Clock | None) -> Array:
        if clock is None:
            self._settle()
            clock = self._clock
        evaluate, double = compiled_evaluate(), replace(self.layout, bits=64)
        log = kernel.Log(np.zeros((len(batch.start), self.layout.outcomes)))

        def run(first: int, last: int) -> None:
            evaluate(self.layout, double, self._tables, clock, batch, log, first, last)
        self._share(run, blocks, self.layout)
        return log.outcome

    def _stand(self, clock: kernel.Clock) -> Array:
        layout = self.layout
        still = Network(np.zeros((1, layout.hidden, layout.inputs + 1)),
                        np.zeros((1, layout.joints, layout.hidden)),
                        self._compiled.tables.time_constant)
        hidden = np.zeros((1, 1, layout.hidden))
        place: Array = self._run(still, np.zeros((1, 1, 0)), hidden, [Start()], None,
                                 clock).final_position_m[0, 0, 0]
        return place

__all__ = ['BatchedEngine', 'UnsupportedBodyError', 'Variations']
