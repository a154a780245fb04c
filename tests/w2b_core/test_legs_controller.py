"""Controllers of version 2, an ear and legs: their files, and the brain that has one."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from tests.w2b_core.legs_controller import SENSES, controller
from w2b_core.brain import Brain
from w2b_core.controller import file as cf
from w2b_core.courses import Course
from w2b_core.hearing.heard import Heard
from w2b_core.mind import mind_of
from w2b_core.network import LeakyNetwork, leaky
from w2b_core.senses import Readings, Reference
from w2b_core.senses import read as read_senses
from w2b_core.status import Level
from w2b_core.vocabulary import Vocabulary

PERIOD_NS = 50_000_000


@pytest.fixture
def brain(vocabulary):
    return Brain(controller(), vocabulary, frame_timeout_s=0.5, clock=lambda: 0.0)


def upright(heading_rad):
    return (0.0, 0.0, math.sin(heading_rad / 2), math.cos(heading_rad / 2))


def frame(brain, number, heading_rad=0.0, yaw_rate_rad_s=0.0, orientation=None):
    joints = brain.controller.joints
    stamp_ns = number * PERIOD_NS
    assert brain.imu(stamp_ns, orientation or upright(heading_rad),
                     (0.0, 0.0, yaw_rate_rad_s)) is None
    return brain.joint_states(stamp_ns, joints, [0.0] * len(joints))


def test_what_is_written_is_read_again_to_the_bit(tmp_path):
    written = controller()
    path = tmp_path / 'legs.json'
    cf.save(written, path)
    assert path.stat().st_size < 200_000
    again = cf.load(path)
    assert again == written
    assert isinstance(again.network, LeakyNetwork)
    assert again.topics == {'imu/data'}
    assert again != replace(written, network=controller(seed=2).network)


def test_legs_without_senses_are_read_again(tmp_path):
    written = controller(senses=())
    cf.save(written, tmp_path / 'blind.json')
    assert cf.load(tmp_path / 'blind.json') == written


def damaged(change):
    data = json.loads(cf.dumps(controller()))
    change(data)
    return json.dumps(data)


DAMAGE = {
    'no ear': (lambda data: data.pop('ear'), r'ear: expected a JSON object'),
    'an ear that is none': (lambda data: data.update(ear={}), r'^ear'),
    'a behaviour twice': (lambda data: data['behaviours'][1].update(name='stop'),
                          r'behaviours\[1\]\.name: expected a name not listed before'),
    'other behaviours than the ear': (lambda data: data['behaviours'][0].update(name='halt'),
                                      r'ear\.behaviours: expected those of the controller'),
    'a course of its own': (lambda data: data['behaviours'][1].update(along=0.5),
                            r'behaviours\[1\]: expected along and turn of -1, 0 or 1'),
    'a behaviour less': (lambda data: data['behaviours'].pop(), r'behaviours: expected 6'),
    'a leak of 0': (lambda data: data['network']['hidden_leak'].__setitem__(0, 0.0),
                    r'network\.hidden_leak: expected numbers from 0\.05 to 1'),
    'a row less': (lambda data: data['network']['hidden'].pop(), r'network\.'),
    'a ragged block': (lambda data: data['network']['command'][0].pop(),
                       r'network\.command\[1\]: expected 5 numbers'),
    'an unknown sense': (lambda data: data['network']['sensors'].__setitem__(0, 'smell'),
                         r"network\.sensors\[0\]: sense: expected one of touch:LINK.*got 'smell'"),
    'a sense less': (lambda data: data['network']['sensors'].pop(),
                     r'network\.sensors: expected 3, as the network has, got 2'),
    'another kind': (lambda data: data['network'].update(kind='spiking'),
                     r"network\.kind: expected 'leaky', got 'spiking'"),
    'an unknown block': (lambda data: data['network'].update(bias=[0.0]), r'network\.bias'),
    'limits that leave no angle': (
        lambda data: data['network']['motors'][0].update(upper_rad=-9.0), r'upper_rad'),
}


@pytest.mark.parametrize('what', DAMAGE)
def test_damage_is_named_in_one_line(what):
    change, reason = DAMAGE[what]
    text = damaged(change)
    with pytest.raises(cf.JsonFileError, match=reason) as caught:
        cf.loads(text)
    assert '\n' not in str(caught.value)


def test_before_a_word_it_stands_in_the_middle_of_its_joints(brain):
    middle = brain.controller.targets_rad(np.zeros(len(brain.controller.motors)))
    for number in range(1, 4):
        assert np.array_equal(frame(brain, number, heading_rad=0.1 * number).position_rad, middle)


def test_a_word_drives_the_network_as_it_is_defined(brain):
    """The brain's targets are those of the network, the command and the senses by hand."""
    network = brain.controller.network
    frame(brain, 1)
    answer = brain.hear('forward')
    assert (answer.level, answer.follows) == (Level.OK, 'forward')
    command = np.eye(6)[1]
    state, drive = network.initial_state(), network.drive(command)
    headings = [3.1, 3.2, 3.3, 2.9]  # across +-pi
    for number, heading in enumerate(headings):
        targets = frame(brain, number + 2, heading, yaw_rate_rad_s=0.4)
        # A heading goes through a quaternion, which rounds.
        np.testing.assert_allclose(
            targets.position_rad, brain.controller.targets_rad(state.motors), atol=1e-12)
        felt = read_senses(SENSES, Readings(heading_rad=heading, yaw_rate_rad_s=0.4),
                           Reference(headings[0], 1.0, 1.0))
        state = leaky.step(network, state, drive, felt)
    final = frame(brain, 7, headings[-1])
    np.testing.assert_allclose(final.position_rad, brain.controller.targets_rad(state.motors),
                               atol=1e-12)


