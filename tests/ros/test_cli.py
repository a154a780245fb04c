"""`w2b` on a running graph: what it does to body and brain, and its exit codes."""

import json

import pytest
import yaml

from tests.ros.hardware import HardwareSystem
from w2b_sim.sim_logic import first_stamp_ns


def w2b(system, *arguments, deadline_s=60.0):
    """Run the installed `w2b` to its end while the test's client goes on listening."""
    process = system.start('w2b', *arguments)
    system.wait(lambda: process.exit_code is not None, f'the end of w2b {arguments}', deadline_s)
    return process


def test_say_reaches_the_brain(walking):
    said = w2b(walking, 'say', 'halt')
    assert said.exit_code == 0
    assert "following 'halt'" in said.log
    refused = w2b(walking, 'say', 'forwrad')
    assert refused.exit_code == 1
    assert "'forward'" in refused.log


def test_pause_and_reset_act_on_the_simulation(walking):
    walking.forget()
    assert w2b(walking, 'pause', 'off').exit_code == 0
    walking.wait(lambda: len(walking.positions_m) > 5, 'frames of a simulation that runs')
    paused = w2b(walking, 'pause')
    assert paused.exit_code == 0
    assert 'paused' in paused.log
    done = w2b(walking, 'reset')
    assert done.exit_code == 0
    walking.forget_before(first_stamp_ns(done.log))
    assert w2b(walking, 'pause', 'off').exit_code == 0
    walking.wait(lambda: walking.positions_m, 'a frame of the new start')
    first_ns = min(walking.positions_m)
    assert first_ns == first_stamp_ns(done.log)
    walking.pause(True)


def test_status_tells_of_body_and_brain(walking):
    walking.wait(lambda: 'brain: frames' in walking.statuses, 'diagnostics of the brain')
    # Of a paused simulation no frame comes, and the brain says so.
    done = w2b(walking, 'status')
    assert done.exit_code == 1, done.log
    assert 'ERROR    brain: frames: no sensor frames' in done.log
    assert 'ok       sim: clock: lockstep, paused' in done.log
    walking.pause(False)
    walking.wait(lambda: walking.statuses['brain: frames'].level[0] == 0, 'frames at the brain')
    done = w2b(walking, 'status', '--json')
    assert done.exit_code == 0, done.log
    parts = {part['name']: part for part in map(json.loads, done.log.splitlines())}
    assert parts['sim: clock']['message'] == 'lockstep'
    assert parts['brain: frames']['hardware_id'] == 'quadruped'
    walking.pause(True)


def test_echo_prints_messages_as_yaml(walking):
    done = w2b(walking, 'echo', 'command_answer', '--count', '1')
    assert done.exit_code == 0, done.log
    message, = (part for part in yaml.safe_load_all(done.log) if part)
    assert {value['key'] for value in message['values']} >= {'received', 'text'}
    done = w2b(walking, 'echo', '/diagnostics', '--count', '2')
    assert len([part for part in yaml.safe_load_all(done.log) if part]) == 2


@pytest.mark.parametrize(('arguments', 'expected'), [
    (['arm'], 'w2b hardware'), (['disarm'], 'w2b hardware'), (['stop'], 'w2b relax'),
    (['reset'], 'w2b sim'), (['pause'], 'w2b sim'), (['status'], 'w2b brain'),
    (['say', 'stop'], 'w2b brain'), (['echo', 'no_such_topic'], 'expected a publisher on /no_suc')])
def test_with_nobody_there_one_line_says_what_to_do(system, arguments, expected):
    done = w2b(system, *arguments, '--timeout', '0.3')
    assert done.exit_code == 2
    assert done.log.startswith('error: ')
    assert done.log.count('\n') == 1
    assert expected in done.log


def test_the_robot_is_armed_and_stopped(system, tmp_path):
    robot = HardwareSystem(system, tmp_path)
    try:
        robot.wait_for_frames()
        refused = w2b(system, 'arm')
        assert refused.exit_code == 1
        assert 'no fresh targets' in refused.log
        assert robot.off()
        robot.answering = True
        robot.spin(1.0)
        armed = w2b(system, 'arm')
        assert armed.exit_code == 0, armed.log
        robot.wait_for_state('ACTIVE')
        assert not robot.off()
        stopped = w2b(system, 'stop')
        assert stopped.exit_code == 0
        robot.wait_until_off()
    finally:
        robot.close()
