"""
The robot without ROS: bus, servos, IMU and supply behind the safety machine.

Everything here runs in one thread, the one that owns the bus.
"""

from __future__ import annotations

import secrets
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from w2b_hw.calibration import HOW_TO_FINISH, Calibration
from w2b_hw.imu.orientation import LONGEST_GAP_PERIODS, Orientation
from w2b_hw.imu.part import ImuError, Part, Sample
from w2b_hw.posture import PostureWatch
from w2b_hw.power import Power
from w2b_hw.safety import DRIVEN, Command, Limits, Pose, Safety, State
from w2b_hw.servo_bank import ChipStateError, ServoBank
from w2b_hw.transport import FrameBudget

#: Frames in a row without the bus, or without a sample, that are borne.
FAULT_AFTER_FRAMES = 3
_POWER_EVERY_S = 1.0
_IMU_RETRY_EVERY_S = 1.0
_CUT_THE_SUPPLY = 'the servos could not be turned off: CUT THEIR SUPPLY'


@dataclass(frozen=True)
class Report:
    """
    What the robot is doing: all that the node publishes.

    Per joint, in the order of `joints`: `position_rad` and `velocity_rad_s` of what was
    really sent, `pulses_us` with 0 for off. `orientation` (x, y, z, w) is None while it is not
    known; the variances (rad^2) are those of roll and pitch, and of yaw.
    """

    time_s: float
    joints: tuple[str, ...]
    state: State
    reason: str
    position_rad: Pose
    velocity_rad_s: Pose
    pulses_us: tuple[float, ...]
    off_confirmed: bool
    sample: Sample | None
    orientation: tuple[float, float, float, float] | None
    tilt_variance: float
    yaw_variance: float
    imu_error: str | None
    bus_error: str | None
    undervoltage: bool | None
    retried: int
    duty_used_s: float


