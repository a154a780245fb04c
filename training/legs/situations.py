"""Draw the situations that every candidate of a generation meets."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from training.legs.parts import Worlds
from w2b_sim.engines.batched.leaky_variations import LeakyVariations
from w2b_sim.worlds import World

Array = NDArray[np.float64]

#: Ranges about 1: what is nominal where they are not drawn.
SCALES = ('base_mass_scale', 'servo_gain_scale', 'servo_speed_scale', 'servo_torque_scale')


def draw(worlds: Worlds, world: World, joints: int, count: int, rng: np.random.Generator, *,
         touch: bool = False) -> LeakyVariations:
    """
    Return `count` situations, drawn from `rng`: what differs is the same for all candidates.

    `touch` says whether the body feels its feet.
    """
    hard = rng.random(count) < worlds.hard

    def some() -> NDArray[np.bool_]:
        return hard | (rng.random(count) < worlds.probability)

    def within(bounds: tuple[float, float], nominal: float) -> Array:
        return np.where(some(), rng.uniform(*bounds, count), nominal)

    def about(bound: float) -> Array:
        return rng.uniform(-bound, bound, count) * some()

    fields: dict[str, Array] = {name: within(getattr(worlds, name), 1.0) for name in SCALES}
    if world.friction is not None:
        fields['friction'] = within(worlds.friction, world.friction)
    if worlds.slip_m_per_n_s is not None:
        fields['slip_m_per_n_s'] = rng.uniform(*worlds.slip_m_per_n_s, count)
    fields['gravity_m_s2'] = world.gravity_m_s2 * within(worlds.gravity_scale, 1.0)
    fields['command_late'] = (rng.random(count) < worlds.command_late).astype(float)
    fields['motor_noise_rad_s'] = within(worlds.motor_noise_rad_s, 0.0)
    fields['push_m_s'] = within(worlds.push_m_s, 0.0)
    fields['heading_offset_rad'] = about(worlds.heading_offset_rad)
    fields['gyro_bias_rad_s'] = rng.normal(scale=worlds.gyro_bias_rad_s, size=count)
    fields['gyro_noise_rad_s'] = np.full(count, worlds.gyro_noise_rad_s)
    fields['gravity_noise'] = np.full(count, worlds.gravity_noise)
    fields['height_m'] = rng.uniform(*worlds.height_m, count)
    for name in ('roll_rad', 'pitch_rad', 'yaw_rad'):
        fields[name] = rng.uniform(-worlds.tilt_rad, worlds.tilt_rad, count)
    if touch:
        fields['touch_flip_probability'] = within(worlds.touch_flip_probability, 0.0)
        if worlds.touch_gap_m is not None:
            fields['touch_gap_m'] = rng.uniform(*worlds.touch_gap_m, count)
        fields['touch_delay'] = (rng.random(count) < worlds.command_late).astype(float)
    zeros = rng.uniform(-worlds.joint_zero_rad, worlds.joint_zero_rad, (count, joints))
    fields['seed'] = rng.integers(0, 2**31, count).astype(float)
    return LeakyVariations(joint_zero_rad=zeros * some()[:, None], **fields)
