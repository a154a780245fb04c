"""The judge: its figures, its disturbances, its command, on networks that are known to walk."""

import argparse
import itertools
import json
from dataclasses import replace

import numpy as np
import pytest

from tests.training.judge.prototype import COMMANDS, controller
from training.__main__ import main
from training.judge import command
from training.judge.conditions import Conditions, changed, trials
from training.judge.trial import Plan, obeyed, tour
from w2b_core import bodies
from w2b_core.controller import file as controller_file
from w2b_sim.engines import registry
from w2b_sim.engines.interface import Start
from w2b_sim.recording import Recording
from w2b_sim.walking import ExactImu, Flaws, Phase, walk
from w2b_sim.worlds import EARTH

TWIN = bodies.get('physical_twin')
FIGURES = {'along_m', 'across_m', 'body_lengths_per_s', 'heading_error_deg',
           'worst_heading_error_deg', 'yaw_deg', 'drift_m', 'rhythm_hz', 'fastest_joint_hz',
           'at_speed_limit', 'mean_torque_nm', 'height_m', 'falls', 'lowest_up'}


def judged(name, engine='mujoco', seconds=6.0, starts=1, switch=0.0, only=(), **conditions):
    return command.judge(controller(name), Plan(engine, seconds, switch,
                                                Conditions(**conditions)), starts, only=only)


@pytest.mark.parametrize('engine', ['pybullet', 'mujoco'])
def test_legs_that_walk_do_so_in_both_engines(engine):
    rows = judged('d4_hs_s11', engine)['behaviours']
    for name in ('forward', 'backward'):
        assert rows[name]['body_lengths_per_s'] > 1.1
        assert rows[name]['heading_error_deg'] < 8
        assert rows[name]['rhythm_hz'] == pytest.approx(1.6, abs=0.25)
        assert rows[name]['at_speed_limit'] < 0.05
        assert rows[name]['falls'] == 0
    assert rows['forward']['along_m'] > 0 > rows['backward']['along_m']
    assert rows['left']['yaw_deg'] > 40
    assert rows['right']['yaw_deg'] < -40
    assert rows['stop']['drift_m'] < 0.005
    assert rows['sit']['height_m'] < 0.6 * rows['stop']['height_m']
    assert rows['sit']['mean_torque_nm'] < 0.7 * rows['stop']['mean_torque_nm']


def test_legs_that_vibrate_are_seen_through():
    """Fast in PyBullet, where a vibration of 7 Hz creeps forward; not in MuJoCo."""
    rows = judged('vibrating_s22', seconds=4.0, only=['forward'])['behaviours']
    assert rows['forward']['body_lengths_per_s'] < 0.7
    assert rows['forward']['fastest_joint_hz'] > 5


def test_a_gyroscopes_bias_is_learnt_before_the_word():
    rows = judged('d4_hs_s11', seconds=20.0, only=['forward'], imu_noise=True,
                  gyro_bias_rad_s=0.03)['behaviours']
    assert list(rows) == ['forward']
    # Not learnt it would turn the robot by 34 degrees.
    assert rows['forward']['heading_error_deg'] < 8
    assert rows['forward']['body_lengths_per_s'] > 1.1


def test_without_an_imu_servos_with_false_zeros_turn_the_robot():
    blind = judged('d4_hs_s11', seconds=10.0, only=['forward'], no_imu=True,
                   zeros_rad=0.09)['behaviours']
    seeing = judged('d4_hs_s11', seconds=10.0, only=['forward'], zeros_rad=0.09)['behaviours']
    assert seeing['forward']['heading_error_deg'] < 12
    assert blind['forward']['heading_error_deg'] > seeing['forward']['heading_error_deg']


def test_words_are_switched_in_all_orders_and_obeyed():
    switches = judged('d4_hs_s11', seconds=1.0, switch=3.0)['switches']
    assert switches == {'obeyed': 30, 'of': 30, 'missed': []}


def test_a_tour_has_every_ordered_pair_once():
    names = tour(COMMANDS)
    pairs = list(itertools.pairwise(names))
    assert len(pairs) == len(set(pairs)) == 30
    assert all(first != second for first, second in pairs)


def still(seconds=8.0, **moves):
    """A recording of a twin at rest, changed by functions of time."""
    times = np.arange(round(seconds / 0.05) + 1) * 0.05
    position = np.zeros((len(times), 3))
    position[:, 2] = 0.07
    yaw = np.zeros(len(times))
    for name, function in moves.items():
        if name == 'yaw':
            yaw = function(times)
        else:
            position[:, 'xyz'.index(name)] = function(times)
    turn = np.stack([np.cos(yaw / 2), 0 * yaw, 0 * yaw, np.sin(yaw / 2)], -1)
    joints = np.zeros((len(times), 12))
    return Recording(0.05, position, turn, yaw, joints, joints, np.zeros((len(times), 0)),
                     joints, joints)


def is_obeyed(behaviour, **moves):
    return obeyed(still(**moves), behaviour, 40, 80, 0.12, 0.078)


def test_what_counts_as_obeyed_within_two_seconds():
    def later(times):  # begins to walk 1.5 s after the word, which came at 2 s
        return np.maximum(0, times - 3.5) * 0.15

    assert is_obeyed('stop')
    assert not is_obeyed('forward')
    assert is_obeyed('forward', x=lambda times: 0.15 * times)
    assert not is_obeyed('backward', x=lambda times: 0.15 * times)
    assert is_obeyed('backward', x=lambda times: -0.15 * times)
    assert is_obeyed('forward', x=later)
    assert not is_obeyed('forward', x=lambda times: later(times - 1.0))
    assert not is_obeyed('stop', x=lambda times: 0.15 * times)
    assert is_obeyed('left', yaw=lambda times: 0.3 * times)
    assert not is_obeyed('right', yaw=lambda times: 0.3 * times)
    assert not is_obeyed('left', yaw=lambda times: 0.3 * times, x=lambda times: 0.15 * times)
    assert is_obeyed('sit', z=lambda times: np.full(len(times), 0.03))
    assert not is_obeyed('sit')


