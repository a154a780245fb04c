"""The gyroscope's bias: learnt at rest, not in motion, and taken off the heading."""

import math

import numpy as np
import pytest

from w2b_hw.imu.gyroscope_bias import GyroscopeBias
from w2b_hw.imu.orientation import Orientation
from w2b_hw.imu.part import Sample

BIAS = (0.01, -0.008, 0.012)
UP = (0.0, 0.0, 9.81)


def at_rest(rng, rate=(0.0, 0.0, 0.0), force=UP):
    noisy = np.add(rate, BIAS) + rng.normal(size=3) * 5e-4
    return Sample(tuple(np.add(force, rng.normal(size=3) * 5e-3)), tuple(noisy), None)


@pytest.fixture
def rng():
    return np.random.default_rng(0)


def heading_deg(quaternion):
    x, y, z, w = quaternion
    return math.degrees(math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))


def test_five_seconds_at_rest_teach_it(rng):
    bias = GyroscopeBias(20.0)
    for number in range(100):
        assert bias.known == (number > 99)
        corrected = bias.corrected(at_rest(rng))
    assert bias.known
    np.testing.assert_allclose(bias.rad_s, BIAS, atol=2e-4)
    np.testing.assert_allclose(corrected, 0, atol=3e-3)


def test_motion_teaches_nothing_and_what_was_learnt_stays(rng):
    bias = GyroscopeBias(20.0)
    for number in range(400):
        bias.corrected(at_rest(rng, rate=(0.0, 0.0, 0.3 * math.sin(0.5 * number))))
    assert not bias.known
    for _ in range(100):
        bias.corrected(at_rest(rng))
    learnt = bias.rad_s
    for number in range(100):
        bias.corrected(at_rest(rng, rate=(0.0, 0.0, 0.3 * math.cos(0.5 * number))))
    assert bias.rad_s == learnt


def test_a_steady_turn_is_no_bias(rng):
    bias = GyroscopeBias(20.0)
    for _ in range(300):
        bias.corrected(at_rest(rng, rate=(0.0, 0.0, 0.3)))
    assert not bias.known


def test_jolts_are_no_rest(rng):
    bias = GyroscopeBias(20.0)
    for number in range(300):
        bias.corrected(at_rest(rng, force=(0.0, 0.0, 9.81 + (number % 2))))
    assert not bias.known


def test_a_gap_begins_the_rest_anew(rng):
    bias = GyroscopeBias(20.0)
    for _ in range(99):
        bias.corrected(at_rest(rng))
    bias.restart()
    for _ in range(99):
        bias.corrected(at_rest(rng))
    assert not bias.known
    bias.corrected(at_rest(rng))
    assert bias.known


def test_a_minute_after_standing_the_heading_has_drifted_by_less_than_two_degrees(rng):
    """Uncorrected it would be 41 degrees."""
    orientation = Orientation(20.0, 500.0)
    for _ in range(120):
        orientation.update(at_rest(rng), 0.05)
    assert orientation.bias.known
    before = heading_deg(orientation.update(at_rest(rng), 0.05))
    # It moves, so that nothing more is learnt.
    for number in range(1200):
        after = orientation.update(at_rest(rng, rate=(
            0.0, 0.0, 0.5 * math.sin(2 * math.pi * 1.6 * number * 0.05))), 0.05)
    assert abs(heading_deg(after) - before) < 2.0
