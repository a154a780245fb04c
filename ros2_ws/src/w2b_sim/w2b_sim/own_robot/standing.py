"""Whether a robot stands: 5 s in an engine, and which of its links run into each other."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from math import acos, degrees
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from w2b_core.bodies.model import Body
from w2b_core.bodies.urdf import to_urdf
from w2b_sim.engines.inertial import matrix
from w2b_sim.engines.registry import make_simulation
from w2b_sim.worlds import WORLDS

Array = NDArray[np.float64]
SECONDS = 5.0
#: After so long the robot has come down on its feet.
SETTLED_S = 1.0
#: More than this is no standing: of its height, of a length, of a right angle.
SINKS_SHARE, CREEPS_M, TILTS_DEG = 0.1, 0.005, 5.0
#: Poses within the swing that are looked at for links that run into each other.
POSES = 200
#: Links overlap if they do by more than this: neighbours of a leg may touch.
OVERLAP_M = 0.001


@dataclass(frozen=True)
class Standing:
    """How far a robot sank from its start, crept after it settled, and tilted."""

    engine: str
    sinks_m: float
    creeps_m: float
    tilt_deg: float
    height_m: float

    @property
    def problem(self) -> str:
        """Why that is no standing; '' if it is."""
        if self.tilt_deg > TILTS_DEG:
            return f'tilts by {self.tilt_deg:.0f} degrees'
        if self.sinks_m > SINKS_SHARE * self.height_m:
            return f'sinks by {1000 * self.sinks_m:.0f} of {1000 * self.height_m:.0f} mm'
        if self.creeps_m > CREEPS_M:
            return f'creeps by {1000 * self.creeps_m:.0f} mm in {SECONDS - SETTLED_S:.0f} s'
        return ''

    def __str__(self) -> str:
        """Return one line."""
        return (f'{self.engine}: sinks {1000 * self.sinks_m:.1f} mm, creeps '
                f'{1000 * self.creeps_m:.1f} mm, tilts {self.tilt_deg:.1f} degrees')


def stand(body: Body, engine: str) -> Standing:
    """Let a body stand at its stance for `SECONDS`, all joints driven to 0."""
    world = WORLDS[body.world]
    simulation = make_simulation(engine, body, world)
    try:
        still = np.zeros(len(body.joints))
        settled = None
        for number in range(round(SECONDS / world.control_period_s)):
            simulation.step(still)
            if settled is None and (number + 1) * world.control_period_s >= SETTLED_S - 1e-9:
                settled = simulation.observe().position_m
        frame = simulation.observe()
    finally:
        simulation.close()
    assert settled is not None
    up = float(matrix(frame.orientation_xyzw)[2, 2])
    return Standing(engine, float(body.height_m - frame.position_m[2]),
                    float(np.linalg.norm(frame.position_m[:2] - settled[:2])),
                    degrees(acos(max(-1.0, min(1.0, up)))), body.height_m)


def overlaps(body: Body, poses: int = POSES) -> tuple[list[str], list[str]]:
    """
    Return pairs of links that run into each other at the stance, and within the swing.

    Neighbours, and links that do so at the stance, are not looked at within the swing. Needs
    PyBullet.
    """
    from w2b_sim.engines.quiet_pybullet import pybullet

    server = pybullet.connect(pybullet.DIRECT)
    try:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / 'robot.urdf'
            path.write_text(to_urdf(body, capsule_element=True), encoding='utf-8')
            robot = pybullet.loadURDF(str(path), physicsClientId=server)
        numbers = {body.links[0].name: -1}
        joints = {}
        for number in range(pybullet.getNumJoints(robot, physicsClientId=server)):
            info = pybullet.getJointInfo(robot, number, physicsClientId=server)
            numbers[info[12].decode()], joints[info[1].decode()] = number, number
        near = {frozenset((joint.parent, joint.child)) for joint in body.joints}
        pairs = [(first.name, second.name) for index, first in enumerate(body.links)
                 for second in body.links[index + 1:]
                 if frozenset((first.name, second.name)) not in near]

        def met(first: str, second: str) -> bool:
            found = pybullet.getClosestPoints(robot, robot, 0.0, numbers[first], numbers[second],
                                              physicsClientId=server)
            return any(point[8] < -OVERLAP_M for point in found)

        standing = [pair for pair in pairs if met(*pair)]
        random = np.random.default_rng(0)
        swinging: list[tuple[str, str]] = []
        left = [pair for pair in pairs if pair not in standing]
        for _pose in range(poses):
            for joint in body.joints:
                pybullet.resetJointState(
                    robot, joints[joint.name], random.uniform(joint.lower_rad, joint.upper_rad),
                    physicsClientId=server)
            now = [pair for pair in left if met(*pair)]
            swinging += now
            left = [pair for pair in left if pair not in now]
    finally:
        pybullet.disconnect(server)
    return ([' and '.join(pair) for pair in standing], [' and '.join(pair) for pair in swinging])
