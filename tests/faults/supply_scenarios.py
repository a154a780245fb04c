"""Supply, calibration and control loop: what keeps a robot off, or turns it off."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from tests.faults.rig import Rig
from tests.faults.scenarios import (
    Outcome,
    arms_again,
    fault_and_off,
    scenario,
    stays_off,
    until,
    walking,
)
from w2b_hw import calibration
from w2b_hw.calibration import CalibrationError


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
