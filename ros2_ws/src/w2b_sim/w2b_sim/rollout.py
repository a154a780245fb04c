"""One evaluation, without ROS: a controller hears a word and moves a body for the world's time."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from w2b_core import senses
from w2b_core.bodies.model import Body
from w2b_core.network import Network, prime, step
from w2b_core.senses import Readings
from w2b_sim.engines.interface import Frame, Simulation
from w2b_sim.recording import Recording
from w2b_sim.walking import recording_of
from w2b_sim.worlds import PAPER

Array = NDArray[np.float64]


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
            on_frame: Callable[[int, Frame], None] | None = None, *,
            period_s: float = PAPER.control_period_s) -> Recording:
    """
    Return the recording of one controller under one word, from the pose the simulation is in.

    Parameters
    ----------
    simulation, body, network
        What moves, and what moves it.
    signal: shape (T,)
        Of the word, or of several, one after the other.
    steps
        Number of frames. Nothing moves after the last, as in the original program.
    on_frame
        Called with each frame's number and the frame, for cameras.
    period_s
        The control period of the simulation's world.

    """
    state = prime(network, signal)
    frames: list[Frame] = []
    targets: list[Array] = []
    for number in range(steps):
        frame = simulation.observe()
        frames.append(frame)
        targets.append(targets_rad(body, state.motors))
        if on_frame is not None:
            on_frame(number, frame)
        if number == steps - 1:
            break
        state = step(network, state, sensor_values(body, frame, state.motors))
        simulation.step(targets[-1])
    return recording_of(frames, targets, period_s)
