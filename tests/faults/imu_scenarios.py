"""The IMU is absent, lost, frozen or damaged: how soon the legs rest."""

from __future__ import annotations

import pytest

from tests.faults.rig import FRAME_S, Rig
from tests.faults.scenarios import (
    Outcome,
    arms_again,
    not_disturbed,
    scenario,
    stays_off,
    until,
    walking,
)
from w2b_hw.emulation.faults import flipped_bit, is_read_of
from w2b_hw.emulation.robot import EmulatedRobot
from w2b_hw.imu import registry
from w2b_hw.imu.part import ImuError
from w2b_hw.safety import State


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
