"""The simulated robot behind the sim node: lockstep, pacing, pause, reset, and what it refuses."""

import math

import numpy as np
import pytest

from w2b_core import bodies
from w2b_core.status import Level
from w2b_sim.engines.interface import Start
from w2b_sim.engines.pybullet_engine import PyBulletSimulation
from w2b_sim.sim_logic import WARNING_S, SimulatedRobot
from w2b_sim.worlds import PAPER

BODY = bodies.get('quadruped')
JOINTS = [joint.name for joint in BODY.joints]
PERIOD_NS = 50_000_000


class HandClock:
    """A clock that moves when told to."""

    def __init__(self):
        self.now_s = 100.0

    def __call__(self):
        return self.now_s


@pytest.fixture
def clock():
    return HandClock()


@pytest.fixture
def make(clock):
    simulations = []

    def make_robot(paced=False, pause_after=0, starts=None):
        simulation = PyBulletSimulation(BODY, PAPER)
        simulations.append(simulation)
        queue = iter(starts or [])
        return SimulatedRobot(BODY, simulation, next_start=lambda: next(queue, Start()),
                              period_s=0.05, paced=paced, pause_after=pause_after, clock=clock)
    yield make_robot
    for simulation in simulations:
        simulation.close()


@pytest.fixture
def robot(make):
    return make()


def give(robot, targets=0.0, stamp_ns=None):
    stamp_ns = robot.stamp_ns if stamp_ns is None else stamp_ns
    return robot.take(stamp_ns, JOINTS, [[targets] * len(JOINTS)])


def test_the_first_frame_has_a_stamp_that_is_not_0(robot):
    assert robot.stamp_ns == PERIOD_NS


def test_lockstep_waits_for_the_targets_of_its_frame(robot):
    assert not robot.may_move
    assert give(robot, 0.3)
    assert robot.may_move
    robot.move()
    assert robot.stamp_ns == 2 * PERIOD_NS
    assert (robot.frame.joint_position_rad > 0.005).all()
    assert not robot.may_move


def test_lockstep_takes_the_first_answer_only(robot):
    assert give(robot, 0.3)
    assert not give(robot, -0.3)
    robot.move()
    assert (robot.frame.joint_position_rad > 0.0).all()


def test_joints_are_matched_by_name(robot):
    backwards = list(reversed(JOINTS))
    targets = [0.1 * number for number in range(len(JOINTS))]
    robot.take(robot.stamp_ns, backwards, [targets])
    for _ in range(20):
        robot.move()
    speeds_match = robot.frame.joint_position_rad[::-1]
    assert np.all(np.diff(speeds_match) > 0.0)


@pytest.mark.parametrize(('names', 'points', 'reason'), [
    (JOINTS[:-1], [[0.0] * 7], 'right_knee missing'),
    ([*JOINTS, 'tail'], [[0.0] * 9], 'unexpected tail'),
    ([*JOINTS[:-1], 'tail'], [[0.0] * 8], 'another body'),
    (JOINTS, [[0.0] * 7], '8 names and 7 positions'),
    (JOINTS, [], 'expected 1 point, got 0'),
    (JOINTS, [[0.0] * 8] * 2, 'expected 1 point, got 2'),
    (JOINTS, [[math.nan] * 8], 'finite'),
    (JOINTS, [[math.inf] * 8], 'finite'),
    (JOINTS, [[1.0] * 8], 'got 1.0000'),
    (JOINTS, [[-3.0] * 8], 'got -3.0000'),
])
@pytest.mark.parametrize('paced', [False, True])
def test_wrong_targets_are_refused_with_the_reason(make, paced, names, points, reason):
    robot = make(paced=paced)
    assert not robot.take(robot.stamp_ns, names, points)
    assert not robot.answered
    status = robot.targets_status()
    assert status.level is Level.WARN
    assert reason in status.message
    assert status.values['refused'] == '1'
    if paced:
        robot.move()
        assert np.allclose(robot.frame.joint_position_rad, 0.0, atol=1e-3)


@pytest.mark.parametrize(('offset', 'reason'), [(-1, 'stale'), (1, 'future')])
def test_targets_for_another_frame_are_refused(robot, offset, reason):
    give(robot)
    robot.move()
    assert not give(robot, stamp_ns=robot.stamp_ns + offset * PERIOD_NS)
    assert reason in robot.targets_status().message
    assert not robot.may_move


def test_a_refusal_is_forgotten_after_a_while(robot, clock):
    give(robot, stamp_ns=1)
    clock.now_s += WARNING_S / 2
    give(robot)
    assert robot.targets_status().level is Level.WARN
    clock.now_s += WARNING_S / 2 + 0.01
    assert robot.targets_status().level is Level.OK


def test_paced_moves_without_targets_and_holds_its_pose(make, clock):
    robot = make(paced=True)
    start = robot.frame.position_m
    for _ in range(20):
        assert robot.may_move
        robot.move()
    assert np.allclose(robot.frame.position_m[:2], start[:2], atol=1e-3)
    clock.now_s += WARNING_S + 0.1
    status = robot.targets_status()
    assert (status.level, status.message) == (
        Level.WARN, 'no targets: the body holds its last targets')


def test_paced_takes_an_answer_that_is_a_little_late_but_no_older_one_after_it(make):
    robot = make(paced=True)
    for _ in range(4):
        robot.move()
    assert give(robot, 0.2, robot.stamp_ns - PERIOD_NS)
    assert not give(robot, 0.1, robot.stamp_ns - 2 * PERIOD_NS)
    assert give(robot, 0.1)


def test_paced_refuses_an_answer_of_half_a_second_ago(make):
    robot = make(paced=True)
    for _ in range(12):
        robot.move()
    assert not give(robot, 0.2, robot.stamp_ns - 11 * PERIOD_NS)
    assert give(robot, 0.2, robot.stamp_ns - 10 * PERIOD_NS)


@pytest.mark.parametrize('paced', [False, True])
def test_reset_goes_back_to_the_start_while_time_goes_on(make, paced):
    robot = make(paced=paced, starts=[Start(), Start(height_m=0.1)])
    for _ in range(10):
        give(robot, 0.5)
        robot.move()
    stamp_ns = robot.stamp_ns
    robot.reset()
    assert robot.stamp_ns == stamp_ns + PERIOD_NS
    assert robot.frame.position_m[2] == pytest.approx(BODY.height_m + 0.1)
    assert np.array_equal(robot.frame.joint_position_rad, np.zeros(len(JOINTS)))
    assert not robot.answered
    assert not give(robot, 0.5, stamp_ns), 'an answer from before the reset'
    assert give(robot, 0.5)


def test_a_paused_body_does_not_move_and_keeps_the_answer_it_got(robot):
    robot.pause(True)
    assert give(robot, 0.3)
    assert not robot.may_move
    robot.pause(False)
    assert robot.may_move


def test_no_warning_of_missing_targets_while_paused(robot, clock):
    robot.pause(True)
    clock.now_s += 100.0
    assert robot.targets_status().level is Level.OK
    robot.pause(False)
    assert robot.targets_status().level is Level.OK
    clock.now_s += WARNING_S + 0.1
    assert robot.targets_status().level is Level.WARN


def test_it_pauses_by_itself_after_so_many_frames_of_a_reset(make):
    robot = make(pause_after=3)
    for frames in (2, 3):
        assert not robot.paused
        give(robot)
        robot.move()
        assert robot.clock_status().values['frames_since_reset'] == str(frames)
    assert robot.paused
    assert 'paused' in robot.clock_status().message
    robot.reset()
    assert robot.paused
    robot.pause(False)
    assert not robot.paused
