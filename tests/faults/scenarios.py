"""
What goes wrong, and how soon the robot is safe: one function a scenario.

Each brings a walking robot into trouble and returns how many frames and milliseconds passed until
the safe outcome it states. Every pulse on the way is judged by `rig.Rig`: within limits, within the
slew limit, one servo energised at a time, none while not armed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from tests.faults.rig import FRAME_S, Rig
from w2b_hw import calibration
from w2b_hw.calibration import CalibrationError
from w2b_hw.emulation.faults import (
    bus_held,
    cut_after,
    flipped_bit,
    is_burst,
    is_read_of,
    no_acknowledge,
)
from w2b_hw.emulation.robot import EmulatedRobot
from w2b_hw.imu import registry
from w2b_hw.imu.part import ImuError
from w2b_hw.joints import JOINTS
from w2b_hw.safety import State


@dataclass(frozen=True)
class Outcome:
    """What was seen."""

    frames: int
    ms: float


@dataclass(frozen=True)
class Scenario:
    """A fault, the outcome that is safe, and the bounds on the way to it."""

    name: str
    safe: str
    most_frames: int
    most_ms: float
    run: Callable[[], Outcome]


SCENARIOS: list[Scenario] = []


def scenario(name: str, safe: str, *, frames: int, ms: float
             ) -> Callable[[Callable[[], Outcome]], Callable[[], Outcome]]:
    """Enter a function into the list."""
    def enter(run: Callable[[], Outcome]) -> Callable[[], Outcome]:
        SCENARIOS.append(Scenario(name, safe, frames, ms, run))
        return run
    return enter


@contextmanager
def walking() -> Iterator[Rig]:
    """Give a robot that is armed and walks."""
    with TemporaryDirectory() as folder:
        rig = Rig(Path(folder))
        rig.arm()
        assert not rig.off()
        yield rig


def until(rig: Rig, condition: Callable[[], bool]) -> Outcome:
    """Run frames until the condition holds."""
    started_s = rig.now_s
    frames = rig.frames_until(condition)
    return Outcome(frames, 1e3 * (rig.now_s - started_s))


def stays_off(rig: Rig, seconds: float = 2.0) -> None:
    """Run on, with a brain that answers: nothing may be driven again by itself."""
    rig.answer = rig.walk
    for _ in range(round(seconds / FRAME_S)):
        rig.frame()
        assert rig.off()
        assert rig.robot.safety.state in (State.FAULT, State.DISARMED)


def arms_again(rig: Rig) -> None:
    """Arm as a person would; servos come one by one (the rig judges)."""
    rig.answer = rig.walk
    rig.arm()
    assert rig.robot.safety.state is State.ACTIVE


def fault_and_off(rig: Rig) -> Callable[[], bool]:
    """Return the condition: FAULT, and not one pulse."""
    return lambda: rig.robot.safety.state is State.FAULT and rig.off()


def not_disturbed(rig: Rig, seconds: float = 1.0) -> Outcome:
    """Run on: the robot must go on walking, each frame with the pulses it was told."""
    lost = 0
    for _ in range(round(seconds / FRAME_S)):
        before = rig.pulses()
        rig.frame()
        assert rig.robot.safety.state is State.ACTIVE
        lost += rig.pulses() == before
    return Outcome(lost, 1e3 * FRAME_S * lost)


# -- the bus

@scenario('one NACK', 'walks on, no frame lost', frames=0, ms=0)
def one_nack() -> Outcome:
    with walking() as rig:
        rig.wire.once(no_acknowledge)
        return not_disturbed(rig)


@scenario('NACK at any byte of the burst', 'repeated in the frame, never half a channel',
          frames=0, ms=0)
def nack_in_burst() -> Outcome:
    lost = 0
    with walking() as rig:
        for sent in range(50):
            rig.wire.once(cut_after(sent), when=is_burst)
            lost += not_disturbed(rig, FRAME_S).frames
    return Outcome(lost, 1e3 * FRAME_S * lost)


@scenario('persistent NACK', 'FAULT; off in the frame the bus comes back', frames=4, ms=200)
def persistent_nack() -> Outcome:
    with walking() as rig:
        pose = rig.pulses()
        rig.wire.always(no_acknowledge)
        to_fault = until(rig, lambda: rig.robot.safety.state is State.FAULT)
        # No command reaches the chip: it holds its last pose, and the report says so.
        assert rig.pulses() == pose
        assert 'CUT THEIR SUPPLY' in rig.report.reason
        for _ in range(10):
            rig.frame()
        rig.wire.always(None)
        back = until(rig, rig.off)
        stays_off(rig)
        arms_again(rig)
    return Outcome(to_fault.frames + back.frames, to_fault.ms + back.ms)


@scenario('SDA stuck', 'FAULT; one try a frame; off when released', frames=4, ms=200)
def sda_stuck() -> Outcome:
    with walking() as rig:
        tries = []

        def held(transport, messages):
            tries.append(rig.frames)
            return bus_held(transport, messages)
        rig.wire.always(held)
        to_fault = until(rig, lambda: rig.robot.safety.state is State.FAULT)
        for _ in range(10):
            rig.frame()
        # Each try blocks the I/O thread for the kernel's 10 ms: one a frame leaves it time.
        assert len(tries) == len(set(tries))
        rig.wire.always(None)
        back = until(rig, rig.off)
        stays_off(rig)
    return Outcome(to_fault.frames + back.frames, to_fault.ms + back.ms)


# -- the servo chip

@scenario('brown-out mid-run', 'off at once, FAULT next frame, re-armed servo by servo',
          frames=1, ms=50)
def brown_out() -> Outcome:
    with walking() as rig:
        rig.chips.pca9685.power_on()
        assert rig.off()
        seen = until(rig, fault_and_off(rig))
        assert 'lost power' in rig.report.reason
        stays_off(rig)
        arms_again(rig)
    return seen


@scenario('brown-out between health read and burst', 'no pulse, FAULT next frame',
          frames=1, ms=50)
def brown_out_mid_frame() -> Outcome:
    worst = Outcome(0, 0)
    for number in range(8):
        with walking() as rig:
            rig.wire.before_transfer(number, rig.chips.pca9685.power_on)
            rig.frame()
            seen = until(rig, fault_and_off(rig))
            stays_off(rig, 0.5)
            # The frame with the fault in it counts.
            seen = Outcome(seen.frames + 1, seen.ms + 1e3 * FRAME_S)
            worst = max(worst, seen, key=lambda outcome: outcome.frames)
    return worst


@scenario('auto-increment lost', 'off, FAULT', frames=1, ms=50)
def auto_increment_lost() -> Outcome:
    with walking() as rig:
        rig.chips.pca9685.corrupt(0x00, 0x00)
        seen = until(rig, fault_and_off(rig))
        stays_off(rig)
        arms_again(rig)
    return seen


@scenario('prescale changed', 'wrong until the next health read, then off, FAULT',
          frames=1, ms=50)
def prescale_changed() -> Outcome:
    with walking() as rig:
        rig.excused = True
        rig.chips.pca9685.corrupt(0xFE, 0x1E)
        seen = until(rig, fault_and_off(rig))
        stays_off(rig)
        arms_again(rig)
    return seen


@scenario('start on a live chip', 'off in the first two transfers', frames=0, ms=0)
def live_chip() -> Outcome:
    with walking() as rig:
        # The same chips, set up once more, as by the next process after a crash.
        rig.wire.before_transfer(2, lambda: _assert(rig.off()))
        rig.robot.connect()
        rig.judge(confirmed=True)
        assert rig.off()
    return Outcome(0, 0)


@scenario('crash mid-update', 'each transfer whole: no torn pose', frames=0, ms=0)
def crash_mid_update() -> Outcome:
    class CrashError(BaseException):
        """The process is gone."""

    def crash() -> None:
        raise CrashError
    for number in range(9):
        with walking() as rig:
            old = rig.pulses()
            rig.wire.before_transfer(number, crash)
            new: list[tuple[float, ...]] = []
            try:
                while True:
                    rig.frame()
                    new.append(rig.pulses())
                    if len(new) > 4:
                        break
            except CrashError:
                rig.judge(confirmed=False)
                changed = sum(a != b for a, b in zip(old, rig.pulses(), strict=True))
                assert new or changed in (0, *range(9, 13)), 'a pose of which half was sent'
    return Outcome(0, 0)


# -- targets

def _bad(rig: Rig, kind: str) -> Callable[[int], tuple]:
    def answer(stamp_ns: int) -> tuple:
        names, (pose,), _ = rig.walk(stamp_ns)
        return {
            'NaN': (names, [[math.nan, *pose[1:]]], stamp_ns),
            'inf': (names, [[math.inf, *pose[1:]]], stamp_ns),
            'wrong length': (names, [pose[:11]], stamp_ns),
            'wrong name': ((*names[:11], 'tail'), [pose], stamp_ns),
            'old stamp': (names, [pose], stamp_ns - 200_000_000),
            'delayed stamp': (names, [pose], stamp_ns - 160_000_000),
        }[kind]
    return answer


def _refused_stream(kind: str) -> Callable[[], Outcome]:
    def run() -> Outcome:
        with walking() as rig:
            good = rig.answer
            # One among good ones: as if it had not come.
            rig.answer = _bad(rig, kind)
            pose = rig.pulses()
            rig.frame()
            assert len(rig.refusals) == 1
            assert max(abs(a - b) for a, b in zip(pose, rig.pulses(), strict=True)) < 80
            rig.answer = good
            assert not_disturbed(rig).frames == 0
            # Nothing but bad ones: as if the brain had stopped.
            rig.answer = _bad(rig, kind)
            return _stopped(rig)
    return run


def _stopped(rig: Rig) -> Outcome:
    rig.frame()
    held = until(rig, lambda: rig.robot.safety.state is State.HOLD)
    assert held.ms <= 150
    pose = rig.pulses()
    parked = until(rig, lambda: rig.robot.safety.state is State.PARK)
    assert held.ms + parked.ms <= 500
    assert rig.pulses() == pose or rig.robot.safety.state is State.PARK
    off = until(rig, lambda: rig.robot.safety.state is State.DISARMED and rig.off())
    stays_off(rig)
    return Outcome(1 + held.frames + parked.frames + off.frames,
                   50 + held.ms + parked.ms + off.ms)


for _kind in ('NaN', 'inf', 'wrong length', 'wrong name', 'old stamp', 'delayed stamp'):
    scenario(f'targets: {_kind}', 'refused; held, parked, off', frames=50,
             ms=2550)(_refused_stream(_kind))


@scenario('publisher stops', 'hold 150 ms, park 500 ms, off when parked', frames=50, ms=2550)
def publisher_stops() -> Outcome:
    with walking() as rig:
        rig.answer = rig.silence
        return _stopped(rig)


@scenario('over-travel', 'clamped to the limits', frames=0, ms=0)
def over_travel() -> Outcome:
    with walking() as rig:
        rig.answer = lambda stamp_ns: (JOINTS, [[100.0] * 12], stamp_ns)
        for _ in range(20):
            rig.frame()
        limits = [servo.pulse_us(servo.max_rad) for servo in rig.calibration.servos]
        assert all(abs(pulse - limit) <= 2.5
                   for pulse, limit in zip(rig.pulses(), limits, strict=True))
    return Outcome(0, 0)


@scenario('step target', 'slewed at 5 rad/s', frames=7, ms=350)
def step_target() -> Outcome:
    with walking() as rig:
        side = [0.5 if 'hip' in joint else 0.75 for joint in JOINTS]
        rig.answer = lambda stamp_ns: (JOINTS, [[-angle for angle in side]], stamp_ns)
        for _ in range(20):
            rig.frame()
        goal = [servo.pulse_us(angle)
                for servo, angle in zip(rig.calibration.servos, side, strict=True)]
        rig.answer = lambda stamp_ns: (JOINTS, [side], stamp_ns)
        return until(rig, lambda: all(abs(pulse - there) <= 2.5 for pulse, there
                                      in zip(rig.pulses(), goal, strict=True)))


# -- the IMU

@scenario('IMU absent at start', 'not started: an error that names the addresses', frames=0, ms=0)
def imu_absent() -> Outcome:
    _refused_imu(EmulatedRobot('none'), 'no answer')
    return Outcome(0, 0)


@scenario('IMU of wrong identity', 'not started: an error that names what answered',
          frames=0, ms=0)
def imu_wrong() -> Outcome:
    chips = EmulatedRobot()
    chips.imu_chips[0].registers[0x0F] = 0x6B
    _refused_imu(chips, '0x6b in register 0x0f')
    return Outcome(0, 0)


def _refused_imu(chips: EmulatedRobot, message: str) -> None:
    with pytest.raises(ImuError, match=message):
        registry.find(chips.wire)
    assert not any(chips.pca9685.pulses_us())


def _imu_lost(rig: Rig) -> Outcome:
    stopped = until(rig, lambda: rig.robot.safety.state is State.PARK)
    assert rig.report.sample is None
    off = until(rig, lambda: rig.robot.safety.state is State.DISARMED and rig.off())
    assert 'IMU' in rig.report.reason
    stays_off(rig, 0.5)
    return Outcome(stopped.frames + off.frames, stopped.ms + off.ms)


@scenario('IMU unplugged', 'parked, off; no sample published', frames=44, ms=2200)
def imu_unplugged() -> Outcome:
    with walking() as rig:
        chip = rig.chips.imu_chips[0]
        rig.chips.wire.chips.remove(chip)
        seen = _imu_lost(rig)
        rig.frame()
        assert 'IMU fails' in rig.robot.arm(rig.now_s)
        rig.chips.wire.chips.append(chip)
        for _ in range(25):
            rig.frame()
        arms_again(rig)
    return seen


@scenario('IMU frozen', 'parked, off; no sample published', frames=44, ms=2200)
def imu_frozen() -> Outcome:
    with walking() as rig:
        rig.chips.imu_chips[0].frozen = True
        return _imu_lost(rig)


@scenario('IMU setup bit-flipped', 'sample refused in that frame; parked, off', frames=44, ms=2200)
def imu_setup_flipped() -> Outcome:
    with walking() as rig:
        rig.chips.imu_chips[0].registers[0x11] ^= 0x08
        rig.frame()
        assert rig.report.sample is None
        return _imu_lost(rig)


@scenario('IMU data bit-flipped', 'walks on, no pulse changed', frames=0, ms=0)
def imu_data_flipped() -> Outcome:
    lost = 0
    with walking() as rig:
        for bit in range(2 * 7 * 8):
            rig.wire.once(flipped_bit(bit), when=is_read_of(0x78))
            lost += not_disturbed(rig, FRAME_S).frames
    return Outcome(lost, 1e3 * FRAME_S * lost)


# -- supply, calibration

@scenario('undervoltage', 'off, FAULT (read once a second)', frames=21, ms=1050)
def undervoltage() -> Outcome:
    with walking() as rig:
        rig.supply.write_text('1\n')
        seen = until(rig, fault_and_off(rig))
        stays_off(rig)
        assert 'supply is too low' in rig.robot.arm(rig.now_s)
        rig.supply.write_text('0\n')
        arms_again(rig)
    return seen


@scenario('bad calibration', 'not started, no transfer at all', frames=0, ms=0)
def bad_calibration() -> Outcome:
    with TemporaryDirectory() as folder:
        path = Path(folder) / 'calibration.yaml'
        calibration.save(calibration.nominal(), path)
        good = path.read_text()
        for text in (None, '', good[:200], good.replace('1500.0', '1600.0', 1),
                     good.replace('version: 1', 'version: 2'), good.replace('hip', 'tail')):
            path.unlink(missing_ok=True) if text is None else path.write_text(text)
            with pytest.raises(CalibrationError, match='calibrat'):
                calibration.load(path)
    return Outcome(0, 0)


@scenario('1 of 12 servos calibrated', 'not armed unless it is allowed', frames=0, ms=0)
def half_calibrated() -> Outcome:
    first, *rest = calibration.nominal(calibrated=False).servos
    found = calibration.Calibration(calibration.Board(), (replace(first, calibrated=True), *rest))
    with TemporaryDirectory() as folder:
        rig = Rig(Path(folder), found=found)
        rig.frame()
        assert '1 of 12 servos are calibrated' in rig.robot.arm(rig.now_s)
        rig.frame()
        assert rig.off()
    with TemporaryDirectory() as folder:
        rig = Rig(Path(folder), found=found, allow_uncalibrated=True)
        rig.arm()
        assert not rig.off()
    return Outcome(0, 0)


@scenario('control loop stalls for 1 s', 'off, FAULT, in the first frame after', frames=1, ms=1050)
def stall() -> Outcome:
    with walking() as rig:
        rig.now_s += 1.0
        seen = until(rig, fault_and_off(rig))
        stays_off(rig)
        arms_again(rig)
    return Outcome(seen.frames, seen.ms + 1000)


def _assert(condition: bool) -> None:
    assert condition
