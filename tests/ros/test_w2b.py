"""The command `w2b` against running nodes: services, status, topics, exit codes."""

import pytest
import yaml

from tests.ros.hardware import HardwareSystem
from w2b_core.shell import w2b_command


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
    last = accepted_stamp_ns(system)
    # Two diagnoses later, which are a second apart, it has taken no other targets.
    for _ in range(2):
        system.statuses.clear()
        system.wait_for_status('sim: clock', 0, 'lockstep, paused')
    assert accepted_stamp_ns(system) == last, 'nothing moves after an emergency stop'


def accepted_stamp_ns(system):
    """Stamp of the last targets that moved the body, as it says itself."""
    message = yaml.safe_load(w2b(system, 'echo', 'body_status', '--count', '1').partition('---')[0])
    values = {value['key']: value['value'] for value in message['values']}
    return int(values['accepted_stamp_ns'])


def test_hardware_is_armed_stopped_and_disarmed(system, tmp_path):
    robot = HardwareSystem(system, tmp_path)
    try:
        robot.wait_for_frames()
        assert 'hardware: body' in w2b(system, 'status', code=1)
        assert 'targets' in w2b(system, 'arm', code=1), 'refused: no brain sends targets'
        system.start('brain', controller='physical_twin_serial')
        system.wait(lambda: system.targets_rad, 'targets')
        assert 'arming' in w2b(system, 'arm')
        system.wait(lambda: robot.state() in ('ARMING', 'ACTIVE'), 'that it arms')
        robot.arm()  # again what a busy machine disarmed meanwhile
        robot.wait_for_state('ACTIVE')
        assert robot.all_driven()
        w2b(system, 'stop')
        robot.wait_until_off()
    finally:
        robot.close()


@pytest.mark.parametrize(('arguments', 'reason'), [
    (('arm',), f'start one with `{w2b_command("hardware")}`'),
    (('reset',), f'start one with `{w2b_command("sim")}`'),
    (('say', 'stop'), f'start one with `{w2b_command("brain")}`'),
    (('status',), 'nobody publishes diagnostics'),
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
