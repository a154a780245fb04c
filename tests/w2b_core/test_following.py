"""Whether a body follows a word: never said unless a body accepted a target of this very word."""

from dataclasses import replace

import numpy as np
import pytest

from w2b_core.body_status import BodyStatus
from w2b_core.brain import Brain
from w2b_core.controller import file as controller_file
from w2b_core.following import BODY_SILENT_S, DISCOVERY_S, Follows
from w2b_core.sensor_frames import SensorFrame
from w2b_core.status import Level
from w2b_core.vocabulary import Vocabulary

PERIOD_NS = 50_000_000
SIM = BodyStatus('quadruped', 'RUNNING', 'following targets', True, 'abc', False, None)


class Bench:
    """A brain, its clock, and a body whose frames and status come on time."""

    def __init__(self, status=SIM):
        self.now_s, self.number, self.status = 100.0, 0, status
        controller = controller_file.load(controller_file.shipped('quadruped_serial'))
        self.joints = {motor.joint: 0.0 for motor in controller.motors}
        self.feet = [sensor.removeprefix('touch:') for sensor in controller.sensors]
        self.brain = Brain(controller, Vocabulary.load(), frame_timeout_s=0.5,
                           clock=lambda: self.now_s)

    def frames(self, count):
        for _ in range(count):
            self.number += 1
            self.now_s += 0.05
            targets = self.brain.sense(SensorFrame(
                self.number * PERIOD_NS, self.joints, dict.fromkeys(self.feet, True)))
        return targets

    def tell(self, **change):
        self.status = replace(self.status, **change)
        self.brain.body(self.status)

    def accept(self):
        self.tell(accepted_stamp_ns=self.number * PERIOD_NS)


@pytest.fixture
def bench():
    bench = Bench()
    bench.frames(3)
    bench.accept()
    return bench


def test_a_body_follows_when_it_accepted_the_first_target_of_the_word(bench):
    bench.brain.hear('forward')
    assert bench.brain.following().follows is Follows.PENDING, 'targets of before do not count'
    bench.frames(1)
    assert bench.brain.following().follows is Follows.PENDING
    bench.accept()
    assert bench.brain.following().follows is Follows.YES
    assert bench.brain.following().reason == ''
    bench.tell(follows=False)
    assert bench.brain.following().reason.endswith('its last target is too old')
    bench.tell(follows=True)
    bench.brain.hear('stop')
    assert bench.brain.following().follows is Follows.PENDING, 'that was the word before'


@pytest.mark.parametrize(('state', 'needs_arming', 'todo'), [
    ('DISARMED', True, 'arm it'), ('FAULT', True, 'arm it'), ('INACTIVE', True, 'arm it'),
    ('PAUSED', False, '~/pause')])
def test_a_body_that_waits_for_a_person_does_not_follow(bench, state, needs_arming, todo):
    bench.tell(state=state, reason='because', follows=False, needs_arming=needs_arming)
    bench.brain.hear('forward')
    bench.frames(1)
    following = bench.brain.following()
    assert following.follows is Follows.NO
    assert f'quadruped is {state} (because)' in following.reason
    assert todo in following.reason
    answer = bench.brain.with_following(bench.brain.hear('forward'))
    assert 'no body follows: the body quadruped is' in answer.message
    assert (answer.values['body_follows'], answer.values['body_state']) == ('false', state)


def test_a_body_that_has_gone_follows_no_more_whatever_it_said_last(bench):
    bench.brain.hear('forward')
    bench.frames(1)
    bench.accept()
    bench.now_s += BODY_SILENT_S + DISCOVERY_S
    assert bench.brain.following(body_there=True).follows is not Follows.YES
    following = bench.brain.following(body_there=False)
    assert following.follows is Follows.NO
    assert 'no body is there: start one with' in following.reason


def test_without_any_body_nothing_follows():
    bench = Bench()
    bench.brain.hear('forward')
    assert bench.brain.following(body_there=False).follows is Follows.PENDING, 'too early'
    bench.now_s += DISCOVERY_S
    assert bench.brain.following(body_there=False).follows is Follows.NO


def test_a_body_with_other_joints_follows_nothing_though_it_runs():
    bench = Bench(replace(SIM, body='minimal', follows=False))
    bench.brain.body(bench.status)
    bench.brain.hear('forward')
    bench.brain.joint_states(PERIOD_NS, ['hinge'], [0.0])
    following = bench.brain.following()
    assert following.follows is Follows.NO
    assert 'the controller is for quadruped' in following.reason


def test_a_change_is_told_once_and_only_of_the_last_command(bench):
    first = bench.brain.with_following(bench.brain.hear('forward'))
    assert first.values['body_follows'] == 'pending'
    assert bench.brain.news() is None
    bench.frames(1)
    bench.accept()
    told = bench.brain.news()
    assert (told.received, told.values['body_follows']) == (first.received, 'true')
    assert bench.brain.news() is None
    bench.tell(state='PAUSED', follows=False)
    assert bench.brain.news().values['body_follows'] == 'false'
    bench.brain.hear('qwxzv')
    bench.tell(state='RUNNING', follows=True)
    assert bench.brain.news() is None, 'the refusal is the last answer'


def test_the_answer_to_a_word_that_ended_says_that_nothing_follows(bench):
    bench.brain.hear('forward')
    bench.frames(1)
    bench.accept()
    bench.tell(epoch='def')
    stopped = bench.brain.stopped()
    assert (stopped.level, stopped.values['body_follows']) == (Level.WARN, 'false')
    assert 'since the last word' in stopped.values['why_not']


def test_the_same_words_again_do_not_start_the_gait_again(bench):
    other = Bench()
    for one in (bench, other):
        one.brain.hear('forward')
        one.frames(25)
    again = bench.brain.hear('Forward!')
    assert again.repeated
    assert again.received == 2
    for _ in range(10):
        assert np.array_equal(bench.frames(1).position_rad, other.frames(1).position_rad)
    assert not bench.brain.hear('backward').repeated
    assert not bench.brain.hear('forward').repeated, 'another word came in between'
    bench.tell(epoch='def')
    assert not bench.brain.hear('forward').repeated, 'the word had ended'


def test_a_paused_simulation_is_no_error_and_a_dead_one_is(bench):
    bench.tell(state='PAUSED', follows=False)
    for _ in range(20):
        bench.now_s += 0.2
        bench.brain.body(bench.status)
    status = bench.brain.frames_status()
    assert (status.level, status.message) == (Level.OK, 'the body is paused')
    bench.now_s += BODY_SILENT_S + 0.1
    assert bench.brain.frames_status().level is Level.ERROR


def test_another_joint_stops_nothing(bench):
    joints = [*bench.joints, 'pan_joint']
    bench.brain.hear('forward')
    for number in range(10, 20):
        stamp = number * PERIOD_NS
        bench.brain.contacts(stamp, [*bench.feet, 'tail'], [1.0] * 4 + [0.5])
        assert bench.brain.joint_states(stamp, joints, [0.0] * 8 + [float('nan')]) is not None
        assert bench.brain.joint_states(stamp, ['pan_joint', 'pan_joint'], [0.0, 1.0]) is None
    assert bench.brain.frames_status().level is Level.OK
    bench.brain.joint_states(21 * PERIOD_NS, joints[1:], [0.0] * 8)
    assert bench.brain.frames_status().message == f'ignored: joint_states: {joints[0]} missing'
