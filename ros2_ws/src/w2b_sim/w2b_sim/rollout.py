"""One evaluation, without ROS: a controller hears a word and moves a body for the world's time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from w2b_core import senses
from w2b_core.bodies.model import Body
from w2b_core.network import Network, prime, step
from w2b_core.senses import Readings
from w2b_sim.engines.interface import Frame, Simulation

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Rollout:
    """
    What was logged at each of T sensor frames, before the world moved.

    Attributes
    ----------
    position_m: shape (T, 3)
        Of the base.
    joint_position_rad: shape (T, M)
    touching: shape (T, S)
        One column a touch-sensitive link, in the order of the body's sensors.

    """

    position_m: Array
    joint_position_rad: Array
    touching: Array

    @property
    def path_length_m(self) -> float:
        """Length of the path in x-y."""
        return float(self._steps_m().sum())

    @property
    def largest_step_m(self) -> float:
        """Longest displacement in x-y between two frames."""
        return float(self._steps_m().max(initial=0.0))

    def _steps_m(self) -> Array:
        steps: Array = np.linalg.norm(np.diff(self.position_m[:, :2], axis=0), axis=1)
        return steps


def targets_rad(body: Body, motors: Array) -> Array:
    """Return the joint targets (M,) of motor neurons (M,): -1 and 1 mean the joint's limits."""
    lower = np.array([joint.lower_rad for joint in body.joints])
    upper = np.array([joint.upper_rad for joint in body.joints])
    targets: Array = lower + (motors + 1) / 2 * (upper - lower)
    return targets


def sensor_values(body: Body, frame: Frame, motors: Array) -> Array:
    """Return the sensor neurons' values (S,) of a body in its network's order."""
    joints = [joint.name for joint in body.joints]
    return senses.read(body.sensors, Readings(
        frame.touching, dict(zip(joints, frame.joint_position_rad, strict=True)),
        dict(zip(joints, motors, strict=True))))


def rollout(simulation: Simulation, body: Body, network: Network, signal: ArrayLike, steps: int,
            on_frame: Callable[[int, Frame], None] | None = None) -> Rollout:
    """
    Run one controller under one word's `signal` (T,), from the pose the simulation is in.

    `on_frame` is called with each frame's number and the frame, for cameras. The last frame is
    logged and nothing moves after it, as in the original program.
    """
    state = prime(network, signal)
    positions, angles, touches = [], [], []
    for number in range(steps):
        frame = simulation.observe()
        positions.append(frame.position_m)
        angles.append(frame.joint_position_rad)
        touches.append([float(touch) for touch in frame.touching.values()])
        if on_frame is not None:
            on_frame(number, frame)
        if number == steps - 1:
            break
        targets = targets_rad(body, state.motors)
        state = step(network, state, sensor_values(body, frame, state.motors))
        simulation.step(targets)
    return Rollout(np.array(positions), np.array(angles), np.array(touches))