def test_it_must_still_be_obeyed_at_the_end():
    assert not is_obeyed('stop', x=lambda times: np.maximum(0, times - 5.5))


def test_disturbances_change_what_they_say():
    heavier = changed(TWIN, 1.2, 0.8)
    assert sum(link.mass_kg for link in heavier.links) == pytest.approx(
        1.2 * sum(link.mass_kg for link in TWIN.links))
    servo = heavier.joints[0].servo
    assert (servo.max_torque_nm, servo.max_speed_up_rad_s) == pytest.approx((0.18 * 0.8, 4.0))
    hard = trials(TWIN, EARTH, Conditions(hard=True), 12)
    assert {trial.world.friction for trial in hard} == {0.4, 1.0}
    assert all(trial.flaws.late and np.abs(trial.flaws.zeros_rad).max() < 0.0873 for trial in hard)
    assert {round(abs(rate), 9) for trial in hard for rate in trial.gyro_bias_rad_s} == {0.01}
    assert len({sum(link.mass_kg for link in trial.body.links) for trial in hard}) == 2
    slippery = trials(TWIN, EARTH, Conditions(hard=True, friction=0.3), 5)
    assert {trial.world.friction for trial in slippery} == {0.3}
    few = trials(TWIN, EARTH, Conditions(hard=True), 3)
    assert [trial.start for trial in few] == [trial.start for trial in hard[:3]]


def test_late_targets_act_a_period_later():
    one = controller('d4_hs_s11')
    heard = command.commands_of(one)['forward']
    logs = []
    for flaws in (Flaws(), Flaws(late=True)):
        simulation = registry.make_simulation('mujoco', TWIN, EARTH, Start(height_m=1.0))
        logs.append(walk(simulation, TWIN, one, [Phase(heard, 6)], period_s=0.05, flaws=flaws))
    moved = [np.abs(log.joint_position_rad).max(axis=1) for log in logs]
    first = [int(np.argmax(path > 1e-3)) for path in moved]
    assert first[1] == first[0] + 1


def test_wrong_zeros_show_at_the_joints():
    one = controller('d4_hs_s11')
    zeros = np.linspace(-0.1, 0.1, 12)
    simulation = registry.make_simulation('mujoco', TWIN, EARTH, Start(height_m=3.0))
    log = walk(simulation, TWIN, one, [Phase(None, 10)], period_s=0.05, imu=ExactImu(),
               flaws=Flaws(zeros_rad=zeros))
    np.testing.assert_allclose(log.joint_position_rad[-1], zeros, atol=2e-3)


def test_the_command_judges_a_serial_controller_and_prints_json(capsys):
    assert main(['judge', 'physical_twin_serial', '--engine', 'mujoco', '--starts', '1',
                 '--seconds', '2', '--json']) == 0
    result = json.loads(capsys.readouterr().out)
    assert set(result['behaviours']) == {'forward', 'backward', 'stop'}
    for row in result['behaviours'].values():
        assert set(row) >= FIGURES
        assert all(isinstance(value, int | float) for value in row.values())
    assert result['switches']['of'] == 0


def test_the_table_says_what_json_says(capsys):
    assert main(['judge', 'physical_twin_serial', '--engine', 'mujoco', '--starts', '1',
                 '--seconds', '1']) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == 'physical_twin_serial: physical_twin in mujoco, 1 starts, 1 s'
    assert [line.split()[0] for line in lines[2:]] == ['forward', 'backward', 'stop']


@pytest.mark.parametrize(('options', 'reason'), [
    (['--starts', '0'], '--starts: expected at least 1, got 0'),
    (['--seconds', '0.2'], '--seconds: expected 1 to 3600, got 0.2'),
    (['--switch', '0.5'], '--switch: expected 1 to 60 seconds, got 0.5'),
    (['--friction', '-1'], '--friction: expected 0 to 10, got -1.0'),
    (['--mass', 'nan'], '--mass: expected 0.1 to 10, got nan'),
    (['--no-imu', '--imu-noise'], '--no-imu: expected no --imu-noise'),
])
def test_what_makes_no_sense_is_refused_in_a_line(options, reason, capsys):
    assert main(['judge', 'physical_twin', *options]) == 2
    assert reason in capsys.readouterr().err


def test_a_missing_controller_is_refused(capsys):
    assert main(['judge', 'nobody.json']) == 2
    assert 'nobody.json' in capsys.readouterr().err


def test_a_controller_of_other_joints_is_refused():
    one = controller_file.load(controller_file.shipped('quadruped_serial'))
    with pytest.raises(ValueError, match='physical_twin: expected a controller of its joints'):
        command.judge(replace(one, body='physical_twin'),
                      Plan('mujoco', 1.0, 0.0, Conditions()), 1)


def test_options_are_those_that_are_promised():
    parser = argparse.ArgumentParser()
    command.add_arguments(parser)
    known = {option for action in parser._actions for option in action.option_strings}
    assert known >= {'--engine', '--starts', '--seconds', '--friction', '--latency', '--zeros-off',
                     '--mass', '--servo', '--imu-noise', '--gyro-bias', '--no-imu', '--hard',
                     '--switch', '--json'}


def test_two_processes_give_what_one_gives():
    one = controller_file.load(controller_file.shipped('physical_twin_serial'))
    plan = Plan('mujoco', 1.0, 0.0, Conditions(imu_noise=True))
    assert command.judge(one, plan, 2, 1) == command.judge(one, plan, 2, 2)
