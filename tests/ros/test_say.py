"""`say`: waits for the brain's answer, and exits with what became of the word."""

import json
import os
import pty
import signal
import subprocess

import pytest

from tests.ros.hardware import HardwareSystem


def test_an_accepted_word_exits_with_0_and_prints_the_answer(walking):
    said = walking.say('--understood', 'Forward!')
    assert said.exit_code == 0
    assert "following 'forward'" in said.log
    assert 'nearest in meaning: forward: forward 1.00' in said.log


def test_an_unknown_word_exits_with_1_and_the_nearest_spellings(walking):
    said = walking.say('forwrad')
    assert said.exit_code == 1
    assert "'forwrad'" in said.log
    assert "'forward'" in said.log


def test_json_is_one_line_for_programs(walking):
    said = walking.say('--json', '--understood', 'halt')
    assert said.exit_code == 0
    answer = json.loads(said.log)
    assert answer['level'] == 0
    assert answer['words'] == 'halt'
    assert answer['hardware_id'] == 'quadruped'
    assert (answer['body_follows'], answer['body_state']) == ('false', 'PAUSED')
    refused = walking.say('--json', 'qwxzv')
    assert refused.exit_code == 1
    assert json.loads(refused.log)['level'] == 2


def test_a_word_that_walks_a_body_exits_with_0(walking):
    walking.pause(False)
    said = walking.say('forward')
    assert said.exit_code == 0, said.log
    assert said.log.startswith("following 'forward'\n")
    answer = json.loads(walking.say('--json', 'forward').log)
    assert (answer['body_follows'], answer['body_state'], answer['why_not']) == (
        'true', 'RUNNING', '')


def test_a_paused_sim_follows_nothing_until_it_goes_on_and_the_answer_says_both(walking):
    said = walking.say('forward')
    assert said.exit_code == 3
    assert 'no body follows: the body quadruped is PAUSED' in said.log
    assert walking.last_answer()[2]['body_follows'] == 'false'
    walking.pause(False)
    walking.wait(lambda: walking.last_answer()[2]['body_follows'] == 'true', 'the answer anew')
    assert walking.last_answer()[2]['received'] == '1'


def test_without_a_body_and_with_another_ones_say_tells_so(system):
    system.start('brain')
    system.wait_for_brain()
    said = system.say('forward')
    assert said.exit_code == 3
    assert 'no body is there' in said.log
    system.start('sim', body='minimal', real_time_factor=1.0)
    system.wait(lambda: system.positions_m, 'a frame')
    said = system.say('forward')
    assert said.exit_code == 3
    assert 'start both with the same body' in said.log


def test_a_disarmed_robot_follows_nothing_and_an_armed_one_does(system, tmp_path):
    robot = HardwareSystem(system, tmp_path)
    try:
        system.start('brain', controller='physical_twin')
        system.wait_for_brain()
        robot.wait_for_frames()
        said = system.say('forward')
        assert said.exit_code == 3
        assert 'physical_twin is DISARMED (not armed yet): arm it' in said.log
        assert system.say('--understood', 'forward').exit_code == 0
        robot.arm()
        # On a busy machine a frame may be late, and the robot rightly disarms.
        while (said := system.say('forward')).exit_code == 3 and robot.off():
            assert 'no body follows: the body physical_twin is' in said.log
            robot.arm()
        assert said.exit_code == 0, said.log
    finally:
        robot.close()


def test_the_same_word_again_and_again_does_not_fill_the_log(walking):
    walking.pause(False)
    assert walking.say('forward').exit_code == 0
    brain = next(process for process in walking.processes if process.name == 'brain')
    before = len(brain.log)
    for _ in range(5):
        assert walking.tell('forward')[0] == 0
    for _ in range(5):
        assert walking.tell('qwxzv')[0] == 2
    walking.wait_for_status('brain: command', 0, "following 'forward'")
    walking.tell('backward')
    walking.wait(lambda: "heard 'backward'" in brain.log[before:], 'the last line')
    lines = [line for line in brain.log[before:].splitlines() if '[brain]: heard ' in line]
    assert [line.split("'")[1] for line in lines] == ['qwxzv', 'backward'], lines


