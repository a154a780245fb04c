"""
PyBullet: the engine that the `sim` node runs and that champions are judged in.

The `paper` world's viscous, unbounded friction is not PyBullet's, whose friction is Coulomb's. The
closest settings found that never explode are a coefficient of 2 and solver steps of 12.5 ms; the
Dantzig solver agrees as well at 50 ms and throws one robot in three hundreds of metres away.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from math import ceil
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from w2b_core.bodies.model import Body
from w2b_core.bodies.urdf import to_urdf
from w2b_sim.engines import inertial
from w2b_sim.engines.inertial import BaseMotion
from w2b_sim.engines.interface import Frame, Start
from w2b_sim.engines.quiet_pybullet import pybullet
from w2b_sim.engines.servo import Driven, Servos
from w2b_sim.worlds import World

Array = NDArray[np.float64]
Vector = Sequence[float]

#: Coulomb's coefficient where the world asks for unbounded friction.
FRICTION_FOR_UNBOUNDED = 2.0
#: A physics step that is longer is divided: Bullet's contact solver needs small ones.
LONGEST_SOLVER_STEP_S = 0.0125
#: A link this close to the floor touches it: contacts come and go within it while a foot rests.
TOUCH_THRESHOLD_M = 0.002


class PyBulletSimulation:
    """One robot in a PyBullet world of its own, stepped one control period at a time."""

    def __init__(self, body: Body, world: World, start: Start | None = None) -> None:
        self.body = body
        self.world = world
        self._server = pybullet.connect(pybullet.DIRECT)
        self._here = {'physicsClientId': self._server}
        self._touch_links = tuple(sensor.removeprefix('touch:') for sensor in body.sensors
                                  if sensor.startswith('touch:'))
        self._servos = Servos(body.joints)
        self.reset(start or Start())

    @property
    def client_id(self) -> int:
        """PyBullet's number of this world, for cameras and inspection."""
        return int(self._server)

    @property
    def robot(self) -> int:
        """PyBullet's number of the robot."""
        return int(self._robot)

    def close(self) -> None:
        """Leave the physics server; the simulation cannot be used any more."""
        if pybullet.isConnected(**self._here):
            pybullet.disconnect(**self._here)

    def reset(self, start: Start | None = None) -> None:
        """Put the body back to its start pose, at rest, in a world with no memory of the past."""
        start = start or Start()
        world, here = self.world, self._here
        pybullet.resetSimulation(**here)
        pybullet.setGravity(0.0, 0.0, world.gravity_m_s2, **here)
        substeps = ceil(world.physics_step_s / LONGEST_SOLVER_STEP_S - 1e-9)
        # PyBullet divides the last solver step's impulse by the whole physics step. So does its
        # torque limit: with n solver steps servos are n times as strong as they say. In `paper`,
        # where that is so, they hardly ever saturate.
        self._torque_scale = float(substeps)
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=world.physics_step_s, numSubSteps=substeps if substeps > 1 else 0,
            deterministicOverlappingPairs=1, **here)
        friction = FRICTION_FOR_UNBOUNDED if world.friction is None else world.friction
        plane = pybullet.createCollisionShape(pybullet.GEOM_PLANE, **here)
        self._floor = pybullet.createMultiBody(0.0, plane, **here)
        # Bullet multiplies the two coefficients, so the floor's is 1.
        pybullet.changeDynamics(self._floor, -1, lateralFriction=1.0, **here)
        self._robot = self._load(start)
        links = self._link_numbers()
        for number in links.values():
            pybullet.changeDynamics(self._robot, number, lateralFriction=friction,
                                    linearDamping=0.0, angularDamping=0.0,
                                    jointDamping=0.0, **here)
        self._joints = [links[joint.child] for joint in self.body.joints]
        self._touching = [(name, links[name]) for name in self._touch_links]
        self._frame_from_inertial = self._inertial_offset()
        self._torque_nm = self._limited = np.zeros(len(self._joints))
        self._imu = inertial.at_rest(self._motion().turn, world.gravity_m_s2)

    def _load(self, start: Start) -> int:
        height = self.body.height_m + start.height_m
        turn = pybullet.getQuaternionFromEuler([start.roll_rad, start.pitch_rad, start.yaw_rad])
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f'{self.body.name}.urdf'
            path.write_text(to_urdf(self.body, capsule_element=True), encoding='utf-8')
            return int(pybullet.loadURDF(str(path), [0.0, 0.0, height], turn, **self._here,
                                         flags=pybullet.URDF_USE_INERTIA_FROM_FILE))

    def _link_numbers(self) -> dict[str, int]:
        """Map link names to PyBullet's link numbers, which are those of the joints above them."""
        numbers = {self.body.links[0].name: -1}
        for number in range(pybullet.getNumJoints(self._robot, **self._here)):
            info = pybullet.getJointInfo(self._robot, number, **self._here)
            numbers[info[12].decode()] = number
        return numbers

    def _inertial_offset(self) -> tuple[Vector, Vector] | None:
        """
        Return the place and turn of the base's frame in what PyBullet reports, None if the same.

        PyBullet reports the axes of the principal moments of inertia.
        """
        place, turn = pybullet.getDynamicsInfo(self._robot, -1, **self._here)[3:5]
        if not any(place) and turn[3] == 1.0:
            return None
        back: tuple[Vector, Vector] = pybullet.invertTransform(place, turn)
        return back

    def _pose(self) -> tuple[Vector, Vector]:
        """Return place and quaternion x, y, z, w of the base's frame in the world."""
        pose: tuple[Vector, Vector] = pybullet.getBasePositionAndOrientation(
            self._robot, **self._here)
        if self._frame_from_inertial is not None:
            pose = pybullet.multiplyTransforms(*pose, *self._frame_from_inertial)
        return pose

    def _velocity(self) -> tuple[Array, Array]:
        """Return the velocity of the base's origin, and the angular velocity; world frame."""
        velocity, angular = (np.array(part) for part in pybullet.getBaseVelocity(
            self._robot, **self._here))
        if self._frame_from_inertial is not None:
            centre, _turn = pybullet.getBasePositionAndOrientation(self._robot, **self._here)
            velocity += np.cross(angular, np.array(self._pose()[0]) - centre)
        return velocity, angular

    def _motion(self) -> BaseMotion:
        return BaseMotion(inertial.matrix(np.array(self._pose()[1])), self._velocity()[0])

    def observe(self) -> Frame:
        """Return what the sensors and an outside observer see now."""
        position, orientation = self._pose()
        velocity, angular = self._velocity()
        states = pybullet.getJointStates(self._robot, self._joints, **self._here)
        touching = {
            name: bool(pybullet.getClosestPoints(
                self._robot, self._floor, TOUCH_THRESHOLD_M, linkIndexA=number,
                **self._here))
            for name, number in self._touching}
        return Frame(np.array([state[0] for state in states]),
                     np.array([state[1] for state in states]), touching, np.array(position),
                     np.array(orientation), velocity, angular, self._imu, self._torque_nm,
                     self._limited)

    def step(self, targets_rad: Array) -> None:
        """Drive the joints towards `targets_rad` (M,) for one control period."""
        self.advance(targets_rad, self.world.physics_steps)

    def advance(self, targets_rad: Array, physics_steps: int,
                driven: Driven | None = None) -> None:
        """Drive the joints towards `targets_rad` (M,) for so many physics steps."""
        torque, limited = np.zeros(len(self._joints)), np.zeros(len(self._joints))
        before = self._motion()
        forces = self._servos.torques_nm(driven).tolist()
        for number in range(physics_steps):
            states = pybullet.getJointStates(self._robot, self._joints, **self._here)
            angles = np.array([state[0] for state in states])
            if number:
                torque += np.abs([state[3] for state in states])
            speeds = self._servos.speeds_rad_s(targets_rad, angles, driven)
            limited += self._servos.limited(speeds)
            pybullet.setJointMotorControlArray(
                self._robot, self._joints, pybullet.VELOCITY_CONTROL,
                targetVelocities=speeds, forces=forces, **self._here)
            pybullet.stepSimulation(**self._here)
        states = pybullet.getJointStates(self._robot, self._joints, **self._here)
        torque += np.abs([state[3] for state in states])
        self._torque_nm = torque * (self._torque_scale / physics_steps)
        self._limited = limited / physics_steps
        self._imu = inertial.between(before, self._motion(),
                                     physics_steps * self.world.physics_step_s,
                                     self.world.gravity_m_s2)