def test_what_holds_a_heading_is_what_the_controller_file_says():
    """A robot need not know a behaviour of somebody's own: its course is in the file."""
    plain = controller()
    courses = tuple(Course() if name == 'forward' else course
                    for name, course in zip(plain.behaviours, plain.courses, strict=True))
    minds = [mind_of(plain), mind_of(replace(plain, courses=courses))]
    for mind in minds:
        mind.hear(Heard(command=np.eye(6)[1]))
        for heading in (0.0, 0.4):
            mind.feel(Readings(heading_rad=heading))
    assert not np.array_equal(minds[0].motors, minds[1].motors), 'one of them steers back'


def test_a_new_word_goes_on_from_the_state_and_takes_a_new_heading(brain):
    frame(brain, 1)
    brain.hear('forward')
    for number in range(2, 6):
        frame(brain, number, 0.0)
    frame(brain, 6, 0.0)
    going_on = brain.controller.targets_rad(brain._mind.motors)
    brain.hear('backward')
    assert np.array_equal(frame(brain, 7, 1.5).position_rad, going_on), 'no jump back to standing'
    # The heading of 1.5 rad is the one to hold now, not that of the first word.
    twin = Brain(brain.controller, Vocabulary.load(), frame_timeout_s=0.5, clock=lambda: 0.0)
    for number in range(1, 7):
        frame(twin, number, 0.0)
        if number == 1:
            twin.hear('forward')
    twin.hear('backward')
    frame(twin, 7, 0.0)
    np.testing.assert_allclose(frame(brain, 8, 1.5).position_rad,
                               frame(twin, 8, 0.0).position_rad, atol=1e-12)


def test_an_unheard_word_is_understood_and_the_answer_says_how(brain):
    ear = brain.controller.ear
    frame(brain, 1)
    answer = brain.hear('halt')
    assert 'halt' not in ear.words
    assert (answer.level, answer.follows) == (Level.OK, 'stop')
    assert 'never heard in training' in answer.message
    assert answer.values['trained'] == 'no'
    assert 0.0 < float(answer.values['probability']) <= 1.0
    assert answer.values['nearest']


@pytest.mark.parametrize('text', ['banana', 'do not stop', 'turn', '', 'qwxzv', '\U0001f600',
                                  'a' * 5000, 'not not not'])
def test_a_refused_command_changes_nothing(brain, text):
    frame(brain, 1)
    assert brain.hear('forward').level is Level.OK
    frame(brain, 2)
    doing, motors = brain.command_status().message, brain._mind.motors
    answer = brain.hear(text)
    assert answer.level is Level.ERROR
    assert answer.message
    assert brain.command_status().message == doing
    assert np.array_equal(brain._mind.motors, motors)


@pytest.mark.parametrize('text', ['stop and go', 'go and stop', 'stop forward', 'do not move'])
def test_what_stop_words_address_moves_nothing(brain, text):
    frame(brain, 1)
    assert brain.hear(text).follows == 'stop'


@pytest.mark.parametrize(('orientation', 'reason'), [
    ((math.nan, 0.0, 0.0, 1.0), 'expected finite numbers'),
    ((0.0, 0.0, 0.0, 0.0), 'expected an orientation of unit length'),
    ((0.0, 0.0, 0.0, 2.0), 'expected an orientation of unit length')])
def test_a_damaged_attitude_is_no_frame(brain, orientation, reason):
    frame(brain, 1)
    brain.hear('forward')
    assert frame(brain, 2, orientation=orientation) is None
    assert reason in brain.frames_status().message
    assert brain.frames_status().level is Level.WARN


def test_without_an_orientation_it_does_not_walk(brain):
    brain.hear('forward')
    joints = brain.controller.joints
    assert brain.imu(PERIOD_NS, None, (0.0, 0.0, 0.0)) is None
    assert brain.joint_states(PERIOD_NS, joints, [0.0] * len(joints)) is None
    assert 'no orientation yet' in brain.frames_status().message


def test_an_ear_of_other_vectors_is_refused_with_what_to_do(vocabulary):
    heard = controller()
    other = replace(heard.ear, vectors_sha256='0' * 64)
    with pytest.raises(ValueError, match='python -m training ear --vocabulary'):
        Brain(replace(heard, ear=other), vocabulary, frame_timeout_s=0.5, clock=lambda: 0.0)
