"""What may differ from one evaluation to the next: worlds and bodies for robust training."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike, NDArray

from w2b_sim.worlds import World

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Variations:
    """
    Deviations of each evaluation from the world and the body; None for none.

    Every field is a number or an array that broadcasts to (C, W, K): controllers, words, starts.

    Attributes
    ----------
    slip_m_per_n_s
        Force-dependent slip instead of the world's.
    friction
        Coulomb's coefficient instead of the world's; infinity for unbounded viscous friction.
    erp
        Share of a penetration (and of a hinge's drift) that a physics step removes.
    gravity_m_s2
        Instead of the world's, negative.
    base_mass_scale
        Factor of the base's mass and inertia.
    height_m, roll_rad, pitch_rad, yaw_rad
        Added to those of the start.
    touch_gap_m
        A touch sensor reads 1 from this height above the floor on.
    touch_delay
        True: touch sensors read what was one control period ago.
    touch_flip_probability
        Of each touch reading to be inverted.
    push_m_s
        Each control period, the whole body's velocity changes along x and y by a random amount,
        uniform within plus and minus this.
    servo_gain_scale
        Factor of the servos' gain.
    motor_noise_rad_s
        Added to each servo's velocity each control period, uniform within plus and minus this.
    seed
        Of an evaluation's random numbers, an integer: the same seed gives the same numbers in any
        batch.

    """

    slip_m_per_n_s: ArrayLike | None = None
    friction: ArrayLike | None = None
    erp: ArrayLike | None = None
    gravity_m_s2: ArrayLike | None = None
    base_mass_scale: ArrayLike | None = None
    height_m: ArrayLike | None = None
    roll_rad: ArrayLike | None = None
    pitch_rad: ArrayLike | None = None
    yaw_rad: ArrayLike | None = None
    touch_gap_m: ArrayLike | None = None
    touch_delay: ArrayLike | None = None
    touch_flip_probability: ArrayLike | None = None
    push_m_s: ArrayLike | None = None
    servo_gain_scale: ArrayLike | None = None
    motor_noise_rad_s: ArrayLike | None = None
    seed: ArrayLike | None = None

    def arrays(self, shape: tuple[int, int, int], world: World, touch_gap_m: float
               ) -> dict[str, Array]:
        """
        Return every field as an array that broadcasts to `shape`; the world's value where None.

        Raises
        ------
        ValueError
            If a field does not broadcast to the shape, is not a number, or is out of range.

        """
        defaults = {
            'slip_m_per_n_s': world.slip_m_per_n_s,
            'friction': np.inf if world.friction is None else world.friction,
            'erp': world.erp, 'gravity_m_s2': world.gravity_m_s2, 'base_mass_scale': 1.0,
            'touch_gap_m': touch_gap_m, 'servo_gain_scale': 1.0,
            'servo_speed_scale': 1.0, 'servo_torque_scale': 1.0}
        result = {}
        for field in fields(self):
            if field.name == 'joint_zero_rad':  # has an axis of its own
                continue
            given = getattr(self, field.name)
            result[field.name] = (np.asarray(defaults.get(field.name, 0.0)) if given is None
                                  else checked(field.name, given, shape))
        return result


def checked(name: str, given: ArrayLike, shape: tuple[int, int, int]) -> Array:
    """Return a field as an array that broadcasts to `shape` (ValueError)."""
    value = np.asarray(given, dtype=np.float64)
    try:
        np.broadcast_to(value, shape)
    except ValueError:
        raise ValueError(f'variations: {name} of shape {value.shape} does not '
                         f'broadcast to {shape} (controllers, words, starts)') from None
    low, high = LIMITS.get(name, (-np.inf, np.inf))
    if np.isnan(value).any() or (value < low).any() or (value > high).any():
        raise ValueError(f'variations: {name}: expected numbers from {low} to '
                         f'{high}, got {value.min()} to {value.max()}')
    return value


LIMITS = {
    'slip_m_per_n_s': (0.0, 1e3), 'friction': (0.0, np.inf), 'erp': (0.0, 1.0),
    'gravity_m_s2': (-1e3, 0.0), 'base_mass_scale': (1e-3, 1e3), 'touch_gap_m': (0.0, 0.02),
    'touch_flip_probability': (0.0, 1.0), 'push_m_s': (0.0, 1e3), 'servo_gain_scale': (0.0, 1e3),
    'motor_noise_rad_s': (0.0, 1e3),
    'servo_speed_scale': (1e-3, 1e3), 'servo_torque_scale': (1e-3, 1e3),
    'gyro_noise_rad_s': (0.0, 1e3), 'gravity_noise': (0.0, 1.0),
    'seed': (0.0, 2.0**53), 'height_m': (-1e3, 1e3)}
