"""Velocities: which behaviour each asks for, and which are followed at all."""

import math

import pytest

from w2b_core.controller import file as controller_file
from w2b_core.status import Level
from w2b_core.twist import Full, TwistDriver, TwistRefusedError, Velocity, behaviour_of, words_of

FULL = Full(speed_m_s=0.2, turn_rad_s=0.4)
WORDS = {name: name for name in ('stop', 'forward', 'backward', 'left', 'right')}


def velocity(forward=0.0, turn=0.0, aside=0.0, up=0.0, roll=0.0, pitch=0.0):
    return Velocity((forward, aside, up), (roll, pitch, turn))


class Clock:
    now_s = 100.0

    def __call__(self):
        return self.now_s


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def driver(clock):
    """A driver that was quiet long enough to be used."""
    driver = TwistDriver(WORDS, FULL, 1.0, clock)
    clock.now_s += 5.0
    return driver


@pytest.mark.parametrize(('asked', 'expected'), [
    (velocity(0.2), 'forward'), (velocity(-0.05), 'backward'), (velocity(turn=0.4), 'left'),
    (velocity(turn=-3.0), 'right'), (velocity(), 'stop'), (velocity(0.019, 0.039), 'stop'),
    (velocity(0.2, 0.1), 'forward'), (velocity(0.02, 0.4), 'left'),
    (velocity(-0.2, 0.39), 'backward'), (velocity(0.2, 0.2, aside=0.019), 'forward')])
def test_the_larger_share_of_a_velocity_is_followed(asked, expected):
    assert behaviour_of(asked, FULL) == expected


def test_a_velocity_between_two_behaviours_changes_none():
    almost = velocity(0.2, 0.41)
    assert behaviour_of(almost, FULL) == 'left'
    assert behaviour_of(almost, FULL, before='forward') == 'forward'
    assert behaviour_of(velocity(0.21, 0.4), FULL, before='left') == 'left'
    assert behaviour_of(velocity(0.1, 0.4), FULL, before='forward') == 'left'


@pytest.mark.parametrize(('asked', 'said'), [
    (velocity(aside=0.1), 'linear.y 0.1 m/s'), (velocity(0.2, up=-0.1), 'linear.z'),
    (velocity(roll=0.1), 'angular.x'), (velocity(pitch=0.1), 'angular.y'),
    (velocity(math.nan), 'finite'), (velocity(turn=math.inf), 'finite')])
def test_what_no_behaviour_does_is_refused(driver, asked, said):
    assert driver.take(velocity(0.2)) == 'forward'
    with pytest.raises(TwistRefusedError, match=said):
        driver.take(asked)
    assert not driver.driving
    assert driver.status(1).level is Level.WARN
    assert said in driver.status(1).message


def test_a_word_is_said_once_while_the_same_is_asked(driver, clock):
    said = []
    for _ in range(20):
        clock.now_s += 0.1
        said.append(driver.take(velocity(0.2)))
    assert said == ['forward'] + [''] * 19
    assert driver.take(velocity(turn=0.4)) == 'left'
    assert driver.take(velocity()) == 'stop'
    assert driver.take(velocity()) == ''


def test_velocities_that_end_end_once_after_the_timeout(driver, clock):
    driver.take(velocity(0.2))
    clock.now_s += 0.99
    assert driver.expired() == ''
    clock.now_s += 0.02
    assert driver.expired() == 'no Twist came for 1 s'
    assert driver.expired() == ''
    assert driver.take(velocity(0.2)) == 'forward', 'a key that is pressed again'


def test_a_zero_ends_them_at_once_and_is_no_order_to_a_robot_that_walks_by_a_word(driver, clock):
    assert driver.take(velocity()) == ''
    driver.take(velocity(0.2))
    driver.take(velocity())
    clock.now_s += 5.0
    assert driver.expired() == ''


@pytest.mark.parametrize('let_go', ['zero', 'silence'])
def test_what_is_held_since_before_has_to_be_let_go(driver, clock, let_go):
    driver.take(velocity(0.2))
    assert driver.block('the body is ARMING') is True
    assert driver.block('again') is False
    for _ in range(50):
        clock.now_s += 0.1
        with pytest.raises(TwistRefusedError, match='again since: let go first'):
            driver.take(velocity(0.2))
    if let_go == 'zero':
        assert driver.take(velocity()) == ''
    else:
        clock.now_s += 1.1
    assert driver.take(velocity(0.2)) == 'forward'


def test_what_is_held_while_the_brain_begins_moves_nothing(clock):
    driver = TwistDriver(WORDS, FULL, 1.0, clock)
    for _ in range(30):
        clock.now_s += 0.1
        with pytest.raises(TwistRefusedError, match='the brain began'):
            driver.take(velocity(0.2))


def test_a_behaviour_that_the_controller_lacks_is_refused(clock):
    words = words_of(controller_file.load(controller_file.shipped('physical_twin_serial')))
    assert words == {'stop': 'stop', 'forward': 'forward', 'backward': 'backward'}
    driver = TwistDriver(words, FULL, 1.0, clock)
    clock.now_s += 5.0
    driver.take(velocity(0.2))
    with pytest.raises(TwistRefusedError, match='a Twist that asks for left'):
        driver.take(velocity(turn=0.4))
    assert not driver.driving


def test_words_of_a_controller_with_an_ear_are_its_behaviours():
    words = words_of(controller_file.load(controller_file.shipped('physical_twin')))
    assert set(WORDS) < set(words)
    assert all(name == word for name, word in words.items())


def test_several_publishers_are_named(driver):
    assert driver.status(2).level is Level.WARN
    assert 'twist_mux' in driver.status(2).message
    assert driver.status(1).level is Level.OK
