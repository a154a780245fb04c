"""The brain without ROS: the shipped controller, the default vocabulary, frames made by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from w2b_core import network
from w2b_core.brain import WARNING_S, Brain
from w2b_core.command import CHARACTERS_SHOWN, quoted
from w2b_core.controller import file as controller_file
from w2b_core.frame_stream import FIRST_FRAME_S
from w2b_core.sensor_frames import SensorFrame
from w2b_core.status import Level
from w2b_core.vocabulary import Vocabulary, VocabularyError

PERIOD_NS = 50_000_000
TIMEOUT_S = 0.5


class HandClock:
    """A clock that moves when told to."""

    def __init__(self):
        self.now_s = 100.0

    def __call__(self):
        return self.now_s


@pytest.fixture(scope='module')
def controller():
    return controller_file.load(controller_file.shipped('quadruped_serial'))


@pytest.fixture
def clock():
    return HandClock()


@pytest.fixture
def brain(controller, vocabulary, clock):
    return Brain(controller, vocabulary, frame_timeout_s=TIMEOUT_S, clock=clock)


@pytest.fixture
def frame(controller):
    joints = {motor.joint: 0.0 for motor in controller.motors}
    feet = [sensor.removeprefix('touch:') for sensor in controller.sensors]

    def make(number, touching=(True, False, True, False)):
        return SensorFrame(number * PERIOD_NS, joints, dict(zip(feet, touching, strict=True)))
    return make


def test_it_stands_before_any_command(brain, frame):
    for number in range(1, 5):
        targets = brain.sense(frame(number))
        assert targets.stamp_ns == number * PERIOD_NS
        assert np.array_equal(targets.position_rad, np.zeros(8))
    assert brain.command_status().message == 'standing: no command yet'


def test_a_command_primes_and_the_targets_are_the_motors_before_each_step(brain, frame, controller,
                                                                         vocabulary):
    assert brain.hear('Forward').level is Level.OK
    state = network.prime(controller.network, vocabulary.vector('forward'))
    for number in range(1, 20):
        touching = (number % 2 == 0, True, False, number % 3 == 0)
        targets = brain.sense(frame(number, touching))
        assert np.array_equal(targets.position_rad, controller.targets_rad(state.motors))
        assert targets.joints == tuple(motor.joint for motor in controller.motors)
        assert targets.period_s == controller.period_s
        state = network.step(controller.network, state, np.array(touching, dtype=float))
    assert np.abs(state.motors).max() > 0.5, 'it moves'


def test_several_words_are_heard_one_after_the_other(brain, frame, controller, vocabulary):
    answer = brain.hear('go stop')
    assert answer.values['words'] == 'go, stop'
    signal = np.concatenate([vocabulary.vector('go'), vocabulary.vector('stop')])
    state = network.prime(controller.network, signal)
    brain.sense(frame(1, (False,) * 4))
    state = network.step(controller.network, state, np.zeros(4))
    assert np.array_equal(brain.sense(frame(2)).position_rad, controller.targets_rad(state.motors))


def test_a_new_word_in_mid_motion_starts_from_its_own_priming(controller, vocabulary, frame,
                                                              clock):
    old = Brain(controller, vocabulary, frame_timeout_s=TIMEOUT_S, clock=clock)
    new = Brain(controller, vocabulary, frame_timeout_s=TIMEOUT_S, clock=clock)
    old.hear('forward')
    for number in range(1, 30):
        old.sense(frame(number))
    for brain in (old, new):
        brain.hear('backward')
    for number in range(30, 50):
        assert np.array_equal(old.sense(frame(number)).position_rad,
                              new.sense(frame(number)).position_rad)


@pytest.mark.parametrize(('text', 'reason'), [
    ('', 'empty command'), ('   ', 'empty command'), ('?!', 'empty command'),
    ('qwxzv', "unknown word 'qwxzv'"), ('forward qwxzv', "unknown word 'qwxzv'"),
    ('forwrad', "'forward'"), ('word ' * 200_000, 'too long'), ('a ' * 17, 'at most 16 words'),
    ('\ufffd\ufffdforward', 'UTF-8'),
])
def test_a_refused_command_changes_nothing_but_the_answer(controller, vocabulary, frame, clock,
                                                          text, reason):
    told, left = (Brain(controller, vocabulary, frame_timeout_s=TIMEOUT_S, clock=clock)
                  for _ in range(2))
    for brain in (told, left):
        brain.hear('forward')
    for number in range(1, 10):
        told.sense(frame(number))
        left.sense(frame(number))
    answer = told.hear(text)
    assert answer.level is Level.ERROR
    assert reason in answer.message
    assert '\n' not in answer.message
    assert max(len(answer.message), len(answer.heard)) <= CHARACTERS_SHOWN
    assert answer.received == 2
    assert told.command_status().message == "following 'forward'"
    for number in range(10, 30):
        assert np.array_equal(told.sense(frame(number)).position_rad,
                              left.sense(frame(number)).position_rad)


def test_an_unknown_word_is_answered_with_suggestions(brain):
    answer = brain.hear('forwrad')
    assert answer.values['unknown'] == 'forwrad'
    assert answer.values['suggestions'].split(', ')[0] == 'forward'


def test_an_accepted_word_is_answered_with_the_nearest_trained_words(brain):
    answer = brain.hear('halt')
    assert (answer.level, answer.received, answer.heard) == (Level.OK, 1, 'halt')
    assert 'never heard in training: halt' in answer.message
    word, nearest = answer.values['nearest'].split(': ')
    assert word == 'halt'
    assert float(nearest.split(', ')[0].split()[1]) > 0.5
    assert '26,423 words' in answer.values['vocabulary']
    assert 'never heard' not in brain.hear('stop').message


def test_a_word_like_no_trained_one_is_followed_with_a_note(brain):
    answer = brain.hear('banana')
    assert answer.level is Level.OK
    nearest = answer.values['nearest'].removeprefix('banana: ').split(', ')[0]
    assert f'nothing like banana was trained (nearest: {nearest})' in answer.message
    assert 'nothing like' not in brain.hear('halt').message
    assert 'nothing like' not in brain.hear('forward').message


def test_trained_words_are_known_by_the_vocabularys_spelling(controller, vocabulary, clock):
    shouted = replace(controller, words=tuple(
        replace(word, word=word.word.upper()) for word in controller.words))
    brain = Brain(shouted, vocabulary, frame_timeout_s=TIMEOUT_S, clock=clock)
    answer = brain.hear('forward')
    assert 'never heard' not in answer.message
    assert answer.values['nearest'].startswith('forward: forward 1.00')


def test_a_vocabulary_with_other_vectors_is_followed_with_a_warning(controller, clock):
    brain = Brain(controller, Vocabulary.load(scale=0.5), frame_timeout_s=TIMEOUT_S, clock=clock)
    answer = brain.hear('forward')
    assert answer.level is Level.WARN
    assert 'not those of the training' in answer.message
    assert brain.command_status().level is Level.WARN


def test_vectors_of_another_length_are_refused(controller, clock):
    short = Vocabulary('short', ['forward'], np.ones((1, 20), dtype=np.float32))
    with pytest.raises(VocabularyError, match=r'expected vectors of length 300.* got 20'):
        Brain(controller, short, frame_timeout_s=TIMEOUT_S, clock=clock)


def test_a_repeated_frame_gets_the_same_targets_and_does_not_step_the_network(brain, frame,
                                                                              controller):
    brain.hear('forward')
    first = brain.sense(frame(1))
    assert brain.sense(frame(1)) is first
    second = brain.sense(frame(2))
    other = Brain(controller, Vocabulary.load(), frame_timeout_s=TIMEOUT_S, clock=HandClock())
    other.hear('forward')
    other.sense(frame(1))
    assert np.array_equal(second.position_rad, other.sense(frame(2)).position_rad)


def test_stale_frames_get_no_answer_and_a_warning_that_passes(brain, frame, clock):
    brain.sense(frame(10))
    assert brain.sense(frame(9)) is None
    status = brain.frames_status()
    assert status.level is Level.WARN
    assert 'older than the last frame' in status.message
    assert (status.values['stale'], status.values['answered']) == ('1', '1')
    clock.now_s += WARNING_S + 0.1
    brain.sense(frame(11))
    assert brain.frames_status().level is Level.OK


def test_before_the_first_frame_it_waits_and_then_it_is_an_error(brain, frame, clock):
    clock.now_s += TIMEOUT_S + FIRST_FRAME_S
    status = brain.frames_status()
    assert (status.level, status.message) == (Level.OK, 'waiting for the first sensor frame')
    clock.now_s += 0.1
    status = brain.frames_status()
    assert (status.level, status.message) == (Level.ERROR, 'no sensor frames')
    brain.sense(frame(1))
    status = brain.frames_status()
    assert (status.level, status.message) == (Level.OK, 'sensor frames flow')


def test_malformed_frames_get_no_answer_and_do_not_count_as_frames(brain, controller, clock):
    joints = [motor.joint for motor in controller.motors]
    assert brain.joint_states(PERIOD_NS, joints, [math.nan] * 8) is None
    assert brain.joint_states(PERIOD_NS, joints[1:], [0.0] * 7) is None
    status = brain.frames_status()
    assert status.level is Level.WARN
    assert status.message == f'ignored: joint_states: {joints[0]} missing'
    clock.now_s += TIMEOUT_S + FIRST_FRAME_S + 0.1
    status = brain.frames_status()
    assert status.level is Level.ERROR
    assert status.message == f'no sensor frames; ignored: joint_states: {joints[0]} missing'
    assert status.values['malformed'] == '2'


def test_frames_without_their_contacts_are_diagnosed(brain, controller, clock):
    brain.joint_states(PERIOD_NS, [motor.joint for motor in controller.motors], [0.0] * 8)
    clock.now_s += TIMEOUT_S + FIRST_FRAME_S + 0.1
    assert brain.frames_status().message == 'no sensor frames; contacts do not come'


def test_messages_of_one_stamp_make_a_frame(brain, controller):
    joints = [motor.joint for motor in controller.motors]
    feet = [sensor.removeprefix('touch:') for sensor in controller.sensors]
    assert brain.uses_contacts
    assert brain.joint_states(PERIOD_NS, joints, [0.0] * 8) is None
    assert brain.contacts(PERIOD_NS, feet, [0.0] * 4).stamp_ns == PERIOD_NS


def test_the_frames_of_another_body_are_an_error_until_the_right_one_comes(brain, frame):
    assert brain.joint_states(PERIOD_NS, ['hinge'], [0.0]) is None
    status = brain.frames_status()
    assert status.level is Level.ERROR
    assert 'the controller is for quadruped: start both with the same body' in status.message
    assert brain.sense(frame(2)) is not None
    assert brain.frames_status().level is Level.OK


def test_lost_frames_are_an_error_and_the_command_survives_the_gap(brain, frame, clock):
    brain.hear('forward')
    for number in range(1, 20):
        brain.sense(frame(number))
    clock.now_s += TIMEOUT_S + 0.1
    assert brain.frames_status().level is Level.ERROR
    assert brain.frames_status().message == 'no sensor frames'
    assert np.abs(brain.sense(frame(20)).position_rad).max() > 0.1
    assert brain.frames_status().level is Level.OK


def test_a_stream_that_starts_over_makes_it_stand_until_the_next_command(brain, frame, clock):
    brain.hear('forward')
    for number in range(100, 120):
        brain.sense(frame(number))
    clock.now_s += TIMEOUT_S + 0.1
    for number in (1, 2, 3):
        assert np.array_equal(brain.sense(frame(number)).position_rad, np.zeros(8))
    assert brain.command_status().message == 'standing: the sensor frames started over'
    assert brain.frames_status().values['restarts'] == '1'
    brain.hear('forward')
    assert brain.command_status().message == "following 'forward'"


@pytest.mark.parametrize(('text', 'shown'), [
    ('forward', 'forward'), ('a\nb\x1b[2J', 'a b [2J'), ('x' * 400, 'x' * 299 + '…')])
def test_text_is_shown_on_one_line_and_cut(text, shown):
    assert quoted(text) == shown


JOINTS = [motor.joint for motor in
          controller_file.load(controller_file.shipped('quadruped_serial')).motors]
FEET = [sensor.removeprefix('touch:') for sensor in
        controller_file.load(controller_file.shipped('quadruped_serial')).sensors]
STAMPS = st.one_of(st.integers(-2**33, 2**63 - 1), st.integers(1, 40).map(PERIOD_NS.__mul__))
NUMBERS = st.one_of(st.floats(), st.sampled_from([0.0, 1.0]))
EVENTS = st.one_of(
    st.tuples(st.just('hear'), st.one_of(st.text(max_size=20), st.sampled_from(
        ['forward', 'stop', 'halt', 'backward forward']))),
    st.tuples(st.just('wait'), st.floats(0.0, 1.0)),
    st.tuples(st.just('joint_states'), STAMPS, st.permutations(JOINTS),
              st.lists(NUMBERS, min_size=8, max_size=8)),
    st.tuples(st.just('contacts'), STAMPS, st.permutations(FEET),
              st.lists(st.sampled_from([0.0, 1.0]), min_size=4, max_size=4)),
    st.tuples(st.sampled_from(['joint_states', 'contacts']), STAMPS,
              st.lists(st.sampled_from([*JOINTS, *FEET, '', 'tail']), max_size=9),
              st.lists(NUMBERS, max_size=9)))


@settings(max_examples=150, deadline=None)
@given(st.lists(EVENTS, max_size=40))
def test_no_sequence_of_inputs_raises_or_gives_targets_outside_the_limits(events):
    clock = HandClock()
    controller = controller_file.load(controller_file.shipped('quadruped_serial'))
    brain = Brain(controller, Vocabulary.load(), frame_timeout_s=TIMEOUT_S, clock=clock)
    lower = [motor.lower_rad for motor in controller.motors]
    upper = [motor.upper_rad for motor in controller.motors]
    for kind, *values in events:
        targets = None
        if kind == 'hear':
            brain.hear(values[0])
        elif kind == 'wait':
            clock.now_s += values[0]
        else:
            targets = getattr(brain, kind)(*values)
        if targets is not None:
            assert targets.stamp_ns == values[0]
            assert np.all((targets.position_rad >= lower) & (targets.position_rad <= upper))
        for status in (brain.frames_status(), brain.command_status()):
            assert '\n' not in status.message
