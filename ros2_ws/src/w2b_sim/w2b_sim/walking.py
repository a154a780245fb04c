"""A controller of either kind moves a body step by step, without ROS, and all is recorded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from w2b_core.bodies.model import Body
from w2b_core.controller.model import Controller
from w2b_core.hearing.heard import Heard
from w2b_core.mind import mind_of
from w2b_core.senses import Readings, gravity_in, heading_of
from w2b_sim.engines.interface import Frame, Simulation
from w2b_sim.recording import Recording

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Phase:
    """So many frames under a command; None: the robot stands as before its first one."""

    heard: Heard | None
    frames: int


class Imu(Protocol):
    """What a robot knows of its attitude."""

    def attitude(self, frame: Frame) -> tuple[Array, float]:
        """Return the orientation x, y, z, w, and the rate of turn about the base's z axis."""


class ExactImu:
    """Knows it exactly."""

    def attitude(self, frame: Frame) -> tuple[Array, float]:
        """See `Imu`."""
        return frame.orientation_xyzw, float(frame.imu.angular_velocity_rad_s[2])


class NoImu:
    """Knows nothing: always level, at the same heading."""

    def attitude(self, frame: Frame) -> tuple[Array, float]:
        """See `Imu`."""
        return np.array([0.0, 0.0, 0.0, 1.0]), 0.0


@dataclass(frozen=True)
class Flaws:
    """
    What is not as the controller was evolved for, between its targets and the servos.

    `late`: targets act one control period after the frame that they answer. `zeros_rad` (M,), in
    the body's order: how far each servo's zero is off.
    """

    late: bool = False
    zeros_rad: Array | None = None


def readings_of(frame: Frame, joints: Sequence[str], imu: Imu) -> Readings:
    """Return what the senses read of a frame."""
    attitude, yaw_rate = imu.attitude(frame)
    orientation = [float(value) for value in attitude]
    return Readings({link: float(touch) for link, touch in frame.touching.items()},
                    dict(zip(joints, map(float, frame.joint_position_rad), strict=True)), {},
                    heading_of(orientation), yaw_rate, gravity_in(orientation))


def walk(simulation: Simulation, body: Body, controller: Controller, phases: Sequence[Phase], *,
         period_s: float, imu: Imu | None = None, flaws: Flaws | None = None) -> Recording:
    """
    Return the recording of a walk, from the pose the simulation is in.

    It has one frame more than all phases together; nothing moves after the last.

    Parameters
    ----------
    simulation, body
        What moves, and what it moves.
    controller
        Of this body.
    phases
        Commands one after the other.
    period_s
        The control period of the simulation's world.
    imu
        What the attitude senses read; None for `ExactImu`.
    flaws
        None for none.

    Raises
    ------
    ValueError
        If the controller is of other joints, or a command none of its network.

    """
    joints = [joint.name for joint in body.joints]
    if sorted(joints) != sorted(controller.joints):
        raise ValueError(f'{body.name}: expected a controller of its joints {", ".join(joints)}, '
                         f'got one of {", ".join(controller.joints)}')
    order = [controller.joints.index(joint) for joint in joints]
    imu, flaws = imu or ExactImu(), flaws or Flaws()
    zeros = np.zeros(len(joints)) if flaws.zeros_rad is None else flaws.zeros_rad
    mind = mind_of(controller)
    frames: list[Frame] = []
    targets: list[Array] = []
    for phase in phases:
        if phase.heard is not None:
            mind.hear(phase.heard)
        else:
            mind.forget()
        for _ in range(phase.frames):
            frames.append(simulation.observe())
            asked = controller.targets_rad(mind.motors)[order] + zeros
            mind.feel(readings_of(frames[-1], joints, imu))
            targets.append(asked)
            simulation.step(targets[-2] if flaws.late and len(targets) > 1 else asked)
    frames.append(simulation.observe())
    targets.append(controller.targets_rad(mind.motors)[order] + zeros)
    return recording_of(frames, targets, period_s)


def recording_of(frames: Sequence[Frame], targets: Sequence[Array], period_s: float) -> Recording:
    """Return T frames, and the targets (M,) sent after each, as a recording."""
    xyzw = np.array([frame.orientation_xyzw for frame in frames])
    return Recording(
        period_s=period_s,
        position_m=np.array([frame.position_m for frame in frames]),
        orientation_wxyz=xyzw[:, [3, 0, 1, 2]],
        yaw_rate_rad_s=np.array([frame.imu.angular_velocity_rad_s[2] for frame in frames]),
        joint_position_rad=np.array([frame.joint_position_rad for frame in frames]),
        target_rad=np.array(targets),
        touching=np.array([[float(touch) for touch in frame.touching.values()]
                           for frame in frames]),
        torque_nm=np.array([frame.joint_torque_nm for frame in frames]),
        limited=np.array([frame.joint_limited for frame in frames]))
