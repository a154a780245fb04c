"""A word said before moves nothing later: what ends a word, and what targets say of their word."""

from dataclasses import replace

import numpy as np
import pytest

from w2b_core.body_status import BodyStatus, BodyStatusError, mark, marked_epoch
from w2b_core.brain import Brain
from w2b_core.controller import file as controller_file
from w2b_core.sensor_frames import SensorFrame
from w2b_core.status import Level
from w2b_core.vocabulary import Vocabulary

PERIOD_NS = 50_000_000
ROBOT = BodyStatus('physical_twin', 'DISARMED', 'not armed yet', False, 'abc.0', True)
SIM = BodyStatus('quadruped', 'RUNNING', 'following targets', True, 'abc', False, 7)


class Bench:
    """A brain, its clock, and frames that come on time."""

    def __init__(self, command_timeout_s=0.0):
        self.now_s = 100.0
        self.number = 0
        controller = controller_file.load(controller_file.shipped('quadruped_serial'))
        self._joints = {motor.joint: 0.0 for motor in controller.motors}
        self._feet = [s.removeprefix('touch:') for s in controller.sensors
                      if s.startswith('touch:')]
        self.brain = Brain(controller, Vocabulary.load(), frame_timeout_s=0.5,
                           clock=lambda: self.now_s, command_timeout_s=command_timeout_s)

    def frames(self, count, skipped=0):
        self.number += skipped
        self.now_s += 0.05 * skipped
        for _ in range(count):
            self.number += 1
            self.now_s += 0.05
            targets = self.brain.sense(SensorFrame(
                self.number * PERIOD_NS, self._joints, dict.fromkeys(self._feet, True)))
        return targets

    def walks(self):
        return self.frames(20).word_epoch is not None

    def stands(self):
        targets = self.frames(3)
        return targets.word_epoch is None and not np.any(targets.position_rad)


@pytest.fixture
def bench():
    return Bench()


@pytest.mark.parametrize('state', ['ARMING', 'PARK', 'FAULT', 'DISARMED', 'INACTIVE'])
def test_a_new_epoch_of_the_body_ends_the_word(bench, state):
    bench.brain.body(ROBOT)
    answer = bench.brain.hear('forward')
    assert bench.walks()
    bench.brain.body(replace(ROBOT, state=state, reason='because', epoch='abc.1'))
    assert bench.stands()
    said = bench.brain.stopped()
    assert (said.level, said.received, said.heard) == (Level.WARN, answer.received, 'forward')
    assert said.message == (f'standing: the body is {state} (because) since the last word: '
                            'say it again to go on')
    assert bench.brain.stopped() is None, 'told once'
    assert bench.brain.command_status().message == said.message
    bench.brain.hear('forward')
    assert bench.walks()


def test_the_same_epoch_in_another_state_ends_nothing(bench):
    bench.brain.body(replace(ROBOT, state='ACTIVE', epoch='abc.1'))
    bench.brain.hear('forward')
    bench.brain.body(replace(ROBOT, state='HOLD', follows=False, epoch='abc.1'))
    assert bench.walks()


def test_a_restarted_body_is_another_epoch_whatever_its_count(bench):
    bench.brain.body(replace(ROBOT, epoch='abc.3'))
    bench.brain.hear('forward')
    bench.brain.body(replace(ROBOT, epoch='def.3'))
    assert bench.stands()


@pytest.mark.parametrize(('age_s', 'walks'), [(0.9, False), (1.1, True)])
@pytest.mark.parametrize(('status', 'known'), [(ROBOT, True), (ROBOT, False), (SIM, True)])
def test_a_word_counts_if_it_was_said_since_the_epoch_began(bench, status, known, age_s, walks):
    if known:
        bench.brain.body(replace(status, epoch='earlier'))
    bench.brain.hear('forward')
    assert bench.walks()
    bench.brain.body(replace(status, epoch_age_s=age_s))
    assert bench.frames(1).word_epoch == (status.epoch if walks else None)
    assert bench.walks() is walks


def test_the_first_simulation_there_is_may_start_more_slowly_than_its_brain(bench):
    bench.brain.hear('forward')
    bench.brain.body(SIM)
    assert bench.walks()
    bench.brain.body(replace(SIM, epoch='another'))
    assert bench.stands()


def test_frames_that_were_missing_for_long_end_the_word(bench):
    bench.brain.hear('forward')
    bench.frames(20)
    bench.now_s -= 1.0
    assert bench.frames(1, skipped=20).word_epoch is not None, 'they were not missed in real time'
    assert bench.frames(1, skipped=8).word_epoch is not None, 'a short gap is borne'
    assert bench.frames(1, skipped=20).word_epoch is None
    assert 'missing for 1.1 s' in bench.brain.command_status().message
    assert bench.stands()


def test_a_word_lasts_for_the_timeout_and_is_renewed_by_itself():
    bench = Bench(command_timeout_s=2.0)
    bench.brain.hear('forward')
    assert bench.frames(39).word_epoch is not None
    bench.brain.hear('forward')
    assert bench.frames(39).word_epoch is not None
    assert bench.frames(3).word_epoch is None
    assert bench.stands()
    assert '2 s ago' in bench.brain.stopped().message


def test_a_word_ends_after_its_time_though_no_frames_come():
    bench = Bench(command_timeout_s=2.0)
    bench.brain.hear('forward')
    bench.now_s += 1.9
    bench.brain.end_old_word()
    assert bench.brain.stopped() is None
    bench.now_s += 0.2
    bench.brain.end_old_word()
    assert '2 s ago' in bench.brain.stopped().message
    assert bench.brain.command_status().message.startswith('standing')


def test_targets_name_the_epoch_of_their_word(bench):
    assert mark(bench.frames(1).word_epoch) == 'standing'
    bench.brain.hear('forward')
    assert marked_epoch(mark(bench.frames(1).word_epoch)) == ''
    bench.brain.body(replace(SIM, epoch_age_s=9.0))
    assert marked_epoch(mark(bench.frames(1).word_epoch)) == 'abc'
    assert marked_epoch('standing') is None
    assert marked_epoch('') is None


@pytest.mark.parametrize('status', [ROBOT, SIM])
def test_a_status_is_read_back_as_it_was(status):
    assert BodyStatus.from_values(status.to_status('node').values) == status


@pytest.mark.parametrize(('change', 'reason'), [
    ({'epoch': ''}, 'epoch: expected letters'), ({'epoch': 'a b'}, 'epoch: expected letters'),
    ({'follows': 'yes'}, "follows: expected true or false, got 'yes'"),
    ({'accepted_stamp_ns': '1e9'}, 'accepted_stamp_ns: expected'), ({'body': None}, "'body'"),
    ({'epoch_age_s': 'nan'}, 'epoch_age_s: expected seconds')])
def test_a_strangers_status_is_refused_with_the_reason(change, reason):
    values = {**SIM.to_status('node').values, **change}
    with pytest.raises(BodyStatusError, match=reason):
        BodyStatus.from_values({key: value for key, value in values.items() if value is not None})
