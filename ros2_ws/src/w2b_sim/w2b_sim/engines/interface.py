"""The one interface of all engines: a step-wise simulation of one robot, and batched evaluation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from w2b_core.network import Network
from w2b_core.outcome import Outcome
from w2b_sim.engines.inertial import Inertial
from w2b_sim.engines.servo import Driven

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Start:
    """How a start differs from the body's nominal one: raised by, and tilted about x, y, z."""

    height_m: float = 0.0
    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    yaw_rad: float = 0.0


@dataclass(frozen=True)
class Frame:
    """
    What can be sensed of one robot before a physics step.

    `joint_position_rad` and `joint_velocity_rad_s` (M,) in motor order; `touching` maps the links
    that carry a touch sensor to whether they touch the floor; the base's pose and velocity are in
    the world frame, the quaternion is x, y, z, w. `imu` is what an IMU in the base feels. Of
    each servo since the last frame: `joint_torque_nm` (M,) the mean of the absolute torque,
    `joint_limited` (M,) the share of time at its greatest speed.
    """

    joint_position_rad: Array
    joint_velocity_rad_s: Array
    touching: dict[str, bool]
    position_m: Array
    orientation_xyzw: Array
    velocity_m_s: Array
    angular_velocity_rad_s: Array
    imu: Inertial = field(default_factory=lambda: Inertial(np.array([0.0, 0.0, 9.81]), np.zeros(3)))
    joint_torque_nm: Array = field(default_factory=lambda: np.zeros(0))
    joint_limited: Array = field(default_factory=lambda: np.zeros(0))


class Simulation(Protocol):
    """One robot, one control period at a time."""

    def reset(self, start: Start = ...) -> None:
        """Put the body back to its start pose, at rest."""

    def observe(self) -> Frame:
        """Return what the sensors and an outside observer see now."""

    def step(self, targets_rad: Array) -> None:
        """Drive the joints towards `targets_rad` (M,) for one control period."""

    def advance(self, targets_rad: Array, physics_steps: int,
                driven: Driven | None = None) -> None:
        """
        Drive the joints towards `targets_rad` (M,) for so many of the world's physics steps.

        Joints that are not `driven` (M,) have servos without pulses: they only resist.
        """

    def close(self) -> None:
        """Release what the engine holds; the simulation cannot be used any more."""


#: What an engine returns.
Evaluation = Outcome


class Evaluator(Protocol):
    """Evaluates many controllers at once, each from rest, for the world's number of steps."""

    def evaluate(self, network: Network, signals: Array, starts: Sequence[Start]) -> Evaluation:
        """Return the outcome of `network` (C controllers) under `signals` (W, T) or (C, W, T)."""
