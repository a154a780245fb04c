"""A word said before moves nothing later: real brain and hardware node, looked at on the pulses."""

import signal

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticStatus

from tests.ros.hardware import STILL_US, HardwareSystem
from tests.ros.harness import LATCHED
from w2b_controller.say import values_of
from w2b_core.body_status import BodyStatus


class Robot(HardwareSystem):
    """Brain and hardware node, and what the body says of itself."""

    def __init__(self, system, folder, **brain):
        super().__init__(system, folder)
        self.bodies: list[BodyStatus] = []
        system.node.create_subscription(
            DiagnosticStatus, 'body_status',
            lambda message: self.bodies.append(BodyStatus.from_values(values_of(message))),
            LATCHED)
        self.start_brain(**brain)

    def start_brain(self, **parameters):
        self.system.answers.clear()
        self.brain = self.system.start('brain', controller='physical_twin', **parameters)
        self.system.wait_for_brain()
        # A word is to be heard by a brain that knows its body.
        self.system.wait(lambda: self.bodies, 'the state of the body')
        self.spin(0.5)

    def stands_armed(self, seconds=2.0):
        """Armed, fed with targets, and no pulse changes."""
        self.arm()
        swing_us = self.swing_us(seconds)
        assert swing_us.max() < STILL_US, swing_us
        assert self.state() == 'ACTIVE'

    def walks(self):
        level, message, _ = self.system.tell('forward')
        assert level == 0, message
        self.wait_until_following()
        self.spin(1.0)
        swing_us = self.swing_us(1.5)
        assert np.count_nonzero(swing_us > 10 * STILL_US) >= 4, swing_us


@pytest.fixture
def robot(system, tmp_path):
    robot = Robot(system, tmp_path)
    yield robot
    robot.close()


def test_a_word_said_before_arming_moves_nothing_after_it(robot):
    robot.wait_for_frames()
    assert robot.system.tell('forward')[0] == 0
    robot.spin(1.0)
    assert robot.off()
    robot.stands_armed()
    # What the brain said of the word is taken back, for late listeners too.
    level, message, _ = robot.system.last_answer()
    assert level == 1
    assert message.startswith('standing: the body is ARMING')
    robot.walks()


@pytest.mark.parametrize('end', ['emergency_stop', 'disarm'])
def test_no_word_survives_a_stop(robot, end):
    robot.arm()
    robot.walks()
    assert robot.trigger(end).success
    robot.wait_until_off()
    robot.stands_armed()
    robot.walks()


def test_no_word_survives_a_brown_out_and_a_new_hardware_process(robot):
    robot.arm()
    robot.walks()
    robot.chips.request({'power_on': True})
    robot.wait_until_off()
    robot.stands_armed()
    robot.walks()
    robot.hardware.killed = True
    robot.hardware.send(signal.SIGKILL)
    robot.hardware.wait()
    robot.wait_until_off()
    epoch = robot.bodies[-1].epoch
    robot.hardware = robot.system.start('hardware', transport=f'emulated:{robot.socket}')
    robot.system.wait(lambda: robot.bodies[-1].epoch.split('.')[0] != epoch.split('.')[0],
                      'the next hardware node')
    robot.system.statuses.clear()
    robot.stands_armed()
    robot.walks()


def test_a_word_ends_after_its_time_and_the_robot_says_so(system, tmp_path):
    robot = Robot(system, tmp_path, command_timeout=4.0)
    try:
        robot.arm()
        robot.walks()
        robot.system.wait_for_status('brain: command', 0, 'standing: the last word was said 4 s')
        robot.spin(0.5)
        assert robot.swing_us(1.5).max() < STILL_US
        assert robot.state() == 'ACTIVE', 'it stands, it is not switched off'
        robot.walks()
    finally:
        robot.close()


def test_the_body_says_whether_it_follows(robot):
    robot.wait_for_frames()
    robot.system.wait(lambda: robot.bodies[-1].state == 'DISARMED', 'its state')
    assert not robot.bodies[-1].follows
    robot.arm()
    robot.system.wait(lambda: robot.bodies[-1].follows, 'following')
    assert robot.bodies[-1].state == 'ACTIVE'
    robot.brain.kill()
    robot.system.wait(lambda: not robot.bodies[-1].follows, 'not following')
    robot.hardware.stop()
    assert robot.bodies[-1].body == 'physical_twin'
