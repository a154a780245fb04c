"""Frames at another rate than the controller's: a warning with both numbers, and it stands."""

import random

import pytest

from tests.w2b_core.test_brain_body import Bench
from w2b_core.frame_rate import WINDOW, FrameRate
from w2b_core.sensor_frames import SensorFrame
from w2b_core.status import Level


def rate_of(gaps_s, period_s=0.05):
    rate = FrameRate(period_s)
    for gap_s in gaps_s:
        rate.take(round(gap_s * 1e9))
    return rate


def test_the_right_rate_with_jitter_and_lost_frames_is_right():
    chance = random.Random(2)
    for _ in range(200):
        gaps = [0.05 * chance.choice([1, 1, 1, 2]) + chance.uniform(-0.01, 0.01)
                for _ in range(WINDOW)]
        assert rate_of(gaps).fault == '' or sum(gap > 0.0625 for gap in gaps) >= WINDOW / 2
        assert not rate_of(gaps).steady or all(gap > 0.0625 for gap in gaps)


@pytest.mark.parametrize(('gap_s', 'period_s', 'reason'), [
    (0.01, 0.05, 'sensor frames come at 100 Hz, the controller is for 20 Hz'),
    (0.25, 0.05, 'sensor frames come at 4 Hz, the controller is for 20 Hz'),
    (0.05, 0.5, 'sensor frames come at 20 Hz, the controller is for 2 Hz'),
    (0.07, 0.05, 'sensor frames come at 14.3 Hz, the controller is for 20 Hz')])
def test_another_rate_is_told_with_both_numbers(gap_s, period_s, reason):
    rate = rate_of([gap_s] * WINDOW, period_s)
    assert rate.fault == reason
    assert rate.steady
    assert rate_of([gap_s] * (WINDOW - 1), period_s).fault == '', 'not before there are enough'


def test_the_brain_stands_under_a_steady_wrong_rate_until_the_word_is_said_at_the_right_one():
    bench = Bench()
    bench.brain.hear('forward')
    assert bench.walks()
    stamp_ns = bench.number * 50_000_000
    joints, feet = bench._joints, dict.fromkeys(bench._feet, True)
    for number in range(1, WINDOW + 1):
        bench.now_s += 0.01
        targets = bench.brain.sense(SensorFrame(stamp_ns + number * 10_000_000, joints, feet))
    assert targets.word_epoch is None
    status = bench.brain.frames_status()
    assert (status.level, status.message) == (
        Level.WARN, 'sensor frames come at 100 Hz, the controller is for 20 Hz')
    assert 'say the word again' in bench.brain.stopped().message
    # Said again at the wrong rate it ends again; at the right one it goes on.
    bench.brain.hear('forward')
    bench.now_s += 0.01
    frame = SensorFrame(stamp_ns + (WINDOW + 1) * 10_000_000, joints, feet)
    assert bench.brain.sense(frame).word_epoch is None
    bench.number += WINDOW
    bench.frames(WINDOW)
    assert bench.brain.frames_status().level is Level.OK
    bench.brain.hear('forward')
    assert bench.walks()
