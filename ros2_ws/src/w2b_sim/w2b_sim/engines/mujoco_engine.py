"""
MuJoCo: the second engine that the `sim` node runs, and the second judge of champions.

It shares the body's description and the servo law with PyBullet, and nothing else: its contacts
are soft where PyBullet's are impulses. A gait has to walk in both.

A servo is a motor constraint of limited torque. MuJoCo has none; a joint's dry friction is one
whose velocity to hold is 0, so its reference acceleration is replaced, in every step, by the one
that leads to the velocity that the servo steers for.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from w2b_core.bodies.model import Body
from w2b_core.bodies.turning import from_rpy, quaternion_wxyz
from w2b_sim.engines import inertial
from w2b_sim.engines.inertial import BaseMotion
from w2b_sim.engines.interface import Frame, Start
from w2b_sim.engines.mujoco_model import moves, substeps, to_mjcf
from w2b_sim.engines.servo import Driven, Servos
from w2b_sim.worlds import World

Array = NDArray[np.float64]


class MuJoCoSimulation:
    """
    One robot in a MuJoCo world of its own, stepped one control period at a time.

    Raises
    ------
    ValueError
        If MuJoCo cannot make a model of the body.

    """

    def __init__(self, body: Body, world: World, start: Start | None = None) -> None:
        self.body = body
        self.world = world
        try:
            self.model: Any = mujoco.MjModel.from_xml_string(to_mjcf(body, world))
        except ValueError as error:
            raise ValueError(f'{body.name}: MuJoCo makes no model of it: {error}') from error
        self.data: Any = mujoco.MjData(self.model)
        self._servos = Servos(body.joints)
        self._moving = np.array([moves(joint) for joint in body.joints], dtype=bool)
        joints = [self.model.joint(joint.name) for joint in body.joints if moves(joint)]
        self._angle = np.array([joint.qposadr[0] for joint in joints], dtype=int)
        self._rate = np.array([joint.dofadr[0] for joint in joints], dtype=int)
        # Rows of dry friction are in the order of MuJoCo's degrees of freedom.
        self._row = np.argsort(np.argsort(self._rate))
        self._substeps = substeps(world)
        self._step_s = world.physics_step_s / self._substeps
        self._touch_links = {
            self.model.body(sensor.removeprefix('touch:')).id: sensor.removeprefix('touch:')
            for sensor in body.sensors if sensor.startswith('touch:')}
        self.reset(start or Start())

    def close(self) -> None:
        """Nothing to release: MuJoCo's memory goes with the object."""

    def reset(self, start: Start | None = None) -> None:
        """Put the body back to its start pose, at rest, in a world with no memory of the past."""
        start = start or Start()
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[2] = self.body.height_m + start.height_m
        self.data.qpos[3:7] = quaternion_wxyz(
            from_rpy((start.roll_rad, start.pitch_rad, start.yaw_rad)))
        mujoco.mj_forward(self.model, self.data)
        self._torque_nm = self._limited = np.zeros(len(self.body.joints))
        self._imu = inertial.at_rest(self._motion().turn, self.world.gravity_m_s2)

    def _motion(self) -> BaseMotion:
        w, x, y, z = self.data.qpos[3:7]
        return BaseMotion(inertial.matrix(np.array([x, y, z, w])), self.data.qvel[:3].copy())

    def _angles(self) -> Array:
        angles = np.zeros(len(self._moving))
        angles[self._moving] = self.data.qpos[self._angle]
        return angles

    def _touching(self) -> dict[str, bool]:
        touching = dict.fromkeys(self._touch_links.values(), False)
        for pair in self.data.contact.geom[:self.data.ncon]:
            for geom in pair:
                name = self._touch_links.get(int(self.model.geom_bodyid[geom]))
                if name is not None:
                    touching[name] = True
        return touching

    def observe(self) -> Frame:
        """Return what the sensors and an outside observer see now."""
        data = self.data
        rates = np.zeros(len(self._moving))
        rates[self._moving] = data.qvel[self._rate]
        w, x, y, z = data.qpos[3:7]
        orientation = np.array([x, y, z, w])
        return Frame(self._angles(), rates, self._touching(), data.qpos[:3].copy(), orientation,
                     data.qvel[:3].copy(), inertial.matrix(orientation) @ data.qvel[3:6],
                     self._imu, self._torque_nm, self._limited)

    def step(self, targets_rad: Array) -> None:
        """Drive the joints towards `targets_rad` (M,) for one control period."""
        self.advance(targets_rad, self.world.physics_steps)

    def advance(self, targets_rad: Array, physics_steps: int,
                driven: Driven | None = None) -> None:
        """Drive the joints towards `targets_rad` (M,) for so many of the world's physics steps."""
        targets = np.asarray(targets_rad, dtype=np.float64)
        model, data, moving = self.model, self.data, self._moving
        torque, limited = np.zeros(int(moving.sum())), np.zeros(len(moving))
        before = self._motion()
        model.dof_frictionloss[self._rate] = self._servos.torques_nm(driven)[moving]
        for _ in range(physics_steps):
            speeds = self._servos.speeds_rad_s(targets, self._angles(), driven)
            limited += self._servos.limited(speeds)
            speeds = speeds[moving]
            for _ in range(self._substeps):
                mujoco.mj_step1(model, data)
                rows = data.ne + self._row
                data.efc_aref[rows] = (speeds - data.qvel[self._rate]) / self._step_s
                mujoco.mj_step2(model, data)
                torque += np.abs(data.efc_force[rows])
        self._torque_nm = np.zeros(len(moving))
        self._torque_nm[moving] = torque / (physics_steps * self._substeps)
        self._limited = limited / physics_steps
        self._imu = inertial.between(before, self._motion(),
                                     physics_steps * self.world.physics_step_s,
                                     self.world.gravity_m_s2)
        # Contacts where the body is now, not where it was before the last step.
        mujoco.mj_fwdPosition(model, data)
