"""The safety machine: every transition, and what no sequence of inputs may ever do."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from w2b_hw.safety import DRIVEN, Limits, Safety, State

JOINTS = 3
LIMITS = Limits(lower_rad=(-0.5,) * JOINTS, upper_rad=(0.5,) * JOINTS, park_rad=(0.0,) * JOINTS)
FRAME_S = 0.05


class Rig:
    """A machine, a clock, and a brain that answers every frame unless told not to."""

    def __init__(self, limits=LIMITS):
        self.safety = Safety(limits)
        self.now_s = 100.0
        self.target = (0.0,) * JOINTS

    def frame(self, seconds=FRAME_S, answered=True, confirmed=True):
        self.now_s += seconds
        if answered:
            self.safety.take_target(self.target, self.now_s)
        command = self.safety.step(self.now_s)
        if confirmed:
            self.safety.confirm()
        return command

    def frames(self, seconds, **how):
        return [self.frame(**how) for _ in range(round(seconds / FRAME_S))]

    def armed(self):
        self.frame()
        assert self.safety.arm(self.now_s) is None
        return self

    def active(self):
        self.armed()
        self.frames(1.0)
        assert self.safety.state is State.ACTIVE
        return self


@pytest.fixture
def rig():
    return Rig()


def test_disarmed_until_armed_whatever_the_targets(rig):
    assert all(command.state is State.DISARMED and not any(command.energised)
               for command in rig.frames(5))


def test_arming_needs_fresh_targets(rig):
    assert 'no fresh targets' in rig.safety.arm(rig.now_s)
    rig.frame()
    rig.frames(0.2, answered=False)
    assert 'no fresh targets' in rig.safety.arm(rig.now_s)
    rig.frame()
    assert rig.safety.arm(rig.now_s) is None
    assert rig.safety.state is State.ARMING


@pytest.mark.parametrize('state', sorted(DRIVEN, key=lambda state: state.value))
def test_arming_is_refused_where_servos_are_driven(rig, state):
    rig.active()
    rig.safety.state = state
    assert rig.safety.arm(rig.now_s) == f'already {state.value}'


def test_arming_energises_one_servo_at_a_time_at_the_park_pose(rig):
    rig.target = (0.4,) * JOINTS
    commands = rig.armed().frames(0.3)
    assert [sum(command.energised) for command in commands] == [1, 1, 2, 2, 3, 3]
    assert all(command.position_rad == LIMITS.park_rad for command in commands)
    assert rig.frame().state is State.ACTIVE


def test_a_late_frame_does_not_energise_two_servos(rig):
    rig.armed().frame()
    assert sum(rig.frame(0.24).energised) == 2


def test_arming_ends_in_disarmed_when_targets_stop(rig):
    commands = rig.armed().frames(0.2, answered=False)
    assert commands[-1].state is State.DISARMED
    assert not any(commands[-1].energised)
    assert 'while arming' in rig.safety.reason


def test_active_follows_targets_no_faster_than_the_slew_limit(rig):
    rig.active().target = (0.5, -0.5, 0.1)
    assert rig.frame().position_rad == pytest.approx((0.25, -0.25, 0.1))
    assert rig.frame().position_rad == pytest.approx((0.5, -0.5, 0.1))


def test_targets_are_clamped_and_the_clamped_pose_is_returned(rig):
    assert rig.safety.take_target((9.0, -9.0, 0.2), 0.0) == (0.5, -0.5, 0.2)


@pytest.mark.parametrize('target', [(0.0, 0.0), (0.0,) * 4, (math.nan, 0, 0), (math.inf, 0, 0)])
def test_a_target_of_wrong_length_or_not_finite_is_an_error_and_no_target(rig, target):
    with pytest.raises(ValueError, match='target: expected'):
        rig.safety.take_target(target, rig.now_s)
    assert 'no fresh targets' in rig.safety.arm(rig.now_s)


def test_command_loss_holds_at_150_ms_parks_at_500_ms_then_relaxes(rig):
    rig.active().target = (0.5,) * JOINTS
    rig.frames(0.5)
    commands = rig.frames(2.0, answered=False)
    states = [command.state for command in commands]
    # The last target came with the frame before these.
    assert states[:2] == [State.ACTIVE] * 2
    assert states[2:9] == [State.HOLD] * 7
    assert all(command.position_rad == (0.5,) * JOINTS for command in commands[:9])
    assert states[9] is State.PARK
    parking = [command.position_rad[0] for command in commands[9:] if any(command.energised)]
    assert parking == pytest.approx([0.45 - 0.05 * n for n in range(len(parking))])
    assert states[-1] is State.DISARMED
    assert 'parked and relaxed' in rig.safety.reason


def test_hold_ends_with_a_fresh_target(rig):
    rig.active().frames(0.2, answered=False)
    assert rig.safety.state is State.HOLD
    assert rig.frame().state is State.ACTIVE


def test_park_ends_in_disarmed_even_with_fresh_targets(rig):
    rig.active().target = (0.5,) * JOINTS
    rig.frames(0.5)
    rig.safety.park('asked to', rig.now_s)
    states = {command.state for command in rig.frames(1.0)}
    assert states == {State.PARK, State.DISARMED}
    assert rig.safety.state is State.DISARMED


def test_park_from_hold_arming_and_where_servos_are_off(rig):
    rig.safety.park('nothing to park', rig.now_s)
    assert rig.safety.state is State.DISARMED
    rig.armed().safety.park('asked to', rig.now_s)
    assert rig.safety.state is State.DISARMED
    rig.active().frames(0.2, answered=False)
    rig.safety.park('asked to', rig.now_s)
    assert rig.safety.state is State.PARK
    rig.safety.fault('broken')
    rig.safety.park('asked to', rig.now_s)
    assert rig.safety.state is State.FAULT


def test_parking_ends_when_its_time_is_up(rig):
    slow = Limits(LIMITS.lower_rad, LIMITS.upper_rad, LIMITS.park_rad, park_slew_rad_s=0.01)
    rig = Rig(slow).active()
    rig.target = (0.5,) * JOINTS
    rig.frames(0.5)
    rig.safety.park('asked to', rig.now_s)
    assert rig.frames(1.9)[-1].state is State.PARK
    assert rig.frames(0.2)[-1].state is State.DISARMED


@pytest.mark.parametrize('state', list(State))
def test_fault_from_any_state_turns_off_and_stays_until_armed(rig, state):
    rig.active()
    rig.safety.state = state
    rig.safety.fault('first')
    rig.safety.fault('second')
    commands = rig.frames(3)
    assert all(command.state is State.FAULT and not any(command.energised)
               for command in commands)
    if state is not State.FAULT:
        assert rig.safety.reason == 'first'
    assert rig.safety.arm(rig.now_s) is None
    assert sum(rig.frame().energised) == 1


def test_what_was_wanted_before_a_stop_is_not_what_is_wanted_after(rig):
    rig.active().safety.fault('broken')
    assert 'no fresh targets' in rig.safety.arm(rig.now_s)


@pytest.mark.parametrize('seconds', [0.26, 10.0, -0.01])
def test_a_control_loop_that_was_silent_or_a_clock_that_jumps_back_is_a_fault(rig, seconds):
    rig.active()
    command = rig.frame(seconds)
    assert command.state is State.FAULT
    assert not any(command.energised)
    assert 'silent' in rig.safety.reason


def test_a_command_that_was_not_confirmed_is_repeated(rig):
    rig.active().target = (0.5,) * JOINTS
    lost = rig.frame(confirmed=False)
    assert rig.frame().position_rad == lost.position_rad
    assert rig.frame().position_rad == pytest.approx((0.5,) * JOINTS)


def test_the_duty_budget_parks_and_refuses_until_the_servos_cooled():
    rig = Rig(Limits(LIMITS.lower_rad, LIMITS.upper_rad, LIMITS.park_rad, duty_budget_s=10.0))
    rig.active().frames(10.0)
    assert rig.safety.state is State.DISARMED
    assert 'duty budget' in rig.safety.reason
    rig.frame()
    assert 'must cool' in rig.safety.arm(rig.now_s)
    rig.frames(3.0)
    assert rig.safety.arm(rig.now_s) is None


@pytest.mark.parametrize(('change', 'message'), [
    ({'upper_rad': (0.5,)}, 'one value for each joint'),
    ({'park_rad': (0.0, 0.0, 0.6)}, 'within the limits'),
    ({'hold_after_s': 0.6}, 'hold < park')])
def test_limits_that_make_no_sense_are_refused(change, message):
    values = {'lower_rad': LIMITS.lower_rad, 'upper_rad': LIMITS.upper_rad,
              'park_rad': LIMITS.park_rad, **change}
    with pytest.raises(ValueError, match=message):
        Limits(**values)


finite = st.floats(-1e6, 1e6)
inputs = st.one_of(
    st.tuples(st.just('target'), st.tuples(*[finite] * JOINTS)),
    st.tuples(st.just('arm')), st.tuples(st.just('park')), st.tuples(st.just('fault')),
    st.tuples(st.just('step'), st.floats(-0.01, 0.4), st.booleans()),
    # Most of the time a robot just runs: many frames with a brain that answers.
    st.tuples(st.just('run'), st.integers(1, 30), st.tuples(*[finite] * JOINTS)))


@settings(max_examples=300, deadline=None)
@given(st.lists(inputs, max_size=60))
def test_no_sequence_of_inputs_breaks_a_limit(sequence):
    """
    Never outside the limits, never faster than the slew limit, never while off.

    `shown` is what the servos show: the last confirmed command, and each that was not confirmed
    may have reached some of them.
    """
    rig = Rig()
    shown, shown_at_s, driven, armed = [{0.0} for _ in range(JOINTS)], 0.0, 0, False

    def look(command, confirmed):
        nonlocal shown, shown_at_s, driven, armed
        count = sum(command.energised)
        if command.state not in DRIVEN:
            assert count == 0
            driven, armed = 0, False
            return
        assert armed
        assert driven <= count <= driven + 1
        for joint, angle in enumerate(command.position_rad):
            assert -0.5 <= angle <= 0.5
            if joint < driven:
                most = 5.0 * (rig.now_s - shown_at_s) + 1e-6
                assert all(abs(angle - before) <= most for before in shown[joint])
            shown[joint] = {angle} if confirmed else shown[joint] | {angle}
        if confirmed:
            driven, shown_at_s = count, rig.now_s

    for name, *arguments in sequence:
        if name == 'target':
            rig.safety.take_target(arguments[0], rig.now_s)
        elif name == 'arm':
            if rig.safety.arm(rig.now_s) is None:
                armed, driven, shown_at_s = True, 0, rig.now_s
        elif name == 'park':
            rig.safety.park('asked to', rig.now_s)
        elif name == 'fault':
            rig.safety.fault('broken')
        elif name == 'step':
            look(rig.frame(arguments[0], answered=False, confirmed=arguments[1]), arguments[1])
        else:
            rig.target = arguments[1]
            for _ in range(arguments[0]):
                look(rig.frame(), True)


def test_every_arming_park_relax_and_fault_begins_an_epoch(rig):
    epochs = [rig.safety.epoch]

    def began():
        epochs.append(rig.safety.epoch)
        assert len(set(epochs)) == len(epochs)
    rig.armed()
    began()
    rig.frames(1.0)
    assert rig.safety.epoch == epochs[-1], 'following is the same epoch as arming'
    rig.frame(0.2, answered=False)
    assert rig.safety.state is State.HOLD
    rig.frame()
    assert rig.safety.epoch == epochs[-1], 'holding is the same epoch'
    rig.safety.park('asked to', rig.now_s)
    began()
    rig.frames(3.0)
    assert rig.safety.state is State.DISARMED
    began()
    rig.active()
    began()
    rig.safety.fault('because')
    began()
    rig.active()
    began()
    rig.safety.relax('the frames ended')
    began()


def test_a_word_of_another_epoch_keeps_the_robot_alive_and_moves_nothing(rig):
    rig.target = (0.4,) * JOINTS
    before = rig.safety.epoch
    rig.safety.take_target(rig.target, rig.now_s, before)
    assert rig.safety.arm(rig.now_s) is None
    for _ in range(60):
        rig.now_s += FRAME_S
        rig.safety.take_target(rig.target, rig.now_s, before)
        command = rig.safety.step(rig.now_s)
        rig.safety.confirm()
        assert command.position_rad == LIMITS.park_rad
    assert rig.safety.state is State.ACTIVE
    rig.safety.take_target(rig.target, rig.now_s, rig.safety.epoch)
    assert rig.frame(answered=False).position_rad != LIMITS.park_rad


def test_a_pose_taken_before_arming_is_not_gone_to_after_it(rig):
    rig.target = (0.4,) * JOINTS
    rig.armed()
    for _ in range(40):
        rig.now_s += FRAME_S
        rig.safety.take_target(rig.target, rig.now_s, 'earlier')
        command = rig.safety.step(rig.now_s)
        rig.safety.confirm()
    assert rig.safety.state is State.ACTIVE
    assert command.position_rad == LIMITS.park_rad


def test_two_sessions_share_no_epoch():
    assert Safety(LIMITS, 'a').epoch != Safety(LIMITS, 'b').epoch
