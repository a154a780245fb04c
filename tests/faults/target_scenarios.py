"""Targets that are damaged, late, missing or too far: what the servos get."""

from __future__ import annotations

import math
from collections.abc import Callable

from tests.faults.rig import Rig
from tests.faults.scenarios import Outcome, not_disturbed, scenario, stays_off, until, walking
from w2b_hw.joints import JOINTS
from w2b_hw.safety import State


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
