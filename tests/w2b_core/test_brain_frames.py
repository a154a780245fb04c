"""Sensor frames: parts are checked as they arrive and joined by their stamps."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from w2b_core.sensor_frames import (
    WAITING_PARTS,
    FrameAssembler,
    FrameError,
    OtherBodyError,
    SensorFrame,
    named_values,
    shown,
)

JOINTS = ('hip', 'knee')
FEET = ('left_foot', 'right_foot')


@pytest.fixture
def assembler():
    return FrameAssembler(JOINTS, FEET)


def test_parts_of_one_stamp_make_a_frame_in_either_order(assembler):
    assert assembler.joint_states(5, ['hip', 'knee'], [0.1, 0.2]) is None
    frame = assembler.contacts(5, ['left_foot', 'right_foot'], [1.0, 0.0])
    assert frame == SensorFrame(5, {'hip': 0.1, 'knee': 0.2},
                                {'left_foot': True, 'right_foot': False})
    assert assembler.contacts(6, ['right_foot', 'left_foot'], [1.0, 0.0]) is None
    frame = assembler.joint_states(6, ['knee', 'hip'], [0.2, 0.1])
    assert frame == SensorFrame(6, {'hip': 0.1, 'knee': 0.2},
                                {'left_foot': False, 'right_foot': True})


def test_a_lost_part_costs_only_its_own_frame(assembler):
    assert assembler.joint_states(1, JOINTS, [0.0, 0.0]) is None
    assert assembler.joint_states(2, JOINTS, [0.0, 0.0]) is None
    assert assembler.contacts(2, FEET, [0.0, 0.0]).stamp_ns == 2


def test_an_old_part_in_between_does_not_cost_the_frame(assembler):
    assert assembler.contacts(100, FEET, [1.0, 1.0]) is None
    assert assembler.contacts(3, FEET, [0.0, 0.0]) is None
    assert assembler.joint_states(100, JOINTS, [0.0, 0.0]).touching['left_foot']


def test_parts_without_their_other_half_are_not_kept_for_ever(assembler):
    for stamp in range(1, WAITING_PARTS + 2):
        assembler.joint_states(stamp, JOINTS, [0.0, 0.0])
    assert assembler.contacts(1, FEET, [0.0, 0.0]) is None
    assert assembler.contacts(2, FEET, [0.0, 0.0]) is not None


def test_a_body_without_touch_sensors_needs_no_contacts():
    blind = FrameAssembler(JOINTS, ())
    assert blind.joint_states(1, JOINTS, [0.0, 0.5]) == SensorFrame(1, {'hip': 0.0, 'knee': 0.5},
                                                                   {})
    assert blind.contacts(2, FEET, [1.0, 1.0]) is None


@pytest.mark.parametrize(('names', 'values', 'reason'), [
    (['hip'], [0.0], 'knee missing'),
    ([], [], 'hip, knee missing'),
    (['hip', 'knee'], [0.0], '2 names and 1 positions'),
    (['hip', 'knee'], [], '2 names and 0 positions'),
    (['hip', 'hip', 'knee'], [0.0, 0.0, 0.0], 'hip more than once'),
    (['hip', 'knee'], [0.0, math.nan], 'got nan for knee'),
    (['hip', 'knee'], [-math.inf, 0.0], 'got -inf for hip'),
])
def test_malformed_joint_states_are_refused_with_the_reason(assembler, names, values, reason):
    with pytest.raises(FrameError, match=reason) as caught:
        assembler.joint_states(1, names, values)
    assert not isinstance(caught.value, OtherBodyError)
    assert '\n' not in str(caught.value)


def test_the_joints_of_another_body_are_told_apart(assembler):
    with pytest.raises(OtherBodyError, match='expected hip, knee, got wheel, knee'):
        assembler.joint_states(1, ['wheel', 'knee'], [0.0, 0.0])
    with pytest.raises(OtherBodyError, match='contacts'):
        assembler.contacts(1, ['tail'], [0.0])


def test_other_names_are_ignored_in_frames_whatever_they_hold(assembler):
    assert assembler.joint_states(1, ['pan', 'hip', 'knee', 'pan'], [math.nan, 0.1, 0.2, 9.0]) \
        is None
    frame = assembler.contacts(1, ['tail', *FEET], [0.5, 1.0, 0.0])
    assert frame == SensorFrame(1, {'hip': 0.1, 'knee': 0.2},
                                {'left_foot': True, 'right_foot': False})


def test_other_names_are_refused_in_targets():
    with pytest.raises(FrameError, match='unexpected tail'):
        named_values('joint_trajectory', ['hip', 'knee', 'tail'], [0.0, 0.0, 0.0], JOINTS)


def test_a_missing_joint_is_named_beside_another_one():
    names = ['a', 'b', 'c', 'pan']
    with pytest.raises(FrameError, match='d missing') as caught:
        named_values('joint_states', names, [0.0] * 4, 'abcd', ignore_others=True)
    assert not isinstance(caught.value, OtherBodyError)


@pytest.mark.parametrize('value', [0.5, -1.0, 2.0, math.nan])
def test_contacts_are_0_or_1(assembler, value):
    with pytest.raises(FrameError, match='left_foot'):
        assembler.contacts(1, FEET, [value, 0.0])


@pytest.mark.parametrize('stamp_ns', [0, -1])
def test_a_frame_needs_a_stamp(assembler, stamp_ns):
    with pytest.raises(FrameError, match='stamp after 0'):
        assembler.joint_states(stamp_ns, JOINTS, [0.0, 0.0])


def test_a_hundred_thousand_strange_names_make_a_short_message():
    names = [f'strange\n{number}' * 10 for number in range(100_000)]
    with pytest.raises(OtherBodyError) as caught:
        named_values('joint_states', names, [0.0] * len(names), JOINTS)
    assert len(str(caught.value)) < 400
    assert '\n' not in str(caught.value)


def test_shown_of_nothing():
    assert shown([]) == 'none'


@given(st.lists(st.text(max_size=3), max_size=4), st.lists(st.floats(), max_size=4))
def test_whatever_comes_either_gives_the_expected_names_or_a_frame_error(names, values):
    try:
        result = named_values('joint_states', names, values, JOINTS)
    except FrameError:
        return
    assert tuple(result) == JOINTS
    assert all(map(math.isfinite, result.values()))
