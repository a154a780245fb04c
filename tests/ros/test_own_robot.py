"""A robot that comes from a maker's file: brain, DDS, hardware node, chips and simulated body."""

import time
from pathlib import Path

import numpy as np
import pytest
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from tests.ros.harness import EVERYTHING
from tests.ros.whole_robot import WholeRobot
from w2b_controller.say import values_of
from w2b_core import bodies
from w2b_core.controller import file as controller_file

ROBOT = Path(__file__).resolve().parents[2] / 'examples' / 'robots' / 'dog12.yaml'


@pytest.fixture
def robot(system, tmp_path):
    robot = WholeRobot(system, tmp_path, controller_file.beside(ROBOT), str(ROBOT))
    robot.arm()
    robot.go_on(6.0)
    yield robot
    robot.close()


@pytest.mark.timeout(600)
def test_a_robot_of_a_file_obeys_words_on_simulated_hardware(robot):
    body = bodies.get(str(ROBOT))
    assert robot.height_m() > 0.8 * body.height_m
    forward = robot.follow('march', 6.0)
    print('march', forward)
    assert forward.along_m > 0.5 * body.length_m * 6.0
    robot.follow('halt', 2.0)
    still = robot.follow('halt', 3.0)
    print('halt', still)
    assert still.away_m < 0.01
    back = robot.follow('backward', 6.0)
    print('backward', back)
    assert back.along_m < -0.5 * body.length_m * 6.0
    # Its servos sit on the outputs that its file names, some of them mirrored.
    wiring = bodies.wiring(str(ROBOT))
    used = {one.channel for one in wiring.values()}
    pulses = np.array(robot.chips.outputs()[-1].pulses_us)
    assert {channel for channel, pulse in enumerate(pulses) if pulse} == used
    assert {one.direction for one in wiring.values()} == {1, -1}


def test_a_robot_of_a_file_drives_its_own_outputs_on_emulated_hardware(system):
    pulses = []
    system.node.create_subscription(JointState, 'pulses', pulses.append, EVERYTHING)
    system.start('hardware', transport='emulated', body=ROBOT)
    system.start('brain', controller=ROBOT)
    system.wait_for_brain()

    def state():
        status = system.statuses.get('hardware: safety')
        return '' if status is None else values_of(status).get('state', '')

    def walking():
        """On a busy machine a late target disarms it: it is armed, and told, again."""
        if state() in ('', 'DISARMED', 'FAULT'):
            system.call(Trigger, 'hardware/arm', Trigger.Request())
        elif state() == 'ACTIVE' and time.monotonic() > said_s[-1] + 5.0:
            system.tell('march')
            said_s.append(time.monotonic())
        last = [message.position for message in pulses[-40:]]
        return len(last) == 40 and np.count_nonzero(np.ptp(last, axis=0) > 50e-6) >= 8
    said_s = [float('-inf')]
    system.wait(walking, 'pulses that swing', 60.0)
    assert list(pulses[-1].name) == [joint.name for joint in bodies.get(str(ROBOT)).joints]
