"""
Emulated chips on a simulated body: the whole robot, without a robot.

The PCA9685's pulses drive the simulated servos, each through the calibration of the robot that is
emulated; the simulated body moves the registers of the IMU: specific force and rate of turn, with
the noise of its data sheet and a bias of the gyroscope. `emulator PATH --body BODY` serves it as a
process, paced by the clock; under a clock that a test turns it is in lockstep with that.

The physics engine is imported here and nowhere else in this package.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from math import sqrt
from time import monotonic
from typing import Any

import numpy as np
from numpy.typing import NDArray

from w2b_core import bodies
from w2b_hw.calibration import Calibration, nominal
from w2b_hw.emulation.chip_server import ChipServer
from w2b_hw.emulation.lsm6dsox import Lsm6dsox
from w2b_hw.emulation.motion import Vector
from w2b_hw.emulation.robot import EmulatedRobot
from w2b_hw.imu.lsm6dsox_lis3mdl import Lsm6dsoxLis3mdl as Part
from w2b_hw.joints import named
from w2b_hw.targets import FRAME_S
from w2b_sim.engines import registry
from w2b_sim.engines.inertial import matrix
from w2b_sim.engines.interface import Start
from w2b_sim.worlds import WORLDS

Array = NDArray[np.float64]

#: Physics advances in slices of about a sample of the IMU, 104 Hz; pulses take effect at the next
#: one, as they do at the next of the PCA9685's cycles of 20 ms.
SLICE_S = 0.01
#: A process that was stopped for longer does not make up for it.
CATCH_UP_S = 2.0
DEFAULT_ENGINE = 'mujoco'
#: Typical zero-rate level of the LSM6DSOX after soldering, of each axis.
DEFAULT_GYRO_BIAS_RAD_S: Vector = (0.01, -0.008, 0.01)
_NORTH_AND_DOWN_T = np.array([22e-6, 0.0, -43e-6])


class SimulatedBody:
    """
    The body that emulated chips sit on.

    Parameters
    ----------
    chips
        Their pulses move the body; its motion is what their IMU feels.
    body, engine
        Names, of `w2b_core.bodies` and of `w2b_sim.engines.registry`.
    calibration
        What a pulse turns each servo to, in truth; None for the nominal robot.
    gyro_bias_rad_s, noise, seed
        Of the IMU.
    clock
        Seconds; `catch_up` brings the body to it.
    start
        The pose at the beginning.

    Raises
    ------
    ValueError
        If there is no such body or engine, or the body has no servos with these names.

    """

    def __init__(self, chips: EmulatedRobot, *, body: str = 'physical_twin',
                 engine: str = DEFAULT_ENGINE, calibration: Calibration | None = None,
                 gyro_bias_rad_s: Vector = DEFAULT_GYRO_BIAS_RAD_S, noise: bool = True,
                 seed: int = 0, clock: Callable[[], float] = monotonic,
                 start: Start | None = None) -> None:
        self.body = bodies.get(body)
        self._world = WORLDS[self.body.world]
        robot = calibration or nominal(joints=named(body))
        servos = {servo.joint: servo for servo in robot.servos}
        missing = [joint.name for joint in self.body.joints if joint.name not in servos]
        if missing:
            raise ValueError(f'{body}: expected servos of the joints {", ".join(servos)}, '
                             f'got a body with {missing[0]}')
        self._servos = [servos[joint.name] for joint in self.body.joints]
        self.simulation = registry.make_simulation(engine, self.body, self._world, start)
        self._chips = chips
        self._bias = np.array(gyro_bias_rad_s)
        # Of a slice: that of a frame's mean is the part's.
        self._sigmas = np.sqrt([Part.acceleration_variance, Part.angular_velocity_variance]) * (
            noise * sqrt(FRAME_S / SLICE_S))
        self._rng = np.random.default_rng(seed)
        self._clock = clock
        self._steps = max(1, round(SLICE_S / self._world.physics_step_s))
        self._slice_s = self._steps * self._world.physics_step_s
        self._done_s = clock()
        #: Simulated seconds so far.
        self.time_s = 0.0
        self._targets = np.zeros(len(self._servos))
        # The parts take their samples by the body's time, each of the slice that it falls into.
        chips.motion.clock = lambda: self._done_s
        self._move_imu()

    def catch_up(self) -> None:
        """Bring the body to the clock's time, under the pulses there are."""
        now_s = self._clock()
        self._done_s = max(self._done_s, now_s - CATCH_UP_S)
        while self._done_s + self._slice_s <= now_s + 1e-9:
            self._advance()

    def _advance(self) -> None:
        pulses = self._chips.pca9685.pulses_us()
        driven = np.array([pulses[servo.channel] > 0 for servo in self._servos])
        self._targets = np.array([
            servo.angle_rad(pulses[servo.channel]) if pulses[servo.channel] else before
            for servo, before in zip(self._servos, self._targets, strict=True)])
        self.simulation.advance(self._targets, self._steps, driven)
        self.time_s += self._slice_s
        self._done_s += self._slice_s
        self._move_imu()

    def _move_imu(self) -> None:
        frame, motion = self.simulation.observe(), self._chips.motion
        motion.acceleration_m_s2 = self._noisy(frame.imu.specific_force_m_s2, self._sigmas[0])
        motion.angular_velocity_rad_s = self._noisy(
            frame.imu.angular_velocity_rad_s + self._bias, self._sigmas[1])
        motion.field_t = _vector(matrix(frame.orientation_xyzw).T @ _NORTH_AND_DOWN_T)
        for chip in self._chips.imu_chips:
            if isinstance(chip, Lsm6dsox):
                chip.take_samples()

    def _noisy(self, values: Array, sigma: float) -> Vector:
        return _vector(values + self._rng.normal(size=3) * sigma)

    def seen(self) -> dict[str, Any]:
        """Return where the body is, as an outside observer sees it: plain JSON values."""
        frame = self.simulation.observe()
        return {'time_s': self.time_s, 'position_m': frame.position_m.tolist(),
                'orientation_xyzw': frame.orientation_xyzw.tolist(),
                'joint_position_rad': frame.joint_position_rad.tolist(),
                'joint_torque_nm': frame.joint_torque_nm.tolist()}


