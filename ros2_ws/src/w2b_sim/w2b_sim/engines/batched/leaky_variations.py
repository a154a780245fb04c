"""What may differ from one evaluation of a leaky network to the next, beside `Variations`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from w2b_sim.engines.batched.variations import Variations, checked

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LeakyVariations(Variations):
    """
    Deviations; fields broadcast to (C, W, K): controllers, sequences, situations.

    Attributes
    ----------
    servo_speed_scale, servo_torque_scale
        Factors of the servos' greatest speed and torque. A heavier robot with the same servos is
        one with weaker servos: a factor of all masses is the inverse of one of the torque.
    command_late
        True: the servos get the targets of one control period ago.
    heading_offset_rad
        Of the heading to hold from the one that the robot has when a command comes.
    gyro_bias_rad_s
        What is left of the gyro's bias after its estimate: felt, and added up in the heading.
    gyro_noise_rad_s
        Of each reading of the gyro, uniform within plus and minus this, likewise.
    gravity_noise
        Of each component of the direction of gravity, likewise.
    joint_zero_rad: shape (..., J)
        Errors of the joints' zeros; the leading axes broadcast to (C, W, K).

    """

    servo_speed_scale: ArrayLike | None = None
    servo_torque_scale: ArrayLike | None = None
    command_late: ArrayLike | None = None
    heading_offset_rad: ArrayLike | None = None
    gyro_bias_rad_s: ArrayLike | None = None
    gyro_noise_rad_s: ArrayLike | None = None
    gravity_noise: ArrayLike | None = None
    joint_zero_rad: ArrayLike | None = None

    def zeros(self, shape: tuple[int, int, int], joints: int) -> Array:
        """Return the errors of the joints' zeros (C * W * K, J) (ValueError)."""
        if self.joint_zero_rad is None:
            return np.zeros((int(np.prod(shape)), joints))
        value = np.asarray(self.joint_zero_rad, dtype=np.float64)
        if value.shape[-1:] != (joints,):
            raise ValueError(f'variations: joint_zero_rad: expected (..., {joints}), '
                             f'got {value.shape}')
        checked('joint_zero_rad', value[..., 0], shape)
        if not (np.abs(value) <= np.pi).all():
            raise ValueError('variations: joint_zero_rad: expected at most pi, got '
                             f'{np.abs(value).max()}')
        return np.broadcast_to(value, (*shape, joints)).reshape(-1, joints)
