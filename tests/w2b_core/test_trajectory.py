"""Trajectories that are executed as written, and the reasons why others are refused."""

import math
from types import SimpleNamespace

import pytest

from w2b_core.trajectory import TrajectoryError, check, nanoseconds

NAMES = ('hip', 'knee')
PERIOD_S = 0.05


def time(sec=0, nanosec=0):
    return SimpleNamespace(sec=sec, nanosec=nanosec)


def point(due=None, **fields):
    return SimpleNamespace(**{
        'positions': [0.1, 0.2], 'velocities': [], 'accelerations': [], 'effort': [],
        'time_from_start': due or time(), **fields})


@pytest.mark.parametrize('good', [
    point(), point(time(0, 50_000_000)), point(time(0, 1)), point(velocities=[0.0, 0.0]),
    point(velocities=[0.0, -0.0], accelerations=[0.0, 0.0])])
def test_a_pose_to_be_reached_by_the_next_frame_is_executed(good):
    check(NAMES, [good], PERIOD_S)


@pytest.mark.parametrize(('bad', 'reason'), [
    (point(time(10)), r'time_from_start: expected 0 to 0.05 s.* got 10 s'),
    (point(time(0, 60_000_000)), 'got 0.06 s'),
    (point(time(-1)), 'got -1 s'),
    (point(time(-1, 999_999_999)), 'got -1e-09 s'),
    (point(time(0, 1_000_000_000)), 'nanosec below 1,000,000,000, got 1,000,000,000'),
    (point(time(-1, 2**32 - 1)), 'nanosec below'),
    (point(velocities=[0.0]), 'velocities: expected none or one for each of 2 joints, got 1'),
    (point(velocities=[0.0] * 3), 'got 3'),
    (point(velocities=[0.0, math.nan]), 'velocities: expected none or zeros.* got knee nan'),
    (point(velocities=[math.inf, 0.0]), 'got hip inf'),
    (point(velocities=[1.0, 0.0]), 'only positions are followed; got hip 1'),
    (point(accelerations=[0.0, -2.0]), 'accelerations: expected none or zeros.* got knee -2'),
    (point(accelerations=[0.0]), 'accelerations: expected none or one'),
    (point(effort=[0.0, 0.0]), 'effort: expected none')])
def test_what_is_not_executed_as_written_is_refused_with_the_reason(bad, reason):
    with pytest.raises(TrajectoryError, match=reason) as caught:
        check(NAMES, [bad], PERIOD_S)
    assert '\n' not in str(caught.value)


@pytest.mark.parametrize('count', [0, 2])
def test_one_point_is_expected(count):
    with pytest.raises(TrajectoryError, match=f'expected 1 point, got {count}'):
        check(NAMES, [point()] * count, PERIOD_S)


def test_a_stamp_is_a_time_of_whole_seconds_and_less_than_a_second():
    assert nanoseconds('stamp', time(3, 5)) == 3_000_000_005
    with pytest.raises(TrajectoryError, match='stamp: expected a nanosec below'):
        nanoseconds('stamp', time(3, 1_500_000_000))