class Robot:
    """
    The servos and the IMU behind the safety machine.

    Parameters
    ----------
    bus
        The bus, with the frame's budget of retries.
    calibration
        Of this robot; there is no robot without one.
    power
        The undervoltage alarm.
    rate_hz
        Frames a second.
    limits
        None for the calibration's limits and the defaults of `safety.Limits`.
    use_magnetometer
        See `imu.orientation.Orientation`.
    watch_posture
        Whether to hold and relax when the IMU says that the robot fell or was picked up.
    allow_uncalibrated
        Whether to arm with uncalibrated servos.
    clock
        Monotonic seconds: shows that the process was stopped within a frame.

    """

    def __init__(self, bus: FrameBudget, calibration: Calibration, power: Power, *,
                 rate_hz: float = 20.0, limits: Limits | None = None,
                 use_magnetometer: bool = False, watch_posture: bool = True,
                 allow_uncalibrated: bool = False,
                 clock: Callable[[], float] = time.monotonic) -> None:
        board = calibration.board
        self._servos = calibration.servos
        self.joints = calibration.joints
        self._uncalibrated = '' if allow_uncalibrated else calibration.problem
        self._bus = bus
        self._bank = ServoBank(self._bus, [servo.channel for servo in self._servos],
                               address=board.address, oscillator_hz=board.oscillator_hz,
                               frequency_hz=board.frequency_hz)
        self.safety = Safety(limits or limits_of(calibration), secrets.token_hex(4))
        self._imu: Part | None = None
        self._watch_posture = watch_posture
        self._posture = PostureWatch(1.0 / rate_hz)
        self._orientation: Orientation | None = None
        self._use_magnetometer = use_magnetometer
        self._clock = clock
        self._power = power
        self._period_s = 1.0 / rate_hz
        self._bus_failures = 0
        self._imu_failures = 0
        self._imu_tried_at_s = float('-inf')
        self._power_read_at_s = float('-inf')
        self._sampled_at_s: float | None = None
        self._sent_at_s = float('-inf')
        self._off_confirmed = False
        count = len(self._servos)
        self._report = Report(
            0.0, self.joints.names, State.DISARMED, '', self.safety.limits.park_rad,
            (0.0,) * count, (0.0,) * count, False, None, None, 0.0, 0.0, None, None, None, 0, 0.0)

    def connect(self) -> None:
        """Turn everything off and set the servo chip up (OSError, ChipStateError)."""
        self._bus.begin_frame()
        self._bank.connect()
        self._off_confirmed = True

    def attach_imu(self, imu: Part | None) -> None:
        """Take the IMU that `imu.registry.find` found on the same bus."""
        self._imu = imu
        self._orientation = None if imu is None else Orientation(
            1.0 / self._period_s, imu.gyroscope_range_dps, self._use_magnetometer)
        self._posture = PostureWatch(self._period_s)

    def arm(self, now_s: float) -> str | None:
        """Set the chip up anew and start energising; return None, or why not."""
        safety = self.safety
        if safety.state not in (State.DISARMED, State.FAULT):
            return f'already {safety.state.value}'
        if self._uncalibrated:
            return (f'{self._uncalibrated}: {HOW_TO_FINISH}, or set allow_uncalibrated:=true '
                    'and start again')
        if self._power.undervoltage():
            return 'the supply is too low: charge or replace it, then arm again'
        if self._imu_failures >= FAULT_AFTER_FRAMES:
            return f'the IMU fails ({self._report.imu_error}): check it, or set imu:=none'
        if self._watch_posture and self._posture.lies:
            return (f'the robot does not stand: the IMU says that it is tilted by '
                    f'{self._posture.tilt_deg:.0f} degrees; set it on its feet, then arm again')
        try:
            self.connect()
        except (OSError, ChipStateError) as error:
            self._off_confirmed = False
            return f'the servo chip cannot be set up ({error}): check bus and supply'
        self._bus_failures = 0
        return safety.arm(now_s)

    def frame(self, now_s: float) -> Report:
        """Begin a frame: read the supply and the IMU, then drive the servos."""
        self._bus.begin_frame()
        self._watch_power(now_s)
        self._sense(now_s)
        return self.drive(now_s)

    def drive(self, now_s: float) -> Report:
        """Let the safety machine decide, check the chip and send the pose."""
        began_s = self._clock()
        command = self.safety.step(now_s)
        try:
            if any(command.energised):
                pulses_us = self._pulses_us(command)
                self._bank.check()
                # Stopped here, a process would wake long after the guard has turned everything
                # off, and turn it on again.
                stopped_s = self._clock() - began_s
                if stopped_s > self.safety.limits.stall_after_s:
                    self._fault(f'the process was stopped for {stopped_s:.2f} s within a frame')
                else:
                    self._send(pulses_us, command, now_s)
            elif any(self._report.pulses_us) or not self._off_confirmed:
                self._turn_off()
            else:
                self._bank.check()
            self._bus_failures = 0
            bus_error = None
        except ChipStateError as error:
            bus_error = str(error)
            if any(command.energised):
                self._fault(bus_error)
        except OSError as error:
            bus_error = f'error {error.errno} ({error.strerror})'
            self._bus_failures += 1
            if self._bus_failures >= FAULT_AFTER_FRAMES and any(command.energised):
                self._fault(f'the bus failed in {self._bus_failures} frames: {bus_error}')
        reason = self.safety.reason
        if self.safety.state not in DRIVEN and not self._off_confirmed:
            reason = f'{reason}; {_CUT_THE_SUPPLY}'
        self._report = replace(
            self._report, time_s=now_s, state=self.safety.state, reason=reason,
            off_confirmed=self._off_confirmed, bus_error=bus_error, retried=self._bus.retried,
            duty_used_s=self.safety.duty_used_s)
        return self._report

    def relax(self) -> None:
        """Turn everything off now, whatever the state (OSError if the chip does not answer)."""
        self._bus.begin_frame()
        self.safety.relax('the frames ended')
        self._turn_off()

    def disarm(self, now_s: float) -> str | None:
        """Park, then turn everything off; return None, or why not."""
        self.safety.park('asked to disarm', now_s)
        return None

    def stop(self, now_s: float) -> str | None:
        """Turn everything off as an emergency stop; return None, or why that is not certain."""
        self.emergency_stop('emergency stop')
        return None if self._off_confirmed else 'the servo chip does not answer'

    def emergency_stop(self, reason: str) -> None:
        """Turn everything off now and stay so until armed again."""
        self._bus.begin_frame()
        self._fault(reason)

    def close(self) -> None:
        """Release the bus."""
        self._bus.close()

    # -- parts of a frame

    def _pulses_us(self, command: Command) -> dict[int, float | None]:
        return {servo.channel: servo.pulse_us(angle) if driven else None
                for servo, angle, driven
                in zip(self._servos, command.position_rad, command.energised, strict=True)}

    def _send(self, pulses_us: dict[int, float | None], command: Command, now_s: float) -> None:
        self._off_confirmed = False
        sent = self._bank.write(pulses_us)
        self.safety.confirm()
        pulses = tuple(sent[servo.channel] for servo in self._servos)
        position = tuple(servo.angle_rad(pulse) if pulse else angle for servo, pulse, angle
                         in zip(self._servos, pulses, command.position_rad, strict=True))
        elapsed_s = now_s - self._sent_at_s
        velocity = tuple(
            (new - old) / elapsed_s if was and 0 < elapsed_s < 10 * self._period_s else 0.0
            for new, old, was in zip(position, self._report.position_rad, self._report.pulses_us,
                                     strict=True))
        self._sent_at_s = now_s
        self._report = replace(self._report, position_rad=position, velocity_rad_s=velocity,
                               pulses_us=pulses)

    def _turn_off(self) -> None:
        self._off_confirmed = False
        self._bank.relax()
        self._off_confirmed = True
        count = len(self._servos)
        self._report = replace(self._report, position_rad=self.safety.limits.park_rad,
                               velocity_rad_s=(0.0,) * count, pulses_us=(0.0,) * count)

    def _fault(self, reason: str) -> None:
        """Go to FAULT and turn off in the same frame; what fails is tried in every frame."""
        self.safety.fault(reason)
        self._off_confirmed = False
        try:
            self._turn_off()
        except OSError:
            # drive() tries again in the next frame, and says so until it works.
            return

    def _watch_power(self, now_s: float) -> None:
        if now_s - self._power_read_at_s < _POWER_EVERY_S:
            return
        self._power_read_at_s = now_s
        undervoltage = self._power.undervoltage()
        self._report = replace(self._report, undervoltage=undervoltage)
        if undervoltage and self.safety.state is not State.FAULT:
            self._fault('undervoltage: the supply is too low')

    def _sense(self, now_s: float) -> None:
        if self._imu is None or self._orientation is None:
            return
        try:
            if self._imu_failures >= FAULT_AFTER_FRAMES:
                if now_s - self._imu_tried_at_s < _IMU_RETRY_EVERY_S:
                    return
                self._imu_tried_at_s = now_s
                self._imu.configure()
                # Its first sample takes a while: it is read in the next frame.
                self._imu_failures = FAULT_AFTER_FRAMES - 1
                return
            sample = self._imu.read()
        except (OSError, ImuError) as error:
            self._imu_failed(str(error), now_s)
            return
        self._imu_failures = 0
        elapsed_s = self._period_s if self._sampled_at_s is None else now_s - self._sampled_at_s
        self._sampled_at_s = now_s
        estimate = self._orientation
        orientation = estimate.update(sample, elapsed_s)
        self._report = replace(
            self._report, sample=sample, imu_error=None, orientation=orientation,
            tilt_variance=estimate.tilt_variance, yaw_variance=estimate.yaw_variance)
        self._look_at_posture(sample, elapsed_s, now_s)

    def _look_at_posture(self, sample: Sample, elapsed_s: float, now_s: float) -> None:
        if elapsed_s > LONGEST_GAP_PERIODS * self._period_s:
            self._posture.restart()
        speeds = self._report.velocity_rad_s
        event = self._posture.update(sample, sum(map(abs, speeds)) / len(speeds))
        if event is not None and self._watch_posture:
            self.safety.let_go(event, now_s)

    def _imu_failed(self, message: str, now_s: float) -> None:
        self._imu_failures += 1
        self._report = replace(self._report, sample=None, orientation=None, imu_error=message)
        if self._imu_failures == FAULT_AFTER_FRAMES:
            self.safety.stand(f'the IMU failed in {FAULT_AFTER_FRAMES} frames: {message}', now_s)


def limits_of(calibration: Calibration) -> Limits:
    """Return the limits that calibration and joints both allow, and the defaults for the rest."""
    servos, joints = calibration.servos, calibration.joints
    lower = tuple(map(max, (servo.min_rad for servo in servos), joints.lower_rad))
    upper = tuple(map(min, (servo.max_rad for servo in servos), joints.upper_rad))
    return Limits(lower_rad=lower, upper_rad=upper, park_rad=tuple(
        min(max(park, low), high)
        for park, low, high in zip(joints.park_rad, lower, upper, strict=True)))