class CoupledServer(ChipServer):
    """
    `ChipServer` with a body; one transfer at a time, each after the body has caught up.

    In lockstep the time is what clients tell with their requests, as `"clock"`.

    Beside its requests `{"body": true}` says where the body is, `{"imu": false}` unplugs the IMU
    and `{"imu": true}` plugs it in again.
    """

    def __init__(self, path: str, imu: str = 'lsm6dsox', *, lockstep: bool = False,
                 **options: Any) -> None:
        self._told_s = 0.0
        self._lockstep = lockstep
        clock = self._told if lockstep else monotonic
        super().__init__(path, imu, clock)
        self.body = SimulatedBody(self.robot, clock=clock, **options)
        self._unplugged: list[Any] = []

    def _told(self) -> float:
        return self._told_s

    def serve(self) -> None:
        """Answer clients until the process ends; the body moves on between their transfers."""
        if not self._lockstep:
            threading.Thread(target=self._keep_up, daemon=True).start()
        super().serve()

    def _keep_up(self) -> None:
        never = threading.Event()
        while not never.wait(SLICE_S):
            with self._lock:
                self.body.catch_up()

    def _answer(self, request: dict[str, Any]) -> dict[str, Any]:
        self._told_s = max(self._told_s, float(request.get('clock', 0.0)))
        self.body.catch_up()
        if 'body' in request:
            return {'body': self.body.seen()}
        if 'imu' in request:
            self._plug(bool(request['imu']))
            return {'imu': request['imu']}
        return super()._answer(request)

    def _plug(self, plugged: bool) -> None:
        wire = self.robot.wire
        if plugged:
            wire.chips += self._unplugged
            self._unplugged = []
        else:
            self._unplugged += [chip for chip in wire.chips if chip is not self.robot.pca9685]
            wire.chips = [self.robot.pca9685]


def _vector(values: Array) -> Vector:
    x, y, z = (float(value) for value in values)
    return x, y, z
