"""
A leaky recurrent network that is commanded at every step: the legs, with the ear apart.

With the hidden neurons h (H,), the motor neurons m (M,), the command u (K,) in 0..1 and the
senses s (S,), one control period is

    h += hidden_leak * (tanh(hidden h + command u + senses s) - h)
    m += motor_leak * (tanh(motor h + motor_command u + motor_senses s) - m)

Both hear the hidden neurons' previous values. `command u` and `motor_command u` are constant
between words: the `Drive`. All functions broadcast over leading axes, as `serial` does.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Block:
    """
    One named array of a network's parameters.

    Attributes
    ----------
    name
        Of the field of `LeakyNetwork`.
    shape
        Names of its axes: H hidden neurons, K behaviours, S senses, M motor neurons.
    low, high
        The numbers it may hold.
    mutation
        Standard deviation of a first mutation; 0 for what is not evolved.

    """

    name: str
    shape: tuple[str, ...]
    low: float = -20.0
    high: float = 20.0
    mutation: float = 0.15


#: A leak of 0 would never move.
LEAST_LEAK = 0.05
BLOCKS = (
    Block('hidden', ('H', 'H')), Block('command', ('H', 'K')), Block('senses', ('H', 'S')),
    Block('hidden_leak', ('H',), LEAST_LEAK, 1.0), Block('rest', ('H',), -1.0, 1.0, 0.0),
    Block('motor', ('M', 'H')), Block('motor_command', ('M', 'K')),
    Block('motor_senses', ('M', 'S')), Block('motor_leak', ('M',), LEAST_LEAK, 1.0))
BLOCK = {block.name: block for block in BLOCKS}


class Drive(NamedTuple):
    """What a command adds to the neurons' inputs at every step: `hidden` (..., H), `motors`."""

    hidden: Array
    motors: Array


class LeakyState(NamedTuple):
    """What the neurons hold between two steps: `hidden` (..., H) and `motors` (..., M), -1..1."""

    hidden: Array
    motors: Array


@dataclass(frozen=True, eq=False)
class LeakyNetwork:
    """
    Parameters of one network, or of a batch of them.

    Attributes
    ----------
    hidden: shape (..., H, H)
        Synapses among the hidden neurons; row i holds those onto neuron i.
    command: shape (..., H, K)
        From the command onto the hidden neurons.
    senses: shape (..., H, S)
        From the senses onto the hidden neurons.
    hidden_leak: shape (..., H)
        Share of the way to its new value that a neuron goes in one step.
    rest: shape (..., H)
        The hidden neurons before the first step; the motor neurons start at 0.
    motor: shape (..., M, H)
        From the hidden neurons onto the motor neurons.
    motor_command: shape (..., M, K)
    motor_senses: shape (..., M, S)
    motor_leak: shape (..., M)

    Raises
    ------
    ValueError
        If shapes do not belong together or a number is outside its block's range.

    """

    hidden: Array
    command: Array
    senses: Array
    hidden_leak: Array
    rest: Array
    motor: Array
    motor_command: Array
    motor_senses: Array
    motor_leak: Array

    def __post_init__(self) -> None:
        """Convert to float64 and check shapes and ranges (ValueError)."""
        for field in fields(self):
            object.__setattr__(self, field.name,
                               np.asarray(getattr(self, field.name), dtype=np.float64))
        if self.hidden.ndim < 2 or self.motor.ndim < 2:
            raise ValueError(f'hidden, motor: expected (..., H, H) and (..., M, H), '
                             f'got {self.hidden.shape} and {self.motor.shape}')
        batch, sizes = self.hidden.shape[:-2], self.sizes
        for block in BLOCKS:
            value = getattr(self, block.name)
            expected = (*batch, *(sizes[axis] for axis in block.shape))
            if value.shape != expected:
                raise ValueError(f'{block.name}: expected shape {expected} '
                                 f'(..., {", ".join(block.shape)}), got {value.shape}')
            if not ((value >= block.low) & (value <= block.high)).all():
                raise ValueError(f'{block.name}: expected numbers from {block.low:g} to '
                                 f'{block.high:g}, got {value.min()} to {value.max()}')

    @property
    def sizes(self) -> dict[str, int]:
        """Length of each axis: H hidden neurons, K behaviours, S senses, M motor neurons."""
        return {'H': self.hidden.shape[-1], 'K': self.command.shape[-1],
                'S': self.senses.shape[-1], 'M': self.motor.shape[-2]}

    def drive(self, command: ArrayLike) -> Drive:
        """Return what `command` (..., K) adds to the neurons' inputs (ValueError)."""
        u = np.asarray(command, dtype=np.float64)
        if u.shape[-1:] != self.command.shape[-1:] or not np.isfinite(u).all():
            raise ValueError(f'command: expected {self.command.shape[-1]} finite numbers, got {u}')
        return Drive(_times(self.command, u), _times(self.motor_command, u))

    def initial_state(self) -> LeakyState:
        """Return the state before the first step."""
        return LeakyState(self.rest.copy(), np.zeros(self.motor_leak.shape))


def step(network: LeakyNetwork, state: LeakyState, drive: Drive, senses: ArrayLike) -> LeakyState:
    """
    Return the state one control period later.

    As with the serial network, the body follows the motors of the state *before* this step.

    Parameters
    ----------
    network, state
        As given to and returned by this function.
    drive
        Of the last command; zeros before the first.
    senses: shape (..., S)
        What is sensed now, see `w2b_core.senses`.

    """
    s = np.asarray(senses, dtype=np.float64)
    if s.shape[-1:] != network.senses.shape[-1:]:
        raise ValueError(f'senses: expected (..., {network.senses.shape[-1]}), got {s.shape}')
    hidden = np.tanh(_times(network.hidden, state.hidden) + drive.hidden
                     + _times(network.senses, s))
    motors = np.tanh(_times(network.motor, state.hidden) + drive.motors
                     + _times(network.motor_senses, s))
    return LeakyState(state.hidden + network.hidden_leak * (hidden - state.hidden),
                      state.motors + network.motor_leak * (motors - state.motors))


def _times(weights: Array, values: Array) -> Array:
    """Return the weighted sums (..., N) of values (..., K) by weights (..., N, K)."""
    total: Array = np.matmul(weights, values[..., None])[..., 0]
    return total