def test_the_console_at_a_terminal_exits_with_0_and_one_with_a_dead_pipe_not(walking):
    walking.pause(False)
    path = f'{walking.install}/w2b_controller/lib/w2b_controller/console'
    master, slave = pty.openpty()
    with subprocess.Popen([path, '--timeout', '60'], stdin=slave, stdout=slave, stderr=slave,
                          env=walking.environment) as console:
        os.close(slave)
        os.write(master, b'qwxzv\n\n')
        while console.poll() is None:
            try:
                os.read(master, 4096)
            except OSError:
                break
        assert console.wait(60) == 0
    os.close(master)


def test_an_empty_word_is_refused(walking):
    said = walking.say('')
    assert said.exit_code == 1
    assert 'empty command' in said.log


def test_without_a_brain_it_says_what_to_start(system):
    said = system.say('forward', '--timeout', '0.5')
    assert said.exit_code == 2
    assert said.log.count('\n') == 1
    assert 'w2b brain' in said.log


def test_an_inactive_brain_does_not_listen(system):
    system.start('brain', autostart=False)
    assert system.brain_state() == 'unconfigured'
    said = system.say('forward', '--timeout', '0.5')
    assert said.exit_code == 2


def test_it_can_be_interrupted(system):
    said = system.start('say', 'forward', '--timeout', '60')
    system.wait(lambda: system.node.count_publishers('command') > 1, 'say at work')
    said.send(signal.SIGINT)
    assert said.wait() == 2
    assert 'interrupted' in said.log


def test_usage_error(system):
    said = system.say()
    assert said.exit_code == 2
    assert 'usage: say' in said.log


def test_the_console_says_each_line_and_shows_the_answers(walking):
    walking.pause(False)
    console = walking.start('console', '--timeout', '120')
    console.type('forward\n\nforwrad\nhalt\n')
    walking.wait(lambda: console.exit_code is not None, 'the end of the console')
    assert console.exit_code == 1, 'one was refused'
    shown = [console.log.index(text)
             for text in ("following 'forward'", "'forwrad'", "following 'halt'")]
    assert shown == sorted(shown)
    walking.wait(lambda: walking.last_answer()[2]['received'] == '3', 'the last answer')


def test_the_console_without_a_brain_says_what_to_start(system):
    console = system.start('console', '--timeout', '0.5')
    console.type('forward\n')
    assert console.wait() == 2
    assert 'w2b brain' in console.log


def say(environment, *arguments, **variables):
    """Run the installed `say` beside no brain."""
    path = f'{environment["W2B_INSTALL"]}/w2b_controller/lib/w2b_controller/say'
    return subprocess.run([path, *arguments], capture_output=True, timeout=120, check=False,
                          env={**environment, **variables})


@pytest.mark.parametrize('seconds', ['nan', '0', '-1', 'inf'])
def test_a_timeout_that_is_none_is_a_usage_error(environment, seconds):
    done = say(environment, 'stop', f'--timeout={seconds}')
    assert done.returncode == 2
    assert b'expected seconds above 0' in done.stderr


def test_bytes_that_are_no_utf_8_are_refused_in_one_line(environment):
    done = say(environment, b'for\xffward')
    assert done.returncode == 1
    assert done.stderr.decode().strip() == 'error: command: expected text in UTF-8, got other bytes'


def test_a_ros_that_cannot_start_is_one_line(environment):
    done = say(environment, 'stop', ROS_DOMAIN_ID='abc')
    assert done.returncode == 2
    assert done.stderr.startswith(b'error: ')
    assert len(done.stderr.strip().splitlines()) == 1
