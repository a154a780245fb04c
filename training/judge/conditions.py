"""What the judge lets a controller walk under: worlds, bodies and flaws, drawn for each start."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import radians

import numpy as np
from numpy.typing import NDArray

from training.evolution.starts import slightly_different
from w2b_core.bodies.model import Body, Link
from w2b_sim.engines.interface import Start
from w2b_sim.walking import Flaws
from w2b_sim.worlds import World

Array = NDArray[np.float64]

#: What `--hard` draws from: both ends of what the twin's champion has to bear.
HARD_FRICTION, HARD_MASS, HARD_SERVO = (0.4, 1.0), (0.8, 1.2), (0.8, 1.0)
HARD_ZEROS_RAD, HARD_BIAS_RAD_S = radians(5.0), 0.01


@dataclass(frozen=True)
class Conditions:
    """
    Of all starts.

    Attributes
    ----------
    friction
        Coulomb's coefficient; None for the world's.
    late
        Targets act one control period late.
    zeros_rad
        Servo zeros are off by up to so much, each joint's and start's its own.
    mass, servo
        Factors of all masses, and of the servos' speed and torque.
    imu_noise
        The attitude comes from a simulated IMU through the robot's own filter.
    gyro_bias_rad_s
        Of each axis of that IMU; it too means a simulated IMU.
    no_imu
        The attitude is not known at all.
    hard
        All of these together: what is not given is drawn for each start.
    seed
        Of all that is drawn.

    Raises
    ------
    ValueError
        If a number is outside what makes sense, or options contradict each other.

    """

    friction: float | None = None
    late: bool = False
    zeros_rad: float = 0.0
    mass: float = 1.0
    servo: float = 1.0
    imu_noise: bool = False
    gyro_bias_rad_s: float = 0.0
    no_imu: bool = False
    hard: bool = False
    seed: int = 0

    def __post_init__(self) -> None:
        """Check the ranges (ValueError)."""
        for name, value, low, high in (
                ('friction', 1.0 if self.friction is None else self.friction, 0.0, 10.0),
                ('zeros-off', self.zeros_rad, 0.0, 1.0), ('mass', self.mass, 0.1, 10.0),
                ('servo', self.servo, 0.1, 10.0),
                ('gyro-bias', abs(self.gyro_bias_rad_s), 0.0, 1.0)):
            if not low <= value <= high:
                raise ValueError(f'--{name}: expected {low:g} to {high:g}, got {value}')
        if self.no_imu and (self.imu_noise or self.gyro_bias_rad_s):
            raise ValueError('--no-imu: expected no --imu-noise and no --gyro-bias beside it')

    @property
    def simulated_imu(self) -> bool:
        """Whether the attitude comes from a simulated IMU."""
        return (self.imu_noise or self.gyro_bias_rad_s != 0 or self.hard) and not self.no_imu


@dataclass(frozen=True)
class Trial:
    """One start with its world, body and flaws; `imu_seed` is of the simulated IMU."""

    start: Start
    body: Body
    world: World
    flaws: Flaws
    gyro_bias_rad_s: tuple[float, float, float]
    imu_seed: int


def trials(body: Body, world: World, conditions: Conditions, count: int) -> list[Trial]:
    """Return `count` trials; those of the same seed begin alike, however many there are."""
    return [_trial(body, world, conditions, np.random.default_rng([conditions.seed, number]))
            for number in range(count)]


def _trial(body: Body, world: World, given: Conditions, rng: np.random.Generator) -> Trial:
    start = slightly_different(rng, 1)[0]
    directions = rng.uniform(-1.0, 1.0, len(body.joints))
    signs = rng.choice((-1.0, 1.0), 3)
    drawn = [float(rng.choice(choices)) for choices in (HARD_FRICTION, HARD_MASS, HARD_SERVO)]
    friction, mass, servo = given.friction, given.mass, given.servo
    zeros_rad, bias = given.zeros_rad, given.gyro_bias_rad_s
    if given.hard:
        friction = drawn[0] if friction is None else friction
        mass, servo = mass if mass != 1.0 else drawn[1], servo if servo != 1.0 else drawn[2]
        zeros_rad, bias = zeros_rad or HARD_ZEROS_RAD, bias or HARD_BIAS_RAD_S
    x, y, z = (float(sign * bias) for sign in signs)
    return Trial(start, changed(body, mass, servo),
                 world if friction is None else replace(world, friction=friction),
                 Flaws(given.late or given.hard, directions * zeros_rad if zeros_rad else None),
                 (x, y, z), int(rng.integers(2**31)))


def changed(body: Body, mass: float, servo: float) -> Body:
    """Return a body with all masses, and all servos' speed and torque, times a factor."""
    if mass == servo == 1.0:
        return body
    return replace(body, links=tuple(_heavier(link, mass) for link in body.links), joints=tuple(
        replace(joint, servo=replace(
            joint.servo, max_speed_up_rad_s=joint.servo.max_speed_up_rad_s * servo,
            max_speed_down_rad_s=joint.servo.max_speed_down_rad_s * servo,
            max_torque_nm=joint.servo.max_torque_nm * servo)) for joint in body.joints))


def _heavier(link: Link, factor: float) -> Link:
    tensor = link.inertia_kg_m2
    if tensor is not None:
        a, b, c = ((x * factor, y * factor, z * factor) for x, y, z in tensor)
        tensor = (a, b, c)
    return replace(link, mass_kg=link.mass_kg * factor, inertia_kg_m2=tensor)
