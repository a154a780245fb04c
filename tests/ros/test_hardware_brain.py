"""A word walks the robot: brain and hardware node, unchanged, on emulated chips over DDS."""

import time

import numpy as np
import pytest

from tests.ros.hardware import STILL_US, HardwareSystem
from w2b_core.controller import file as controller_file
from w2b_hw.joints import JOINTS

SHIPPED = 'physical_twin_serial'
#: Words like `stop`; the first that the controller was not trained on is said.
SYNONYMS = ('halt', 'cease', 'pause', 'quit')


@pytest.fixture(scope='session')
def controller():
    """The file of the shipped champion."""
    path = controller_file.resolve(SHIPPED)
    assert [motor.joint for motor in controller_file.load(path).motors] == list(JOINTS)
    return path


#: A robot that was told to stop is still by then, also on a busy machine.
COMES_TO_REST_S = 10.0


@pytest.fixture
def robot(system, tmp_path, controller):
    robot = HardwareSystem(system, tmp_path)
    robot.brain = start_brain(system, controller)
    robot.arm()
    yield robot
    robot.close()


def start_brain(system, controller):
    system.answers.clear()
    brain = system.start('brain', controller=controller)
    system.wait_for_brain()
    return brain


def test_forward_walks_stop_and_an_unheard_synonym_still(robot, controller):
    level, message, _ = robot.say('forward')
    assert level == 0, message
    robot.wait_until_following()
    robot.spin(1.0)
    walking = robot.swing_us(2.5)
    assert np.count_nonzero(walking > 10 * STILL_US) >= 4, walking
    trained = [word.word for word in controller_file.load(controller).words]
    unheard = next(word for word in SYNONYMS if word not in trained)
    for word in ('stop', unheard):
        robot.say('forward')
        robot.spin(1.0)
        robot.say(word)
        # The network swings out: the robot has to come to rest, and soon.
        end_s = time.monotonic() + COMES_TO_REST_S
        while (still := robot.swing_us(1.5)).mean() >= 0.1 * walking.mean():
            assert time.monotonic() < end_s, (word, still, walking)
        print(f'{word}: mean swing {still.mean():.1f} us, walking {walking.mean():.1f} us')
    assert robot.all_driven()


def kill_the_brain(robot):
    """
    Kill the brain of a walking robot.

    Returns when all channels went off and the times at which pulses changed before, since the
    kill; or None where the machine was too busy for frames in time, and the times say nothing.
    """
    robot.say('forward')
    robot.wait_until_following()
    killed_s, killed_ns = time.monotonic(), robot.now_ns()
    robot.brain.kill()
    robot.wait_until_off()
    robot.spin(0.2)
    if robot.longest_gap_s(killed_ns - 2 * 10**8, robot.now_ns()) > 0.1:
        return None
    history = robot.pin_history(killed_s)
    off_at_s = next(since_s for since_s, pins in history if not pins.any()) - killed_s
    return off_at_s, np.array([since_s - killed_s for since_s, pins in history if pins.any()])


def test_the_brain_killed_holds_parks_and_relaxes_on_time(robot, controller):
    while (measured := kill_the_brain(robot)) is None:
        assert len(robot.system.processes) < 10, 'frames were late in every attempt'
        robot.brain = start_brain(robot.system, controller)
        robot.arm()
    off_at_s, changes_s = measured
    print(f'brain killed: pulses changed at {changes_s.round(3)}, off at {off_at_s:.3f} s')
    # The last pulse that follows a target, the pose held, and the first one of parking.
    held = int(np.argmax(np.diff(changes_s)))
    last_s, parking_s = changes_s[held:held + 2]
    # A target that was under way is good for 150 ms, and a servo may be on its way to it for as
    # long; then no pulse changes until 500 ms after that target.
    assert last_s <= 0.3
    assert parking_s - last_s >= 0.3
    # Parking begins with a frame: 50 ms, and as late as was put up with.
    assert parking_s - last_s <= 0.5 + 0.05 + 0.05
    assert off_at_s - parking_s <= 2.0 + 0.05 + 0.05
    robot.wait_for_state('DISARMED')
