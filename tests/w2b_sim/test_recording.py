"""Figures of a phase, from paths made by hand."""

import numpy as np
import pytest

from w2b_core.behaviours import BEHAVIOURS, Bounds
from w2b_sim.recording import Recording, phase_outcome, reversals


def recording(x, y, yaw, z=None, joints=None, upright=None):
    frames = len(x)
    half = np.asarray(yaw) / 2
    tilt = np.zeros(frames) if upright is None else np.asarray(upright) / 2
    turn = np.stack([np.cos(half) * np.cos(tilt), np.cos(half) * np.sin(tilt),
                     np.sin(half) * np.sin(tilt), np.sin(half) * np.cos(tilt)], -1)
    joints = np.zeros((frames, 2)) if joints is None else joints
    height = np.full(frames, 0.1) if z is None else z
    return Recording(0.05, np.stack([x, y, height], -1), turn, np.zeros(frames), joints, joints,
                     np.zeros((frames, 0)), np.full((frames, 2), 0.1), np.full((frames, 2), 0.25))


def test_a_straight_walk_in_the_axes_of_its_own_heading():
    way = np.linspace(0, 1, 201)
    outcome = phase_outcome(recording(way * np.cos(2.0), way * np.sin(2.0), np.full(201, 2.0)))
    assert outcome.seconds == pytest.approx(10)
    assert (outcome.along_m, outcome.across_m) == pytest.approx((1.0, 0.0), abs=1e-9)
    assert outcome.going_m_s == pytest.approx(0.1)
    assert outcome.drift_m == pytest.approx(0.9)
    assert outcome.at_speed_limit == pytest.approx(0.25)
    assert outcome.torque_nm == pytest.approx(0.1)
    assert BEHAVIOURS.get('forward').obeyed(outcome.motion, Bounds(move_m=0.5, still_m=0.1))
    assert not BEHAVIOURS.get('stop').obeyed(outcome.motion, Bounds(move_m=0.5, still_m=0.1))


def test_yaw_turns_on_past_half_a_turn_and_a_steady_turn_does_not_wobble():
    yaw = np.linspace(3.0, 3.0 + 3 * np.pi, 201)
    outcome = phase_outcome(recording(np.zeros(201), np.zeros(201), yaw))
    assert outcome.yaw_rad == pytest.approx(3 * np.pi)
    assert outcome.turning_rad_s == pytest.approx(0.3 * np.pi)
    assert outcome.wobble_rad == pytest.approx(0, abs=1e-9)
    assert BEHAVIOURS.get('left').obeyed(outcome.motion, Bounds(move_m=0.5, still_m=0.1))


def test_one_lunge_is_no_walk():
    lunge = np.minimum(np.linspace(0, 10, 201), 0.5)
    outcome = phase_outcome(recording(lunge, np.zeros(201), np.zeros(201)))
    assert outcome.along_m == pytest.approx(0.5)
    assert outcome.going_m_s == pytest.approx(0)


def test_a_phase_begins_at_its_own_frame():
    way = np.concatenate([np.zeros(100), np.linspace(0, 1, 101)])
    outcome = phase_outcome(recording(way, np.zeros(201), np.zeros(201)), 100, 200)
    assert outcome.seconds == pytest.approx(5)
    assert outcome.along_m == pytest.approx(1)


@pytest.mark.parametrize(('first', 'last'), [(0, 201), (5, 6), (-1, 50), (200, 100)])
def test_what_is_no_phase_is_refused(first, last):
    with pytest.raises(ValueError, match='phase'):
        phase_outcome(recording(*np.zeros((3, 201))), first, last)


def test_a_fall_and_a_lowered_base_are_seen():
    z = np.linspace(0.1, 0.03, 201)
    outcome = phase_outcome(recording(*np.zeros((3, 201)), z=z, upright=np.linspace(0, 1.2, 201)))
    assert outcome.lowest_up == pytest.approx(np.cos(1.2))
    assert outcome.lowest_m == pytest.approx(0.03)
    assert outcome.motion.height == pytest.approx(0.3)


def test_reversals_are_turning_points_above_the_noise():
    time = np.arange(200) * 0.05
    swing = 0.2 * np.sin(2 * np.pi * 1.6 * time)
    noise = 0.01 * np.sin(2 * np.pi * 7 * time)
    count = reversals(np.stack([swing + noise, noise, np.zeros(200)], -1))
    assert abs(count[0] / (2 * 10) - 1.6) <= 0.1
    assert count[1:].tolist() == [0, 0]
