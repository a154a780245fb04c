"""`say`: waits for the brain's answer, and exits with what became of the word."""

import json
import signal
import subprocess

import pytest


def test_an_accepted_word_exits_with_0_and_prints_the_answer(walking):
    said = walking.say('Forward!')
    assert said.exit_code == 0
    assert "following 'forward'" in said.log
    assert 'nearest in meaning: forward: forward 1.00' in said.log


def test_an_unknown_word_exits_with_1_and_the_nearest_spellings(walking):
    said = walking.say('forwrad')
    assert said.exit_code == 1
    assert "'forwrad'" in said.log
    assert "'forward'" in said.log


def test_json_is_one_line_for_programs(walking):
    said = walking.say('--json', 'halt')
    assert said.exit_code == 0
    answer = json.loads(said.log)
    assert answer['level'] == 0
    assert answer['words'] == 'halt'
    assert answer['hardware_id'] == 'quadruped'
    refused = walking.say('--json', 'qwxzv')
    assert refused.exit_code == 1
    assert json.loads(refused.log)['level'] == 2


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
    console = walking.start('console', '--timeout', '120')
    console.type('forward\nforwrad\nhalt\n')
    walking.wait(lambda: console.exit_code is not None, 'the end of the console')
    assert console.exit_code == 0
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
