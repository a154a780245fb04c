"""The robot falls, is picked up, or does not know how it stands: what its legs do."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.faults.rig import FRAME_S, Rig
from tests.faults.scenarios import Outcome, arms_again, scenario, stays_off, until, walking
from w2b_hw.safety import State


def _let_go(rig: Rig, reason: str) -> Outcome:
    """Run on: the legs hold, whatever the brain says, then all is off; arming needs feet."""
    held = until(rig, lambda: rig.robot.safety.state is State.HOLD)
    pose = rig.pulses()
    while rig.robot.safety.state is State.HOLD:
        assert rig.pulses() == pose, 'a leg moved while it was to hold'
        rig.frame()
        held = Outcome(held.frames + 1, held.ms + 1e3 * FRAME_S)
    assert rig.off()
    assert reason in rig.report.reason
    stays_off(rig)
    return held


def _posture(change: Callable[[Rig], None], reason: str) -> Callable[[], Outcome]:
    def run() -> Outcome:
        with walking() as rig:
            for _ in range(60):
                rig.frame()
            change(rig)
            seen = _let_go(rig, reason)
            rig.chips.motion.acceleration_m_s2 = (0.0, 0.0, 9.80665)
            rig.chips.motion.angular_velocity_rad_s = (0.0, 0.0, 0.0)
            for _ in range(25):
                rig.frame()
            arms_again(rig)
        return seen
    return run


def _feels(acceleration: tuple[float, float, float], reason: str,
           rate: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Callable[[], Outcome]:
    def change(rig: Rig) -> None:
        rig.chips.motion.acceleration_m_s2 = acceleration
        rig.chips.motion.angular_velocity_rad_s = rate
    return _posture(change, reason)


for _name, _run in (
        ('tipped over', _feels((0.0, 9.80665, 0.3), 'tipped over')),
        ('on its back', _feels((0.0, 0.5, -9.80665), 'tipped over')),
        ('picked up', _feels((0.0, 0.0, 12.5), 'picked up')),
        ('held askew', _feels((-6.3, 0.0, 7.5), 'picked up or tipped over')),
        ('turned about by hand', _feels((0.0, 0.0, 9.80665), 'picked up', (0.0, 0.0, 3.0))),
        ('dropped', _feels((0.0, 0.0, 0.2), 'dropped'))):
    scenario(_name, 'legs hold, off after 1 s', frames=40, ms=2000)(_run)


@scenario('armed while it lies on its side', 'refused: set it on its feet', frames=0, ms=0)
def armed_lying() -> Outcome:
    with TemporaryDirectory() as folder:
        rig = Rig(Path(folder))
        rig.chips.motion.acceleration_m_s2 = (0.0, -9.80665, 0.0)
        for _ in range(20):
            rig.frame()
        assert 'set it on its feet' in rig.robot.arm(rig.now_s)
        assert rig.off()
    return Outcome(0, 0)


def _gap(seconds: float) -> Callable[[], Outcome]:
    def run() -> Outcome:
        with walking() as rig:
            chip = rig.chips.imu_chips[0]
            rig.chips.wire.chips.remove(chip)
            for _ in range(round(seconds / FRAME_S)):
                assert rig.frame().orientation is None
            # It was set on a slope meanwhile.
            rig.chips.motion.acceleration_m_s2 = (0.0, 3.354, 9.215)
            rig.chips.wire.chips.append(chip)
            seen = until(rig, lambda: rig.report.sample is not None)
            unknown = until(rig, lambda: rig.report.orientation is not None)
            x, _, _, w = rig.report.orientation
            assert abs(math.degrees(2 * math.atan2(x, w)) - 20.0) < 2.0, 'a tilt that is not so'
            assert seen.ms <= 1100
        return unknown
    return run


for _seconds in (1, 10):
    scenario(f'IMU off the bus for {_seconds} s', 'no orientation until it is right, within 2 deg',
             frames=80, ms=4000)(_gap(_seconds))
