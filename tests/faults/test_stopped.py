"""A process that is stopped in the middle of a frame wakes when the guard has turned all off."""

import pytest

from tests.faults.rig import Rig
from w2b_hw.relax import all_channels_off
from w2b_hw.safety import State


@pytest.mark.parametrize('stopped_s', [0.0, 0.2, 0.3, 60.0])
def test_a_pose_of_before_is_not_sent_after_a_long_stop(stopped_s, tmp_path):
    """Between the look at the chip and the burst: the one place where the chip does not tell."""
    rig = Rig(tmp_path)
    rig.arm()
    asked = 0

    def clock():
        nonlocal asked
        asked += 1
        if asked == 2 and stopped_s > 0.25:
            all_channels_off(rig.chips.wire, 0x40)
        return stopped_s if asked == 2 else 0.0

    rig.robot._clock = clock
    rig.chips.pca9685.history.clear()
    report = rig.robot.drive(rig.now_s + 0.01)
    driven = [any(pulses) for _since_s, pulses in rig.chips.pca9685.history]
    if stopped_s <= 0.25:
        assert report.state is State.ACTIVE
        assert all(rig.pulses())
        return
    assert report.state is State.FAULT
    assert f'stopped for {stopped_s:.2f} s within a frame' in report.reason
    assert report.off_confirmed
    assert rig.off()
    assert not any(driven[driven.index(False):]), 'nothing came on again'
