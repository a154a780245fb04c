"""
The recurrent network that hears a word and then moves a body.

A word enters serially before the body moves: the elements of its vector pass one after the other
through a single auditory neuron into the hidden layer (*priming*). Then the auditory synapses are
detached, the sensor and motor neurons attached, and the network closes the loop with the body
("Word2vec to behavior", IROS 2019, sections II-B and II-D).

All functions broadcast over leading axes: weights of shape (C, 1, H, K) with signals (W, T) give
states of shape (C, W, ...). A batch gives the same bits as its members one by one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Network:
    """
    Weights and time constants of one controller, or of a batch of them.

    Attributes
    ----------
    hidden_weights: shape (..., H, H + 1 + S)
        Synapses onto the hidden neurons. Columns: the H hidden neurons, the auditory neuron, the
        S sensor neurons.
    motor_weights: shape (..., M, H)
        Synapses from the hidden neurons onto the motor neurons.
    motor_time_constants: shape (M,)
        Factor of the summed input in a motor neuron's update; hidden neurons have 1.

    """

    hidden_weights: Array
    motor_weights: Array
    motor_time_constants: Array

    def __post_init__(self) -> None:
        """Convert to float64 and check that the shapes belong together (ValueError if not)."""
        for name in ('hidden_weights', 'motor_weights', 'motor_time_constants'):
            object.__setattr__(self, name, np.asarray(getattr(self, name), dtype=np.float64))
        hidden, motor = self.hidden_weights.shape, self.motor_weights.shape
        if len(hidden) < 2 or hidden[-1] < hidden[-2] + 1:
            raise ValueError(f'hidden_weights: expected (..., H, H + 1 + S), got {hidden}')
        if len(motor) < 2 or motor[-1] != hidden[-2] or motor[:-2] != hidden[:-2]:
            raise ValueError(
                f'motor_weights: expected (..., M, {hidden[-2]}) with the leading axes of '
                f'hidden_weights {hidden[:-2]}, got {motor}')
        if self.motor_time_constants.shape != motor[-2:-1]:
            raise ValueError(f'motor_time_constants: expected {motor[-2:-1]}, '
                             f'got {self.motor_time_constants.shape}')

    def batched(self) -> Network:
        """Return one controller as a batch of one, as evaluators take it."""
        return Network(self.hidden_weights[None], self.motor_weights[None],
                       self.motor_time_constants)

    @property
    def hidden_count(self) -> int:
        """Number of hidden neurons, H."""
        return int(self.hidden_weights.shape[-2])

    @property
    def motor_count(self) -> int:
        """Number of motor neurons, M."""
        return int(self.motor_weights.shape[-2])

    @property
    def sensor_count(self) -> int:
        """Number of sensor neurons, S."""
        return int(self.hidden_weights.shape[-1]) - self.hidden_count - 1


class State(NamedTuple):
    """
    What the neurons hold between two steps.

    `hidden` (..., H) and `motors` (..., M) are in -1..1; `previous_hidden` is the value one update
    earlier. `primed` is true from priming until the first step.
    """

    hidden: Array
    previous_hidden: Array
    motors: Array
    primed: bool


def prime(network: Network, signal: ArrayLike) -> State:
    """
    Return the state after the elements of `signal` have passed through the auditory neuron.

    Parameters
    ----------
    network
        One controller or a batch.
    signal: shape (..., T)
        A word's vector; several words: their vectors one after the other.

    Raises
    ------
    ValueError
        If the signal is empty or not finite.

    """
    signal = np.asarray(signal, dtype=np.float64)
    if signal.ndim == 0 or signal.shape[-1] == 0:
        raise ValueError(f'signal: expected shape (..., T) with T > 0, got {signal.shape}')
    if not np.isfinite(signal).all():
        raise ValueError('signal: expected finite numbers, got NaN or infinity')
    count = network.hidden_count
    weights = network.hidden_weights[..., :count + 1]
    batch = np.broadcast_shapes(signal.shape[:-1], weights.shape[:-2])
    hidden = previous = np.zeros((*batch, count))
    sources = np.zeros((*batch, count + 1))
    for element in np.moveaxis(signal, -1, 0):
        sources[..., :count] = previous = hidden
        sources[..., count] = element
        hidden = np.tanh(_sum(weights, sources) + hidden)
    return State(hidden, previous, np.zeros((*batch, network.motor_count)), True)


def step(network: Network, state: State, sensors: ArrayLike) -> State:
    """
    Return the state one control period later.

    The body is driven by the motors of the state *before* this step: a motor command acts one
    step late. In the first step after priming the hidden values count twice, as the original
    program adds its update to the primed value without resetting it.

    Parameters
    ----------
    network, state
        As given to and returned by `prime`.
    sensors: shape (..., S)
        What the sensor neurons read now.

    """
    sensors = np.asarray(sensors, dtype=np.float64)
    if sensors.shape[-1:] != (network.sensor_count,):
        raise ValueError(f'sensors: expected (..., {network.sensor_count}), got {sensors.shape}')
    count = network.hidden_count
    own = state.hidden * (2.0 if state.primed else 1.0)
    hidden = np.tanh(own + _sum(network.hidden_weights[..., :count], state.hidden)
                     + _sum(network.hidden_weights[..., count + 1:], sensors))
    motors = np.tanh(state.motors + network.motor_time_constants
                     * _sum(network.motor_weights, state.hidden))
    return State(hidden, state.hidden, motors, False)


def _sum(weights: Array, values: Array) -> Array:
    """
    Sum the weighted sources (..., K) of each neuron (..., N, K).

    Always by matmul, as the original program does: random networks are chaotic while they are
    primed, and another order of summation ends in another state after 300 elements.
    """
    total: Array = np.matmul(weights, values[..., None])[..., 0]
    return total
