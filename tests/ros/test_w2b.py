"""The command `w2b` against running nodes: services, status, topics, exit codes."""

import pytest
import yaml


def w2b(system, *arguments, code=0):
    process = system.start('w2b', *arguments)
    assert process.wait() == code, process.log
    return process.log


def test_a_simulation_is_paused_reset_and_stopped(system):
    system.start('sim')
    system.start('brain')
    system.wait_for_brain()
    assert 'following' in w2b(system, 'say', 'forward')
    assert 'paused' in w2b(system, 'pause')
    assert 'paused' not in w2b(system, 'pause', '--off')
    assert 'at the start' in w2b(system, 'reset')
    assert 'paused' in w2b(system, 'stop')
    frames = len(system.positions_m)
    system.spin_for(0.5)
    assert len(system.positions_m) <= frames + 1, 'nothing moves after an emergency stop'


def test_hardware_is_armed_stopped_and_disarmed(robot):
    robot.start(auto_arm=False)
    system = robot.system
    assert 'hardware: body' in w2b(system, 'status', code=1)
    log = w2b(system, 'arm')
    assert log.strip()
    w2b(system, 'stop')
    system.wait(lambda: not any(robot.pulses_us()), 'pulses off')
    w2b(system, 'disarm')


@pytest.mark.parametrize(('arguments', 'reason'), [
    (('arm',), 'no hardware node answers: start one with `w2b hardware`'),
    (('reset',), 'no simulation answers: start one with `w2b sim`'),
    (('stop',), 'neither a hardware node nor a simulation answers'),
    (('echo', 'joint_states'), 'nobody publishes on /joint_states'),
    (('echo', 'a//b'), 'a//b'),
])
def test_where_nobody_answers_it_says_so_in_a_line(system, arguments, reason):
    log = w2b(system, *arguments, '--timeout', '0.5', code=2)
    assert reason in log
    assert len(log.strip().splitlines()) == 1


def test_echo_prints_yaml(system):
    system.start('sim')
    log = w2b(system, 'echo', 'joint_states', '--count', '1')
    message = yaml.safe_load(log.partition('---')[0])
    assert len(message['name']) == len(message['position']) == 8
    latched = w2b(system, 'echo', 'body_status', '--count', '1')
    assert 'quadruped' in latched


def test_a_robot_in_a_namespace_is_asked_by_it(system):
    system.start('sim', '--ros-args', '-r', '__ns:=/dog1')
    assert 'paused' in w2b(system, 'pause', '--ns', '/dog1')
    assert 'no simulation' in w2b(system, 'pause', '--timeout', '0.5', code=2)
