"""The batched engine's front for leaky networks: commands and situations in, a Recording out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from w2b_core.behaviours import DEFAULT_BEHAVIOURS, holds
from w2b_core.bodies.model import Body
from w2b_core.network.leaky import BLOCKS, LeakyNetwork
from w2b_sim.engines.batched import kernel
from w2b_sim.engines.batched.contacts import TOUCH_GAP_M
from w2b_sim.engines.batched.leaky_variations import LeakyVariations
from w2b_sim.engines.batched.machine import Machine, columns, noisy
from w2b_sim.engines.batched.recording_kernel import RecordedBatch
from w2b_sim.engines.interface import Start
from w2b_sim.recording import Recording
from w2b_sim.worlds import World

Array = NDArray[np.float64]


class LeakyEngine(Machine):
    """
    Walks commanded leaky networks by the thousand: one evaluation a SIMD lane.

    Parameters
    ----------
    body, world
        What moves, and where.
    hidden
        Number of hidden neurons.
    senses
        Of the network, in its order: names as in `w2b_core.senses`.
    behaviours
        Of the command vector, in its order.
    **options
        See `Machine`.

    Raises
    ------
    UnsupportedBodyError
        If the engine does not model the body or a sense, with the reason.

    """

    LEAKY: ClassVar[bool] = True

    def __init__(self, body: Body, world: World, *, hidden: int, senses: Sequence[str],
                 behaviours: Sequence[str] = DEFAULT_BEHAVIOURS, **options: Any) -> None:
        options.setdefault('precision', 'single')
        super().__init__(replace(body, sensors=tuple(senses), hidden_neurons=hidden), world,
                         **options)
        self.layout = replace(self.layout, leaky=1, records=1)
        self.behaviours = tuple(behaviours)

    def record(self, network: LeakyNetwork, commands: ArrayLike, seconds: Sequence[float],
               starts: Sequence[Start] = (Start(),), variations: LeakyVariations | None = None
               ) -> Recording:
        """
        Return the recordings (C, W, K, T, ...) of a batch of controllers.

        Parameters
        ----------
        network
            C controllers.
        commands: shape (W, P, behaviours) or (C, W, P, behaviours)
            W sequences of P commands.
        seconds
            Of each of the P phases.
        starts
            K of them, or one for all situations of the variations.
        variations
            Deviations of single evaluations, which broadcast to (C, W, K).

        Raises
        ------
        ValueError
            If shapes do not belong together or to the body.

        """
        said = self._commands(network, commands, len(seconds))
        situations = max([len(starts)] + [np.shape(value)[-1] for name, value in vars(
            variations or LeakyVariations()).items()
            if np.ndim(value) and name != 'joint_zero_rad'])
        shape = (said.shape[0], said.shape[1], situations)
        phase = self._phases(seconds)
        batch = self._batch(network, said, phase, starts, variations or LeakyVariations(), shape)
        return self._recorded(batch, shape)

    def _stand(self, clock: kernel.Clock) -> Array:
        layout = self.layout
        sizes = {'H': layout.hidden, 'S': layout.sensors, 'M': layout.joints,
                 'K': len(self.behaviours)}
        still = LeakyNetwork(**{block.name: np.full(
            (1, *(sizes[axis] for axis in block.shape)), max(0.0, block.low)) for block in BLOCKS})
        batch = self._batch(still, np.zeros((1, 1, 1, sizes['K'])),
                            np.zeros(clock.steps, dtype=np.int64), [Start()], LeakyVariations(),
                            (1, 1, 1))
        place: Array = self._recorded(batch, (1, 1, 1), clock).position_m[0, 0, 0, -1]
        return place

    def _commands(self, network: LeakyNetwork, commands: ArrayLike, phases: int) -> Array:
        """Return (C, W, P, behaviours) (ValueError if it or the network does not fit)."""
        sizes, layout = network.sizes, self.layout
        expected = {'H': layout.hidden, 'S': layout.sensors, 'M': layout.joints,
                    'K': len(self.behaviours)}
        if sizes != expected or network.hidden.ndim != 3:
            raise ValueError(f'network: expected a batch (C, ...) with {expected} for '
                             f'{self.body.name}, got {sizes}, batch {network.hidden.shape[:-2]}')
        said = np.asarray(commands, dtype=np.float64)
        if said.ndim == 3:
            said = np.broadcast_to(said, (len(network.hidden), *said.shape))
        if (said.ndim != 4 or said.shape[0] != len(network.hidden) or 0 in said.shape
                or said.shape[2:] != (phases, len(self.behaviours))):
            raise ValueError(f'commands: expected (C or none, W, {phases}, '
                             f'{len(self.behaviours)}), got {np.shape(commands)}')
        if not np.isfinite(said).all():
            raise ValueError('commands: expected finite numbers')
        return said

    def _batch(self, network: LeakyNetwork, said: Array, phase: NDArray[np.int64],
               starts: Sequence[Start], variations: LeakyVariations, shape: tuple[int, int, int]
               ) -> RecordedBatch:
        drives = LeakyNetwork(**{block.name: getattr(network, block.name)[:, None, None]
                                 for block in BLOCKS}).drive(said)
        given = variations.arrays(shape, self.world, TOUCH_GAP_M)
        layout = self.layout
        period = self.world.control_period_s
        offset = given['heading_offset_rad']
        parameters = [*self._parameters(given), given['servo_speed_scale'],
                      given['servo_torque_scale'], given['command_late'], np.sin(offset),
                      np.cos(offset), given['gyro_bias_rad_s'] * period,
                      given['gyro_noise_rad_s'] * period, given['gyro_bias_rad_s'],
                      given['gyro_noise_rad_s'], given['gravity_noise']]
        return RecordedBatch(
            hidden_weights=_together(network.hidden, network.senses),
            hidden_leak=np.ascontiguousarray(network.hidden_leak),
            rest=np.ascontiguousarray(network.rest),
            motor_weights=_together(network.motor, network.motor_senses),
            motor_leak=np.ascontiguousarray(network.motor_leak),
            heard_hidden=np.ascontiguousarray(drives.hidden).reshape(-1, layout.hidden),
            heard_motor=np.ascontiguousarray(drives.motors).reshape(-1, layout.joints),
            holds=np.ascontiguousarray(holds(self.behaviours, said)).reshape(-1, 2),
            phase=phase, phases=said.shape[2],
            start=columns(self._starts(starts, given), shape),
            parameters=columns(parameters, shape), zeros=np.ascontiguousarray(
                variations.zeros(shape, layout.joints)),
            seeds=self._seeds(given, shape),
            noisy=noisy(given, 'gyro_noise_rad_s', 'gravity_noise'))


def _together(first: Array, second: Array) -> Array:
    """Return synapses from two sources as one array."""
    return np.ascontiguousarray(np.concatenate([first, second], axis=-1))
