"""
The robot on emulated chips with a clock that the test turns, and a judge that watches every pulse.

A frame here is what the I/O thread does in 50 ms: sense, drive, and drive once more when the
brain's answer comes, 2 ms later.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace

from w2b_hw.calibration import Calibration, nominal
from w2b_hw.emulation.faults import FaultyTransport
from w2b_hw.emulation.robot import EmulatedRobot
from w2b_hw.imu import registry
from w2b_hw.joints import JOINTS
from w2b_hw.power import Power
from w2b_hw.robot import Report, Robot
from w2b_hw.safety import DRIVEN, State
from w2b_hw.targets import TargetGate, TargetRefusedError
from w2b_hw.transport import FrameBudget

FRAME_S = 0.05
ANSWER_S = 0.002
TICK_US = 4.88


class PulseError(AssertionError):
    """A pulse that must never be put out."""


class Rig:
    """
    A robot that walks (each joint swings) until something is done to it.

    `answer` makes the brain's message of a frame's stamp: names, points, stamp; None for silence.
    """

    def __init__(self, folder: Path, imu: str = 'lsm6dsox', found: Calibration | None = None,
                 allow_uncalibrated: bool = False) -> None:
        self.now_s = 1000.0
        self.calibration = found or nominal()
        self.chips = EmulatedRobot(imu, clock=lambda: self.now_s)
        self.wire = FaultyTransport(self.chips.wire)
        self.supply = _supply(folder)
        bus = FrameBudget(self.wire)
        self.robot = Robot(bus, self.calibration, Power(folder),
                           allow_uncalibrated=allow_uncalibrated)
        self.robot.connect()
        self.robot.attach_imu(registry.find(bus))
        self.now_s += FRAME_S
        self.gate = TargetGate()
        self.answer: Callable[[int], tuple[Sequence[str], list[list[float]], int] | None] = \
            self.walk
        #: What the brain's next message says besides: the mark of its word, fields of its point.
        self.mark = ''
        self.fields: dict[str, object] = {}
        self.refusals: list[str] = []
        self.frames = 0
        self.report: Report | None = None
        self.armed = False
        #: A chip that was tampered with puts out what it likes until the robot can know.
        self.excused = False
        self._shown = self.pulses()
        self._shown_at_s = self.now_s

    # -- what the brain says

    def walk(self, stamp_ns: int) -> tuple[Sequence[str], list[list[float]], int]:
        """Swing every joint by 0.3 rad at 1 Hz."""
        phase = 2 * math.pi * self.now_s
        return JOINTS, [[0.3 * math.sin(phase + n) for n in range(12)]], stamp_ns

    def silence(self, stamp_ns: int) -> None:
        """Say nothing."""

    # -- what the pins do

    def pulses(self) -> tuple[float, ...]:
        """Return the pulses at the servos, in the order of the joints; 0 for off."""
        pins = self.chips.pca9685.pulses_us()
        return tuple(pins[servo.channel] for servo in self.calibration.servos)

    def off(self) -> bool:
        """Whether no channel at all puts out a pulse."""
        return not any(self.chips.pca9685.pulses_us())

    def judge(self, confirmed: bool) -> None:
        """
        Compare every state of the pins since the last pose that was sent with that pose.

        A pose that was not confirmed may have reached some channels; it is no pose to go by.
        """
        history = self.chips.pca9685.history
        shown = self._shown
        while history:
            since_s, pins = history.popleft()
            shown = tuple(pins[servo.channel] for servo in self.calibration.servos)
            if any(shown) and not self.armed:
                raise PulseError(f'pulses while not armed: {shown}')
            self.excused = self.excused and any(shown)
            if self.excused:
                continue
            self._judge_pulses(shown, since_s - self._shown_at_s)
            energised = sum(map(bool, shown)) - sum(map(bool, self._shown))
            if energised > 1:
                raise PulseError(f'{energised} servos energised at once')
        if confirmed or not any(shown):
            self._shown, self._shown_at_s = shown, self.now_s

    def _judge_pulses(self, shown: tuple[float, ...], elapsed_s: float) -> None:
        slew_rad_s = self.robot.safety.limits.slew_rad_s
        for servo, before_us, pulse_us in zip(self.calibration.servos, self._shown, shown,
                                              strict=True):
            if not pulse_us:
                continue
            low, high = sorted((servo.pulse_us(servo.min_rad), servo.pulse_us(servo.max_rad)))
            if not low - TICK_US <= pulse_us <= high + TICK_US:
                raise PulseError(f'{servo.joint}: {pulse_us:.0f} us, outside {low:.0f}..{high:.0f}')
            # Both pulses are rounded to ticks.
            most_us = slew_rad_s * servo.us_per_rad * elapsed_s + TICK_US
            if before_us and abs(pulse_us - before_us) > most_us:
                raise PulseError(f'{servo.joint}: {before_us:.0f} to {pulse_us:.0f} us at once, '
                                 f'at most {most_us:.0f}')

    # -- time

    def frame(self) -> Report:
        """Let 50 ms pass; judge every pulse."""
        self.frames += 1
        self.now_s += FRAME_S - ANSWER_S
        report = self.robot.frame(self.now_s)
        self._after(report)
        stamp_ns = round(self.now_s * 1e9)
        self.now_s += ANSWER_S
        message = self.answer(stamp_ns)
        if message is not None:
            try:
                target = self.gate.take(self._message(*message), round(self.now_s * 1e9),
                                        self.robot.safety.epoch)
            except TargetRefusedError as error:
                self.refusals.append(str(error))
            else:
                self.robot.safety.take_target(target.pose, self.now_s, target.word_epoch)
                report = self.robot.drive(self.now_s)
                self._after(report)
        return report

    def _message(self, names: Sequence[str], points: list[list[float]], stamp_ns: int
                 ) -> SimpleNamespace:
        """Return what would be a JointTrajectory."""
        def time(nanoseconds: int) -> SimpleNamespace:
            seconds, rest = divmod(nanoseconds, 10**9)
            return SimpleNamespace(sec=seconds, nanosec=rest)
        return SimpleNamespace(
            header=SimpleNamespace(stamp=time(stamp_ns), frame_id=self.mark), joint_names=names,
            points=[SimpleNamespace(**{
                'positions': positions, 'velocities': [], 'accelerations': [], 'effort': [],
                'time_from_start': time(50_000_000), **self.fields}) for positions in points])

    def frames_until(self, condition: Callable[[], bool], at_most: int = 200) -> int:
        """Run frames until the condition holds; return how many it took."""
        for count in range(at_most + 1):
            if condition():
                return count
            self.frame()
        raise AssertionError(f'not within {at_most} frames: state {self.robot.safety.state}')

    def arm(self) -> None:
        """Arm, and wait until it walks."""
        self.frame()
        refusal = self.robot.arm(self.now_s)
        assert refusal is None, refusal
        self.armed = True
        self.frames_until(lambda: self.robot.safety.state is State.ACTIVE)
        for _ in range(20):
            self.frame()

    def _after(self, report: Report) -> None:
        self.report = report
        self.judge(confirmed=report.bus_error is None)
        if report.state not in DRIVEN and report.off_confirmed:
            self.armed = False


def _supply(folder: Path) -> Path:
    """Lay out a hwmon folder with an undervoltage alarm that is off; return the alarm."""
    (folder / 'hwmon0').mkdir()
    (folder / 'hwmon0' / 'name').write_text('rpi_volt\n')
    alarm = folder / 'hwmon0' / 'in0_lcrit_alarm'
    alarm.write_text('0\n')
    return alarm
