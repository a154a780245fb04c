"""What was said before, or is not executed as written, moves no leg: on the pulses."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace

import numpy as np

from tests.faults.rig import FRAME_S, Rig
from tests.faults.scenarios import Outcome, scenario, until, walking
from w2b_core.body_status import BodyStatus, mark
from w2b_core.brain import Brain
from w2b_core.controller import file as controller_file
from w2b_core.vocabulary import Vocabulary
from w2b_hw.calibration import nominal
from w2b_hw.imu import registry
from w2b_hw.joints import BODY, JOINTS
from w2b_hw.power import Power
from w2b_hw.robot import Robot
from w2b_hw.safety import State
from w2b_hw.targets import TargetGate
from w2b_hw.transport import FrameBudget

#: A servo that does not move stays within two ticks of 4.88 us.
STILL_US = 10.0


@cache
def _mind() -> tuple[controller_file.Controller, Vocabulary]:
    return (controller_file.load(controller_file.resolve(BODY)), Vocabulary.load())


class Talk:
    """A robot and the brain that walks it, as the nodes join them."""

    def __init__(self, folder: Path, command_timeout_s: float = 0.0) -> None:
        self.rig = Rig(folder)
        self.brain = Brain(*_mind(), frame_timeout_s=0.5, clock=lambda: self.rig.now_s,
                           command_timeout_s=command_timeout_s)
        #: Whether the brain is told how the body is.
        self.told = True
        self.extra: dict[str, float] = {}
        self.stamp_offset_ns = 0
        #: Period of the frames as their stamps have it, against the real one.
        self.haste = 1.0
        self._first_ns = 0
        self._epoch, self._epoch_at_s = '', self.rig.now_s
        self.rig.answer = self._answer

    def _answer(self, stamp_ns: int) -> tuple[list[str], list[list[float]], int] | None:
        rig, safety = self.rig, self.rig.robot.safety
        if safety.epoch != self._epoch:
            self._epoch, self._epoch_at_s = safety.epoch, rig.now_s
        if self.told:
            self.brain.body(BodyStatus(BODY, safety.state.value, safety.reason,
                                       safety.state is State.ACTIVE, safety.epoch, True, None,
                                       rig.now_s - self._epoch_at_s))
        self._first_ns = self._first_ns or stamp_ns
        report = rig.robot._report
        stamp = round(self._first_ns + (stamp_ns - self._first_ns) * self.haste) \
            + self.stamp_offset_ns
        joints = {**dict(zip(JOINTS, report.position_rad, strict=True)), **self.extra}
        targets = self.brain.joint_states(stamp, list(joints), list(joints.values()))
        if self.brain.uses_imu and report.sample is not None:
            targets = self.brain.imu(stamp, report.orientation,
                                     report.sample.angular_velocity_rad_s)
        if targets is None:
            return None
        rig.mark = mark(targets.word_epoch)
        assert targets.stamp_ns == stamp
        return list(targets.joints), [list(map(float, targets.position_rad))], stamp_ns

    def frames(self, seconds: float) -> np.ndarray:
        """Run on; return how far each pulse ranged, in us."""
        seen = []
        for _ in range(round(seconds / FRAME_S)):
            self.rig.frame()
            seen.append(self.rig.pulses())
        return np.ptp(seen, axis=0)

    def arm(self) -> None:
        """Arm as a person would, and wait until the servos follow."""
        self.rig.frame()
        refusal = self.rig.robot.arm(self.rig.now_s)
        assert refusal is None, refusal
        self.rig.armed = True
        self.rig.frames_until(lambda: self.rig.robot.safety.state is State.ACTIVE)

    def stands(self, seconds: float = 2.0) -> None:
        """Run on: driven, and no pulse changes."""
        swing_us = self.frames(seconds)
        assert self.rig.robot.safety.state is State.ACTIVE
        assert all(self.rig.pulses())
        assert swing_us.max() < STILL_US, f'a word said before moves it: {swing_us}'

    def walks(self) -> None:
        """Say a new word: it is followed."""
        assert self.brain.hear('forward').level == 0
        self.frames(1.0)
        assert np.count_nonzero(self.frames(1.5) > 10 * STILL_US) >= 4, 'a new word moves nothing'


@contextmanager
def talking(**how: float) -> Iterator[Talk]:
    """Give a robot that is off, and a brain."""
    with TemporaryDirectory() as folder:
        talk = Talk(Path(folder), **how)
        # The brain answers when the IMU's orientation is known.
        talk.rig.frames_until(lambda: bool(talk.rig.gate.accepted))
        yield talk


@scenario('word said before arming', 'it stands until a new word', frames=0, ms=0)
def before_arming() -> Outcome:
    with talking() as talk:
        talk.brain.hear('forward')
        talk.frames(0.5)
        assert talk.rig.off()
        talk.arm()
        talk.stands()
        talk.walks()
    return Outcome(0, 0)


@scenario('word said before arming, status lost', 'the robot itself refuses it', frames=0, ms=0)
def before_arming_untold() -> Outcome:
    """A brain that is not told that the body was armed goes on with its word."""
    with talking() as talk:
        talk.brain.hear('forward')
        talk.frames(0.5)
        talk.told = False
        talk.arm()
        talk.stands()
        talk.told = True
        talk.stands(0.2)
        talk.walks()
    return Outcome(0, 0)


def _emergency_stop(talk: Talk) -> None:
    talk.rig.robot.stop(talk.rig.now_s)


def _park(talk: Talk) -> None:
    talk.rig.robot.disarm(talk.rig.now_s)


def _fault(talk: Talk) -> None:
    talk.rig.chips.pca9685.power_on()


def _silence(talk: Talk) -> None:
    talk.rig.answer = talk.rig.silence


def _picked_up(talk: Talk) -> None:
    motion = talk.rig.chips.motion
    motion.acceleration_m_s2 = (0.0, 9.5, 2.0)
    talk.rig.frames_until(lambda: talk.rig.robot.safety.state is State.HOLD)
    motion.acceleration_m_s2 = (0.0, 0.0, 9.80665)


def _before(end: Callable[[Talk], None]) -> Callable[[], Outcome]:
    def run() -> Outcome:
        with talking() as talk:
            talk.arm()
            talk.walks()
            end(talk)
            until(talk.rig, talk.rig.off)
            talk.rig.answer = talk._answer
            talk.frames(1.0)
            talk.arm()
            talk.stands()
            talk.walks()
        return Outcome(0, 0)
    return run


for _name, _end in (('an emergency stop', _emergency_stop), ('a park', _park), ('a fault', _fault),
                    ('targets stopped', _silence), ('it was picked up', _picked_up)):
    scenario(f'word said before {_name}', 'armed again, it stands until a new word',
             frames=0, ms=0)(_before(_end))


@scenario('word said before hardware restarted', 'armed again, it stands until a new word',
          frames=0, ms=0)
def hardware_restarted() -> Outcome:
    with talking() as talk:
        talk.arm()
        talk.walks()
        rig = talk.rig
        # The next process, on the same chips; the brain lives on.
        epoch = rig.robot.safety.epoch
        rig.robot = Robot(FrameBudget(rig.wire), nominal(), Power(Path('/nonexistent')))
        rig.robot.connect()
        rig.robot.attach_imu(registry.find(rig.wire))
        rig.judge(confirmed=True)
        assert rig.off()
        rig.gate, rig.armed = TargetGate(), False
        assert rig.robot.safety.epoch.split('.')[0] != epoch.split('.')[0]
        rig.frames_until(lambda: bool(rig.gate.accepted))
        talk.arm()
        talk.stands()
        talk.walks()
    return Outcome(0, 0)


@scenario('frames start over under a word', 'it stands until a new word', frames=11, ms=550)
def frames_start_over() -> Outcome:
    with talking() as talk:
        talk.arm()
        talk.walks()
        # The brain's frames begin again with early stamps, the robot stays as it is.
        talk.stamp_offset_ns = -900 * 10**9
        seen = until(talk.rig, lambda: talk.rig.mark == 'standing')
        talk.frames(4.0)
        talk.arm()
        talk.stands()
        talk.walks()
    return seen


def _at_rate(haste: float) -> Callable[[], Outcome]:
    def run() -> Outcome:
        with talking() as talk:
            talk.arm()
            talk.walks()
            # From here on the stamps grow at another rate.
            talk._first_ns = round((talk.rig.now_s - FRAME_S) * 1e9)
            talk.haste = haste
            seen = until(talk.rig, lambda: talk.rig.mark == 'standing')
            assert 'the controller is for 20 Hz' in talk.brain.command_status().message
            talk.frames(1.0)
            talk.stands()
        return seen
    return run


for _name, _haste in (('100 Hz', 0.2), ('4 Hz', 5.0)):
    scenario(f'frames at {_name} for 20 Hz', 'it stands; a warning with both rates', frames=14,
             ms=700)(_at_rate(_haste))


@scenario('word that nobody renews', 'it stands when its time is over', frames=101, ms=5050)
def word_ends() -> Outcome:
    with talking(command_timeout_s=5.0) as talk:
        talk.arm()
        talk.walks()
        # The same word again renews it.
        talk.brain.hear('forward')
        seen = until(talk.rig, lambda: talk.rig.mark == 'standing')
        assert '5 s ago' in talk.brain.command_status().message
        # Its servos have their way to go to the standing pose.
        talk.frames(1.0)
        talk.stands()
        talk.walks()
    return seen


def _refused(text: str, **fields: object) -> Callable[[], Outcome]:
    """Return the scenario of one bad trajectory among good ones, then of nothing but bad ones."""
    def run() -> Outcome:
        with walking() as rig:
            rig.fields = fields
            rig.refusals.clear()
            pose = rig.pulses()
            rig.frame()
            assert text in rig.refusals[0], rig.refusals
            # What was under way goes on: at most the slew of one frame.
            assert max(abs(a - b) for a, b in zip(pose, rig.pulses(), strict=True)) < 170
            rig.fields = {}
            rig.frame()
            assert rig.robot.safety.state is State.ACTIVE
            rig.fields = fields
            held = until(rig, lambda: rig.robot.safety.state is State.HOLD)
            off = until(rig, rig.off)
        return Outcome(held.frames + off.frames, held.ms + off.ms)
    return run


def _duration(sec: int, nanosec: int = 0) -> SimpleNamespace:
    return SimpleNamespace(sec=sec, nanosec=nanosec)


for _name, _text, _fields in (
        ('due in 10 s', 'got 10 s', {'time_from_start': _duration(10)}),
        ('due before now', 'got -1 s', {'time_from_start': _duration(-1)}),
        ('nanosec of 1e9', 'nanosec below', {'time_from_start': _duration(0, 10**9)}),
        ('with velocities', 'only positions', {'velocities': [0.5] * 12}),
        ('velocities of wrong length', 'none or one for each', {'velocities': [0.0] * 11}),
        ('velocity NaN', 'nan', {'velocities': [math.nan] * 12}),
        ('with efforts', 'effort: expected none', {'effort': [0.1] * 12})):
    scenario(f'trajectory {_name}', 'refused with the reason; held, parked, off',
             frames=50, ms=2550)(_refused(_text, **_fields))


@scenario('extra joint in joint_states', 'ignored: it walks on', frames=0, ms=0)
def extra_joint() -> Outcome:
    with talking() as talk:
        talk.arm()
        talk.walks()
        talk.extra = {'pan_joint': 0.5}
        assert np.count_nonzero(talk.frames(1.5) > 10 * STILL_US) >= 4, 'an extra joint stops it'
        assert talk.rig.robot.safety.state is State.ACTIVE
    return Outcome(0, 0)
