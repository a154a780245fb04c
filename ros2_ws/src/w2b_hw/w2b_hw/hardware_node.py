"""
The lifecycle node `hardware`: joint targets in, sensor frames out, servos and IMU on the bus.

It takes what the simulation takes and gives what it gives, so that the brain runs unchanged.
Nothing is driven until `~/arm` is called (or `auto_arm` is set), with a calibration that fits and
targets that are fresh.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from sensor_msgs.msg import BatteryState
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory

from w2b_core.body_status import FRESH_PERIODS, BodyStatus
from w2b_core.status import Level, Status
from w2b_hw import calibration, joints, messages
from w2b_hw.clocks import Clock, SteppedClock, WallClock
from w2b_hw.frame_publisher import FramePublisher
from w2b_hw.gait_scale import GaitScale
from w2b_hw.guard import Guard
from w2b_hw.imu import registry
from w2b_hw.imu.part import ImuError, Part
from w2b_hw.io_thread import IoThread
from w2b_hw.power import Power
from w2b_hw.robot import Report, Robot
from w2b_hw.safety import State
from w2b_hw.servo_bank import ChipStateError
from w2b_hw.targets import FRAME_S, TargetGate, TargetRefusedError
from w2b_hw.transport import (
    DEFAULT_DEVICE,
    EMULATED,
    FrameBudget,
    Transport,
    check_name,
    is_emulated,
    is_simulated,
    open_transport,
)
from w2b_hw.watchdog import Systemd
from w2b_ros.body_reporter import BodyReporter
from w2b_ros.diagnostics import DiagnosticsReporter
from w2b_ros.managed_node import ManagedNode
from w2b_ros.parameters import Parameter, When, check_frame_id, declare
from w2b_ros.ros_messages import FRAMES_OUT, TARGETS

if TYPE_CHECKING:
    from w2b_hw.emulation.process import SimulatedRobot

DEFAULT_CALIBRATION = '~/.config/w2b/calibration.yaml'


def _check_imu(name: str) -> None:
    if name not in registry.CHOICES:
        raise ValueError(f'expected one of {", ".join(registry.CHOICES)}, got {name!r}')


def _check_body(name: str) -> None:
    joints.named(name)


PARAMETERS = (
    Parameter('autostart', True, 'Configure and activate without being asked.',
              when=When.START),
    Parameter('auto_arm', False, 'Arm with the first target, once; a fault needs ~/arm again.',
              when=When.ACTIVATE),
    Parameter('transport', DEFAULT_DEVICE,
              'I2C bus: a device; emulated, or emulated:SOCKET for chips in another process; '
              'simulated for chips on a simulated body, started with this node.',
              when=When.CONFIGURE, check=check_name),
    Parameter('real_time_factor', 1.0, 'Of a simulated body: its seconds a second, at most; 0 for '
              'as fast as the brain answers. Its time waits for the brain.', (0.0, 100.0),
              when=When.CONFIGURE),
    Parameter('body', joints.BODY, 'Body that the robot is built as: its joints, limits, pose.',
              when=When.CONFIGURE, check=_check_body),
    Parameter('calibration', DEFAULT_CALIBRATION,
              'Calibration file. Emulated chips need none: an ideal robot is the default there.',
              when=When.CONFIGURE),
    Parameter('allow_uncalibrated', False, 'Arm though nobody calibrated some of the servos.',
              when=When.CONFIGURE),
    Parameter('imu', registry.AUTO, f'One of {", ".join(registry.CHOICES)}.',
              when=When.CONFIGURE, check=_check_imu),
    Parameter('use_magnetometer', False, 'Heading from the magnetic field, which servos bend.',
              when=When.CONFIGURE),
    Parameter('watch_posture', True, 'Hold, then turn off when the IMU says that the robot fell '
              'or was picked up.', when=When.CONFIGURE),
    Parameter('gait_scale', 1.0, 'How much of a gait the servos get, about the standing pose: 0 '
              'stands. For first walks, legs off the ground; it grows in 2 s.', (0.0, 1.0)),
    Parameter('imu_frame_id', 'imu_link', 'Frame of the IMU messages.', check=check_frame_id),
)
_BATTERY_EVERY_S = 1.0
_CHECK_EVERY_S = 0.25
_EXECUTOR_SILENT_AFTER_S = 1.0
_REFUSAL_SHOWN_S = 2.0
_OLD_WORD = 'the word was said before the robot was armed: it stands until a new one is said'


class HardwareNode(ManagedNode):
    """Configure: bus, chips, calibration. Activate: frames. The safety machine does the rest."""

    expected_errors = (ValueError, OSError, ImuError, ChipStateError)

    def __init__(self) -> None:
        super().__init__('hardware')
        declare(self, PARAMETERS, state=lambda: self.state_label)
        self._systemd = Systemd()
        self._bus: FrameBudget | None = None
        self._guard: Guard | None = None
        self._simulated: SimulatedRobot | None = None
        self._frame_clock: Clock = WallClock()
        self._robot: Robot | None = None
        self._io: IoThread | None = None
        self._part: Part | None = None
        self._gate = TargetGate(period_s=FRAME_S)
        self._refusal, self._refused_at_s = '', float('-inf')
        self._accepted_at_s = float('-inf')
        self._accepted_stamp_ns: int | None = None
        self._auto_arm = False
        self._frames: deque[tuple[int, Report]] = deque(maxlen=4)
        self._poses: deque[tuple[int, Report]] = deque(maxlen=16)
        self._last: Report | None = None
        self._executor_at_s = 0.0
        self._out = FramePublisher(self)
        self._battery = self.create_publisher(BatteryState, 'battery', FRAMES_OUT)
        self.create_subscription(JointTrajectory, 'joint_trajectory', self._on_target, TARGETS)
        self.create_service(Trigger, '~/arm', self._on_arm)
        self.create_service(Trigger, '~/disarm', self._on_disarm)
        self.create_service(Trigger, '~/emergency_stop', self._on_emergency_stop)
        self.create_timer(_CHECK_EVERY_S, self._on_check)
        self.create_timer(_BATTERY_EVERY_S, self._on_battery)
        self._body = BodyReporter(self, self._body_status)
        self._reporter = DiagnosticsReporter(
            self, self._statuses, lambda: self._text('transport'))

    def _text(self, name: str) -> str:
        return str(self.get_parameter(name).value)

    def _flag(self, name: str) -> bool:
        return bool(self.get_parameter(name).value)

    # -- lifecycle

    def configure(self) -> None:
        """Open the bus, turn everything off, set the chips up (one of `expected_errors`)."""
        try:
            self._configure(self._text('transport'))
        except BaseException:
            self.cleanup()
            raise

    def _configure(self, name: str) -> None:
        check_name(name)
        found = self._calibration(name, joints.named(self._text('body')))
        self._bus = FrameBudget(self._open(name))
        self._robot = Robot(self._bus, found, Power(), rate_hz=1.0 / FRAME_S,
                            clock=self._frame_clock.now,
                            use_magnetometer=self._flag('use_magnetometer'),
                            watch_posture=self._flag('watch_posture'),
                            allow_uncalibrated=self._flag('allow_uncalibrated'))
        for note in filter(None, (found.problem, *(servo.doubt for servo in found.servos))):
            self.get_logger().warning(f'calibration: {note}')
        # Before all else: a chip that a crash left driven is off.
        self._robot.connect()
        self._part = registry.find(self._bus, self._text('imu'))
        self._robot.attach_imu(self._part)
        if name != EMULATED and not is_simulated(name):
            # Chips that outlive this process need somebody who does, too.
            self._guard = Guard(name, found.board.address)

    def _open(self, name: str) -> Transport:
        """Return the bus; with a simulated body behind it, frames run by a stepped clock."""
        if not is_simulated(name):
            self._frame_clock = WallClock()
            return open_transport(name, exclusive=True)
        from w2b_hw.emulation.process import SimulatedRobot, connect

        self._frame_clock = SteppedClock(float(self.get_parameter('real_time_factor').value))
        path = name.partition(':')[2]
        if not path.startswith('/'):
            self._simulated = SimulatedRobot(name, self._text('body'))
            path = self._simulated.path
        return connect(path, self._frame_clock)

    def _calibration(self, transport: str, driven: joints.JointList) -> calibration.Calibration:
        path = self._text('calibration')
        if (is_emulated(transport) or is_simulated(transport)) and path == DEFAULT_CALIBRATION:
            return calibration.nominal(joints=driven)
        return calibration.load(Path(path).expanduser(), driven)

    def activate(self) -> None:
        """Begin the frames."""
        assert self._robot is not None
        self._gate = TargetGate(period_s=FRAME_S, joints=self._robot.joints.names)
        self._gait_scale = GaitScale(self._robot.safety.limits.park_rad)
        self._auto_arm = bool(self.get_parameter('auto_arm').value)
        self._io = IoThread(self._robot, period_s=FRAME_S, on_frame=self._on_frame,
                            on_pose=self._on_pose, sign_of_life=self._sign_of_life,
                            clock=self._frame_clock)
        self._io.start()
        self._systemd.ready()

    def deactivate(self) -> None:
        """Turn everything off and end the frames."""
        if self._io is not None:
            self._io.stop()
            self._io = None
        self._frames.clear()
        self._poses.clear()
        self._last = None

    def cleanup(self) -> None:
        """Release the bus; the guard turns everything off once more."""
        self.deactivate()
        self._robot = self._part = None
        if self._bus is not None:
            self._bus.close()
            self._bus = None
        if self._guard is not None:
            self._guard.close()
            self._guard = None
        if self._simulated is not None:
            self._simulated.close()
            self._simulated = None

    def close(self) -> None:
        """Turn everything off before the process ends."""
        self._systemd.stopping()
        self.cleanup()

    # -- called in the I/O thread

    def _on_frame(self, report: Report) -> None:
        self._frames.append((self._frame_clock.stamp_ns(), report))
        self._tell()

    def _on_pose(self, report: Report) -> None:
        if self._out.wants_poses:
            self._poses.append((self._frame_clock.stamp_ns(), report))
            self._tell()

    def _tell(self) -> None:
        """Let the executor publish: ROS is used in its thread only, this is the I/O thread."""
        if (executor := self.executor) is not None:
            executor.create_task(self._on_news)

    def _sign_of_life(self, driven: bool) -> None:
        if time.monotonic() - self._executor_at_s < _EXECUTOR_SILENT_AFTER_S:
            self._systemd.alive()
        guard, robot = self._guard, self._robot
        if guard is None or robot is None:
            return
        guard.sign_of_life(driven)
        if driven and not guard.alive():
            robot.emergency_stop('the guard process ended: start this node again')

    # -- called in the executor

    def _on_news(self) -> None:
        while self._frames:
            stamp, report = self._frames.popleft()
            self._last = report
            self._out.frame(report, None if self._part is None else type(self._part), stamp)
        while self._poses:
            stamp, report = self._poses.popleft()
            self._out.pose(report, stamp)

    def _on_battery(self) -> None:
        if self._last is not None and self._io is not None:
            self._battery.publish(messages.battery(self._last, self.get_clock().now().to_msg()))

    def _on_target(self, message: JointTrajectory) -> None:
        if self._io is None:
            return
        try:
            target = self._gate.take(message, self._frame_clock.stamp_ns(), self._epoch())
        except TargetRefusedError as error:
            self._refuse(str(error))
            return
        scale = float(self.get_parameter('gait_scale').value)
        self._io.target(self._gait_scale.scaled(target.pose, scale, self._frame_clock.now()),
                        target.word_epoch)
        if target.counts:
            self._accepted_at_s, self._accepted_stamp_ns = time.monotonic(), target.stamp_ns
        else:
            self._refuse(_OLD_WORD)
        self._body.check()
        if self._auto_arm:
            # Once: after a fault or a stop, a person arms.
            self._auto_arm = False
            refusal = self._arm()
            if refusal is not None:
                self.get_logger().error(f'not armed: {refusal}')

    def _refuse(self, reason: str) -> None:
        self._refusal, self._refused_at_s = reason, time.monotonic()

    def _arm(self) -> str | None:
        if self._io is None or self._robot is None:
            return 'the node is not active'
        if self._guard is not None and not self._guard.alive():
            return 'the guard process ended: start this node again'
        now_ns = self._frame_clock.stamp_ns()
        refusal = self._io.ask(self._robot.arm)
        if refusal is None:
            self._gate.armed(now_ns)
        # Before the answer: a word that is said after it is a new one.
        self._body.check()
        return refusal

    def _on_arm(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        refusal = self._arm()
        response.success = refusal is None
        response.message = refusal or 'arming: the servos are energised one by one'
        return response

    def _on_disarm(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        refusal: str | None = 'the node is not active; the servos are off'
        if self._io is not None and self._robot is not None:
            refusal = self._io.ask(self._robot.disarm)
            self._body.check()
        response.success = refusal is None
        response.message = refusal or 'parking, then the servos are turned off'
        return response

    def _on_emergency_stop(self, request: Trigger.Request, response: Trigger.Response
                           ) -> Trigger.Response:
        response.success, response.message = True, 'off; call ~/arm to start again'
        if self._io is None or self._robot is None:
            return response
        problem = self._io.ask(self._robot.stop)
        self._body.check()
        if problem is not None:
            response.success, response.message = False, f'{problem}; CUT THE SUPPLY'
            if self._guard is not None:
                # The guard turns everything off when its pipe closes.
                self._guard.close()
        return response

    def _epoch(self) -> str:
        return 'none' if self._robot is None else self._robot.safety.epoch

    def _body_status(self) -> BodyStatus:
        if self._io is None or self._robot is None:
            return BodyStatus(self._text('body'), 'INACTIVE',
                              f'the node is {self.state_label}; the servos are off', False,
                              self._epoch(), True)
        safety = self._robot.safety
        fresh = time.monotonic() - self._accepted_at_s <= FRESH_PERIODS * FRAME_S
        return BodyStatus(self._robot.joints.body, safety.state.value, safety.reason,
                          safety.state is State.ACTIVE and fresh, safety.epoch, True,
                          self._accepted_stamp_ns)

    def _on_check(self) -> None:
        self._executor_at_s = time.monotonic()
        if self._io is not None and not self._io.alive():
            self.get_logger().fatal(f'the I/O thread ended: {self._io.error!r}')
            self.exit_code = 1

    def _statuses(self) -> Sequence[Status]:
        if self._io is None or self._last is None:
            return [Status(Level.WARN, 'hardware: safety', f'{self.state_label}: servos are off')]
        late_ms = sorted(1e3 * late for late in self._io.lateness_s.copy())
        fresh = time.monotonic() - self._refused_at_s < _REFUSAL_SHOWN_S
        return messages.statuses(
            self._last, imu='no IMU' if self._part is None else self._part.name,
            wants_heading=self._flag('use_magnetometer'),
            targets={'accepted': str(self._gate.accepted), 'refused': str(self._gate.refused)},
            refusal=self._refusal if fresh else '',
            frames={'late_ms_median': f'{late_ms[len(late_ms) // 2]:.2f}',
                    'late_ms_p99': f'{late_ms[int(0.99 * (len(late_ms) - 1))]:.2f}'})
