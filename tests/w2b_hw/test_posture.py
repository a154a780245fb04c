"""Tipped over, picked up, dropped: what the IMU shows of each, and what it shows of none."""

import math
import random

import pytest

from w2b_hw.imu.part import Sample
from w2b_hw.posture import PostureWatch

G = 9.80665
PERIOD_S = 0.05


class Bench:
    """A robot that stands, with the noise of its sensors."""

    def __init__(self, speed=0.0):
        self.watch = PostureWatch(PERIOD_S)
        self.random = random.Random(1)
        self.speed = speed
        assert self.feel(3.0) is None

    def feel(self, seconds, force=(0.0, 0.0, G), rate=(0.0, 0.0, 0.0)):
        """Return what was noticed, and after how long; None if nothing was."""
        for number in range(round(seconds / PERIOD_S)):
            noisy = [tuple(value + self.random.gauss(0, sigma) for value in vector)
                     for vector, sigma in ((force, 0.03), (rate, 0.01))]
            event = self.watch.update(Sample(*noisy, None), self.speed)
            if event is not None:
                return event, (number + 1) * PERIOD_S
        return None


def tilted(degrees, about='x'):
    angle = math.radians(degrees)
    side = G * math.sin(angle)
    return (0.0, side, G * math.cos(angle)) if about == 'x' else (-side, 0.0, G * math.cos(angle))


@pytest.fixture(params=[0.0, 1.5], ids=['standing', 'walking'])
def bench(request):
    return Bench(request.param)


@pytest.mark.parametrize('about', ['x', 'y'])
@pytest.mark.parametrize('degrees', [-90, -50, 60, 90, 180])
def test_a_robot_on_its_side_or_back_is_noticed_within_a_second(bench, degrees, about):
    event, after_s = bench.feel(2.0, tilted(degrees, about))
    assert 'tipped over' in event or 'picked up' in event
    assert after_s <= 1.0
    assert bench.watch.lies
    for _ in range(20):
        bench.feel(0.05)
    assert not bench.watch.lies, 'set on its feet again'


@pytest.mark.parametrize('weight', [0.75, 0.85, 1.15, 1.3, 2.0])
def test_a_lift_and_a_descent_are_noticed(bench, weight):
    event, after_s = bench.feel(0.4, (0.0, 0.0, weight * G))
    assert 'picked up' in event
    assert after_s <= 0.4


def test_a_drop_a_turn_and_a_robot_held_askew_are_noticed(bench):
    assert 'dropped' in bench.feel(0.3, (0.0, 0.0, 0.2))[0]
    bench.watch.restart()
    assert 'turned' in bench.feel(1.0, rate=(0.0, 0.0, math.radians(180)))[0]
    bench.watch.restart()
    assert 'picked up' in bench.feel(2.0, tilted(40))[0]


@pytest.mark.parametrize('degrees', [-30, 10, 26])
def test_a_slope_is_none_of_them(bench, degrees):
    assert bench.feel(5.0, tilted(degrees)) is None


def test_a_knock_is_none_of_them(bench):
    for _ in range(20):
        assert bench.feel(0.1, (0.0, 5.0, 3 * G)) is None
        assert bench.feel(0.4) is None


def test_a_gait_that_begins_is_no_lift_though_all_its_samples_weigh_more():
    """A gait of 10 Hz in samples of 20 Hz: each shows the same two moments of a step."""
    bench = Bench()
    bench.speed = 2.0
    for _ in range(100):
        assert bench.feel(0.05, (0.0, 2.0, 1.5 * G), (0.0, 1.0, 0.0)) is None
        assert bench.feel(0.05, (0.0, -2.0, 1.2 * G), (0.0, -1.0, 0.0)) is None


def test_a_gait_that_shakes_is_not_tipped_over_and_a_shaking_robot_on_its_side_is():
    bench = Bench()
    bench.speed = 2.0
    for number in range(200):
        side = 1.5 * G * math.sin(number * 1.3)
        assert bench.feel(0.05, (side, 0.5 * side, G * (1 + math.sin(number * 2.1)))) is None
    for number in range(40):
        event = bench.feel(0.05, (0.5 * G * math.sin(number * 1.3), G, G * math.sin(number)))
        if event is not None:
            break
    assert 'tipped over' in event[0]
    assert number <= 30
