"""
Hidden layers by the thousand, without a body: primed with words, then left to themselves.

`live` has the semantics of `w2b_core.network` with silent sensors, in single precision and
with a rational tanh (error below 1e-4): fast enough to breed networks on, not to judge them by.
`live_exactly` is that network: after hundreds of updates a word near the border between rest and
rhythm may go the other way.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from w2b_core.network import Network, prime, step
from w2b_sim.engines.jit import njit

Array = NDArray[np.float64]

#: Networks and words are run side by side in blocks of this many, which the compiler vectorises.
LANES = 64
#: Updates after priming, the first of them that counts as settled, and the first of the end: a
#: rhythm must last to the end, or evolution finds rhythms that die just before they are judged.
STEPS, SETTLED, LATE = 450, 130, 350


class Life(NamedTuple):
    """Hidden neurons once settled (N, R, H): mean, swing, and swing at the end."""

    mean: Array
    swing: Array
    late_swing: Array


def live(hidden_weights: ArrayLike, signals: ArrayLike, bias: ArrayLike | None = None) -> Life:
    """
    Prime networks (N, H, H + 1 + S) with signals (R, T) and let them run with silent sensors.

    `bias` (R, H), if given, is added to the input of the hidden neurons in every update after
    priming, as feet that stand on the floor would.

    Swings are standard deviations over the settled updates, or the late ones.
    """
    weights = np.asarray(hidden_weights, dtype=np.float32)
    heard = np.ascontiguousarray(signals, dtype=np.float32)
    count, hidden = weights.shape[:2]
    felt = np.zeros((len(heard), hidden)) if bias is None else np.asarray(bias)
    sums = np.zeros((count * len(heard), 4, hidden), dtype=np.float32)
    _live(np.ascontiguousarray(weights[:, :, :hidden + 1]), heard,
          np.ascontiguousarray(felt, dtype=np.float32), sums)
    settled, late = STEPS - SETTLED, STEPS - LATE
    whole = sums.astype(np.float64).reshape(count, len(heard), 4, hidden)
    mean, square = np.moveaxis(whole[:, :, :2] / settled, 2, 0)
    late_mean, late_square = np.moveaxis(whole[:, :, 2:] / late, 2, 0)
    return Life(mean, _deviation(square, mean), _deviation(late_square, late_mean))


def live_exactly(hidden_weights: ArrayLike, signals: ArrayLike) -> Life:
    """Return the same as `live` without bias, by the network itself."""
    weights = np.asarray(hidden_weights, dtype=np.float64)
    count, hidden = weights.shape[:2]
    network = Network(weights[:, None, :, :hidden + 1], np.zeros((count, 1, 1, hidden)), np.ones(1))
    state = prime(network, np.asarray(signals, dtype=np.float64))
    course = []
    for _ in range(STEPS):
        state = step(network, state, np.zeros(0))
        course.append(state.hidden)
    whole = np.array(course)
    return Life(whole[SETTLED:].mean(axis=0), whole[SETTLED:].std(axis=0),
                whole[LATE:].std(axis=0))


def _deviation(square: Array, mean: Array) -> Array:
    """Standard deviation of what has this mean square and mean; below 0.003 it is rounding."""
    deviation: Array = np.sqrt(np.maximum(square - mean**2 - 1e-5, 0.0))
    return deviation


@njit(fastmath=True, error_model='numpy', inline='always')
def _tanh(x: Any) -> Any:
    """Padé approximant, clipped where it reaches 1."""
    x = min(max(x, np.float32(-4.97)), np.float32(4.97))
    z = x * x
    top = x * (np.float32(135135) + z * (np.float32(17325) + z * (np.float32(378) + z)))
    bottom = np.float32(135135) + z * (np.float32(62370) + z * (
        np.float32(3150) + z * np.float32(28)))
    return min(max(top / bottom, np.float32(-1)), np.float32(1))


@njit(fastmath=True, error_model='numpy', cache=True)
def _update(weights: Any, hidden: Any, new: Any, own: Any) -> None:  # pragma: no cover (compiled)
    """Set hidden to tanh(own * hidden + recurrent input + what `new` holds), lane by lane."""
    count = len(hidden)
    for i in range(count):
        for lane in range(LANES):
            new[i, lane] += own * hidden[i, lane]
        for j in range(count):
            for lane in range(LANES):
                new[i, lane] += weights[i, j, lane] * hidden[j, lane]
    for i in range(count):
        for lane in range(LANES):
            hidden[i, lane] = _tanh(new[i, lane])


@njit(fastmath=True, error_model='numpy', cache=True)
def _live(weights: Any, signals: Any, bias: Any, sums: Any) -> None:  # pragma: no cover
    """Fill `sums` (N * R, 4, H): hidden, squared, both once more when late; compiled."""
    networks, count = weights.shape[0], weights.shape[1]
    words, length = signals.shape
    total = networks * words
    lanes = np.empty((count, count + 1, LANES), dtype=np.float32)
    hidden = np.empty((count, LANES), dtype=np.float32)
    new = np.empty((count, LANES), dtype=np.float32)
    tally = np.empty((4, count, LANES), dtype=np.float32)
    heard = np.empty((length, LANES), dtype=np.float32)
    felt = np.empty((count, LANES), dtype=np.float32)
    one, two = np.float32(1), np.float32(2)
    for first in range(0, total, LANES):
        for lane in range(LANES):
            pair = min(first + lane, total - 1)
            for i in range(count):
                for j in range(count + 1):
                    lanes[i, j, lane] = weights[pair // words, i, j]
                felt[i, lane] = bias[pair % words, i]
            for t in range(length):
                heard[t, lane] = signals[pair % words, t]
        hidden[:] = np.float32(0)
        tally[:] = np.float32(0)
        for t in range(length):
            for i in range(count):
                for lane in range(LANES):
                    new[i, lane] = lanes[i, count, lane] * heard[t, lane]
            _update(lanes, hidden, new, one)
        new[:] = felt
        _update(lanes, hidden, new, two)
        for t in range(1, STEPS):
            new[:] = felt
            _update(lanes, hidden, new, one)
            if t >= SETTLED:
                for i in range(count):
                    for lane in range(LANES):
                        tally[0, i, lane] += hidden[i, lane]
                        tally[1, i, lane] += hidden[i, lane] * hidden[i, lane]
            if t >= LATE:
                for i in range(count):
                    for lane in range(LANES):
                        tally[2, i, lane] += hidden[i, lane]
                        tally[3, i, lane] += hidden[i, lane] * hidden[i, lane]
        for lane in range(min(LANES, total - first)):
            for k in range(4):
                for i in range(count):
                    sums[first + lane, k, i] = tally[k, i, lane]
