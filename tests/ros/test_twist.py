"""Velocities over DDS: they move the robot while they come, and nothing moves on old ones."""

import numpy as np
import pytest
from geometry_msgs.msg import Twist
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory

from tests.ros.harness import EVERYTHING
from w2b_controller.say import values_of


class Stick:
    """A joystick: publishes what it is held at, ten times a second, until it is let go."""

    def __init__(self, system):
        self._node = system.node
        self._publisher = system.node.create_publisher(Twist, 'cmd_vel', 10)
        self._timer = None

    def hold(self, forward=0.0, turn=0.0, aside=0.0):
        self.let_go()
        twist = Twist()
        twist.linear.x, twist.linear.y, twist.angular.z = forward, aside, turn
        self._timer = self._node.create_timer(0.1, lambda: self._publisher.publish(twist))

    def let_go(self):
        if self._timer is not None:
            self._node.destroy_timer(self._timer)
            self._timer = None

    @property
    def heard(self):
        return self._publisher.get_subscription_count()


@pytest.fixture
def stick(system):
    return Stick(system)


@pytest.fixture
def marks(system):
    """What the targets say they follow, in the order of time."""
    seen = []
    system.node.create_subscription(
        JointTrajectory, 'joint_trajectory',
        lambda message: seen.append(message.header.frame_id), EVERYTHING)
    return seen


def walking_twin(system, stick, **parameters):
    system.start('sim', body='physical_twin', real_time_factor=1.0)
    brain = system.start('brain', controller='physical_twin', **parameters)
    system.wait_for_brain()
    system.wait_for_status('brain: frames', 0, 'sensor frames flow')
    system.wait(lambda: stick.heard, 'a brain that listens to the stick')
    # In the middle first: what is held while a robot starts moves nothing.
    stick.hold()
    system.wait_for_status('brain: cmd_vel', 0, 'Twists come: nothing')
    return brain


def x_m(system):
    return system.positions_m[max(system.positions_m)][0]


def wait_for_answer(system, text):
    system.wait(lambda: text in system.last_answer()[1], f'the answer {text!r}')


def test_a_robot_walks_while_the_stick_is_held_and_stands_when_its_publisher_is_silent(
        system, stick, marks):
    # A word alone would last 2 s.
    walking_twin(system, stick, command_timeout=2.0)
    stick.hold(forward=0.15)
    wait_for_answer(system, "following 'forward'")
    start_m = x_m(system)
    system.wait(lambda: x_m(system) > start_m + 0.6, 'four seconds of walking')
    assert system.last_answer()[0] == 0, 'the velocity keeps the word up'
    stick.let_go()
    wait_for_answer(system, 'standing: no Twist came for 1 s')
    system.wait(lambda: marks[-1] == 'standing', 'targets that stand')
    system.spin_for_frames(20)
    stopped_m = x_m(system)
    system.spin_for_frames(20)
    assert abs(x_m(system) - stopped_m) < 0.01


def test_it_turns_goes_back_and_stops_with_a_zero(system, stick):
    walking_twin(system, stick)
    for held, behaviour in (({'turn': 0.3}, 'left'), ({'turn': -0.3}, 'right'),
                            ({'forward': -0.2}, 'backward'), ({}, 'stop')):
        stick.hold(**held)
        wait_for_answer(system, f'following {behaviour!r}')
    system.wait_for_status('brain: cmd_vel', 0, 'Twists come: stop')


def test_what_it_cannot_do_stops_it_and_is_in_the_diagnostics(system, stick):
    walking_twin(system, stick)
    stick.hold(forward=0.15)
    wait_for_answer(system, "following 'forward'")
    stick.hold(forward=0.15, aside=0.1)
    system.wait_for_status('brain: cmd_vel', 1, 'linear.y 0.1 m/s: no behaviour does this')
    wait_for_answer(system, 'standing: Twist refused')


def test_a_word_takes_over_from_a_stick_that_is_held(system, stick, marks):
    walking_twin(system, stick)
    stick.hold(forward=0.15)
    wait_for_answer(system, "following 'forward'")
    assert system.say('stop').exit_code == 0
    system.wait_for_status('brain: cmd_vel', 1, "'stop' was said since: let go first")
    system.spin_for_frames(30)
    assert "following 'stop'" in system.last_answer()[1]
    stick.hold()
    system.wait_for_status('brain: cmd_vel', 0)
    stick.hold(forward=0.15)
    wait_for_answer(system, "following 'forward'")


def test_a_stick_that_is_held_while_the_robot_is_armed_moves_nothing(system, stick, marks):
    system.start('hardware', transport='emulated')
    system.start('brain', controller='physical_twin')
    system.wait_for_brain()
    system.wait_for_status('brain: frames', 0, 'sensor frames flow')
    system.wait(lambda: stick.heard, 'a brain that listens to the stick')
    stick.hold(forward=0.15)
    wait_for_answer(system, 'DISARMED')
    assert system.call(Trigger, 'hardware/arm', Trigger.Request()).success

    def active():
        status = system.statuses.get('hardware: safety')
        return status is not None and values_of(status).get('state') == 'ACTIVE'
    system.wait(active, 'an armed robot')
    system.wait_for_status('brain: cmd_vel', 1, 'let go first')
    system.wait(lambda: marks[-1] == 'standing', 'targets that stand')
    before = len(marks)
    system.wait(lambda: len(marks) > before + 40, 'two seconds of targets')
    assert set(marks[before:]) == {'standing'}
    # Let go and pushed again, it walks; and an emergency stop ends it for good.
    stick.hold()
    system.wait_for_status('brain: cmd_vel', 0)
    stick.hold(forward=0.15)
    system.wait(lambda: marks[-1].startswith('word@'), 'targets of the word')
    assert system.call(Trigger, 'hardware/emergency_stop', Trigger.Request()).success
    system.wait(lambda: marks[-1] == 'standing', 'targets that stand')
    before = len(marks)
    system.wait(lambda: len(marks) > before + 40, 'two seconds of targets')
    assert set(marks[before:]) == {'standing'}


def test_a_brain_that_starts_again_does_not_go_on_with_a_stick_that_is_held(system, stick, marks):
    brain = walking_twin(system, stick)
    stick.hold(forward=0.15)
    wait_for_answer(system, "following 'forward'")
    brain.kill()
    system.wait_for_no_brain()
    system.answers.clear()
    marks.clear()
    system.start('brain', controller='physical_twin')
    system.wait_for_brain()
    system.wait_for_status('brain: cmd_vel', 1, 'let go first')
    system.wait(lambda: len(marks) > 40, 'two seconds of targets')
    assert set(marks) == {'standing'}
    assert np.ptp([list(target.values()) for target in
                   list(system.targets_rad.values())[-20:]], axis=0).max() == 0.0


def test_nothing_listens_to_velocities_where_they_are_turned_off(system, stick):
    system.start('sim')
    system.start('brain', cmd_vel=False)
    system.wait_for_brain()
    system.wait_for_status('brain: frames', 0)
    assert not stick.heard
    assert 'brain: cmd_vel' not in system.statuses
