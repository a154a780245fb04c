"""Evaluation in PyBullet: what is logged, its repeatability, processes, bad weights."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from w2b_core import bodies
from w2b_core.network import Network
from w2b_sim.engines.interface import Frame, Start
from w2b_sim.engines.pybullet_engine import PyBulletSimulation
from w2b_sim.engines.pybullet_evaluator import PyBulletEvaluator
from w2b_sim.rollout import rollout, sensor_values, targets_rad
from w2b_sim.worlds import PAPER

SHORT = replace(PAPER, steps=40)
QUADRUPED = bodies.get('quadruped')


def random_networks(count, body=QUADRUPED, seed=0):
    rng = np.random.default_rng(seed)
    joints, sensors = len(body.joints), len(body.sensors)
    return Network(rng.normal(size=(count, 5, 6 + sensors)), rng.normal(size=(count, joints, 5)),
                   np.array([joint.time_constant for joint in body.joints]))


def one(networks, index):
    return Network(networks.hidden_weights[index], networks.motor_weights[index],
                   networks.motor_time_constants)


@pytest.fixture
def signals():
    return np.random.default_rng(1).normal(size=(2, 300)) * 0.17


def test_motor_neurons_span_the_joints_limits():
    lower = [joint.lower_rad for joint in QUADRUPED.joints]
    upper = [joint.upper_rad for joint in QUADRUPED.joints]
    np.testing.assert_allclose(targets_rad(QUADRUPED, np.full(8, -1.0)), lower)
    np.testing.assert_allclose(targets_rad(QUADRUPED, np.full(8, 1.0)), upper)
    np.testing.assert_allclose(targets_rad(QUADRUPED, np.zeros(8)), 0, atol=1e-15)


@pytest.mark.parametrize(('name', 'expected'), [
    ('quadruped', [1, 0, 0, 1]), ('quadruped_blind', []), ('minimal', [1, 0, 0.25]),
    ('spherical_1dof_sensors', [0.25]), ('spherical_1dof_original', [-0.5]),
])
def test_sensors_come_in_the_networks_order(name, expected):
    body = bodies.get(name)
    joints = len(body.joints)
    touching = {'front_lower_leg': True, 'left_lower_leg': False, 'back_lower_leg': False,
                'right_lower_leg': True, 'base_link': True, 'lower_link': False}
    frame = Frame(np.full(joints, 0.25), np.zeros(joints), touching, np.zeros(3), np.zeros(4),
                  np.zeros(3), np.zeros(3))
    np.testing.assert_array_equal(sensor_values(body, frame, np.full(joints, -0.5)), expected)


def test_the_first_motor_command_is_the_middle_of_each_joint(signals):
    """Motors start at 0 and act one step late: nothing moves before the second step."""
    simulation = PyBulletSimulation(QUADRUPED, SHORT)
    log = rollout(simulation, QUADRUPED, one(random_networks(1), 0), signals[0], 4)
    simulation.close()
    np.testing.assert_allclose(log.joint_position_rad[:2], 0, atol=1e-4)
    assert np.abs(log.joint_position_rad[2]).max() > 1e-3


def test_an_evaluation_repeats_itself_bit_for_bit_after_a_reset(signals):
    simulation = PyBulletSimulation(QUADRUPED, SHORT)
    logs = []
    for _ in range(2):
        simulation.reset()
        logs.append(rollout(simulation, QUADRUPED, one(random_networks(1), 0), signals[0], 40))
    other = PyBulletSimulation(QUADRUPED, SHORT)
    logs.append(rollout(other, QUADRUPED, one(random_networks(1), 0), signals[0], 40))
    simulation.close()
    other.close()
    for log in logs[1:]:
        np.testing.assert_array_equal(log.position_m, logs[0].position_m)
        np.testing.assert_array_equal(log.touching, logs[0].touching)


def test_two_processes_give_what_one_gives_and_what_single_rollouts_give(signals):
    networks, starts = random_networks(3), [Start(), Start(0.001, roll_rad=0.005)]
    outcomes = []
    for processes in (1, 2):
        with PyBulletEvaluator(QUADRUPED, SHORT, processes) as evaluator:
            outcomes.append(evaluator.evaluate(networks, signals, starts))
    first, second = outcomes
    assert first.final_position_m.shape == (3, 2, 2, 3)
    assert first.touch_fraction.shape == (3, 2, 2, 4)
    np.testing.assert_array_equal(first.final_position_m, second.final_position_m)
    np.testing.assert_array_equal(first.path_length_m, second.path_length_m)
    simulation = PyBulletSimulation(QUADRUPED, SHORT, starts[1])
    log = rollout(simulation, QUADRUPED, one(networks, 2), signals[1], SHORT.steps)
    simulation.close()
    np.testing.assert_array_equal(first.final_position_m[2, 1, 1], log.position_m[-1])
    assert first.path_length_m[2, 1, 1] == log.path_length_m
    assert first.largest_step_m[2, 1, 1] == log.largest_step_m
    assert not np.array_equal(first.final_position_m[:, :, 0], first.final_position_m[:, :, 1])


def test_weights_that_are_not_finite_fail_alone(signals):
    networks = random_networks(3)
    broken = Network(networks.hidden_weights.copy(), networks.motor_weights,
                     networks.motor_time_constants)
    broken.hidden_weights[1, 0, 0] = np.nan
    with PyBulletEvaluator(QUADRUPED, SHORT) as evaluator:
        whole = evaluator.evaluate(networks, signals, [Start()]).final_position_m
        outcome = evaluator.evaluate(broken, signals, [Start()]).final_position_m
    assert np.isnan(outcome[1]).all()
    np.testing.assert_array_equal(outcome[[0, 2]], whole[[0, 2]])


def test_a_single_controller_without_a_batch_axis_is_refused(signals):
    with PyBulletEvaluator(QUADRUPED, SHORT) as evaluator, \
            pytest.raises(ValueError, match=r'network: expected a batch \(C, H, K\)'):
        evaluator.evaluate(one(random_networks(1), 0), signals, [Start()])


def test_path_and_steps_of_a_log():
    log = rollout(PyBulletSimulation(QUADRUPED, SHORT), QUADRUPED, one(random_networks(1), 0),
                  np.ones(3), 1)
    assert log.position_m.shape == (1, 3)
    assert log.path_length_m == 0
    assert log.largest_step_m == 0


def test_importing_the_engine_prints_nothing():
    done = subprocess.run([sys.executable, '-c', 'import w2b_sim.engines.pybullet_engine'],
                          capture_output=True, text=True, check=True, timeout=120)
    assert done.stdout == done.stderr == ''
