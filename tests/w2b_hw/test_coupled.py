"""The whole robot on a simulated body, in lockstep with a clock that the test turns."""

from pathlib import Path

import numpy as np
import pytest

from w2b_hw.calibration import nominal
from w2b_hw.emulation.coupled import SimulatedBody
from w2b_hw.emulation.robot import EmulatedRobot
from w2b_hw.imu import registry
from w2b_hw.joints import JOINTS, named
from w2b_hw.power import Power
from w2b_hw.robot import Robot
from w2b_hw.safety import State
from w2b_hw.transport import FrameBudget

DOG12 = Path(__file__).resolve().parents[2] / 'examples' / 'robots' / 'dog12.yaml'


class WholeRobot:
    """What the I/O thread does in 50 ms: sense, drive, and drive again at the brain's answer."""

    def __init__(self, folder, **options):
        self.now_s = 1000.0
        self.chips = EmulatedRobot(clock=lambda: self.now_s)
        self.body = SimulatedBody(self.chips, clock=lambda: self.now_s, **options)
        bus = FrameBudget(self)
        driven = named(options.get('body', 'physical_twin'))
        self.robot = Robot(bus, nominal(joints=driven), Power(folder), clock=lambda: self.now_s)
        self.robot.connect()
        self.now_s += 0.05
        self.robot.attach_imu(registry.find(bus))
        self.report = None

    def transfer(self, messages):
        self.body.catch_up()
        return self.chips.wire.transfer(messages)

    def close(self):
        """Nothing to release."""

    def frame(self, pose=None):
        self.now_s += 0.05
        self.report = self.robot.frame(self.now_s)
        if pose is not None:
            self.robot.safety.take_target(tuple(pose), self.now_s)
            self.report = self.robot.drive(self.now_s)
        return self.report

    def arm(self):
        self.frame(np.zeros(12))
        assert self.robot.arm(self.now_s) is None
        for _ in range(60):
            self.frame(np.zeros(12))
        assert self.report.state is State.ACTIVE

    @property
    def seen(self):
        self.body.catch_up()
        return self.body.seen()


@pytest.fixture
def robot(tmp_path):
    return WholeRobot(tmp_path)


def heading_rad(quaternion):
    x, y, z, w = quaternion
    return np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def test_without_pulses_it_sinks_and_armed_it_stands_up(robot):
    standing_m = robot.body.body.height_m
    for _ in range(60):
        robot.frame()
    assert robot.seen['position_m'][2] < 0.6 * standing_m
    robot.arm()
    assert robot.seen['position_m'][2] > 0.9 * standing_m
    robot.robot.relax()
    for _ in range(60):
        robot.frame()
    assert robot.seen['position_m'][2] < 0.6 * standing_m


def test_pulses_move_the_joints_that_they_are_of(robot):
    robot.arm()
    pose = np.zeros(12)
    pose[JOINTS.index('front_left_hip')] = 0.3
    for _ in range(10):
        robot.frame(pose)
    angles = dict(zip([joint.name for joint in robot.body.body.joints],
                      robot.seen['joint_position_rad'], strict=True))
    assert angles['front_left_hip'] == pytest.approx(0.3, abs=0.02)
    assert abs(angles['back_right_hip']) < 0.02


def test_the_imu_feels_what_the_body_does(robot):
    robot.arm()
    for _ in range(20):
        robot.frame(np.zeros(12))
    force = np.array(robot.report.sample.acceleration_m_s2)
    np.testing.assert_allclose(force, [0, 0, 9.81], atol=0.3)
    # Turning all hips alike turns the base the other way, and the gyroscope shows it.
    hips = np.zeros(12)
    rates, before = [], heading_rad(robot.seen['orientation_xyzw'])
    for number in range(20):
        hips[:4] = 0.35 * np.sin(2 * np.pi * 1.0 * number * 0.05)
        rates.append(robot.frame(hips).sample.angular_velocity_rad_s[2])
    turned = heading_rad(robot.seen['orientation_xyzw']) - before
    assert np.ptp(rates) > 1.0
    assert abs(turned) < 0.3


def test_the_filter_learns_the_bias_while_it_stands_and_keeps_its_heading(tmp_path):
    robot = WholeRobot(tmp_path, gyro_bias_rad_s=(0.0, 0.0, 0.02))
    robot.arm()
    for _ in range(130):
        robot.frame(np.zeros(12))
    before = heading_rad(robot.report.orientation)
    for _ in range(600):
        robot.frame(np.zeros(12))
    # Not learnt it would be 34 degrees in half a minute.
    assert abs(np.degrees(heading_rad(robot.report.orientation) - before)) < 2


def test_quick_swings_do_not_turn_the_heading_of_the_filter(robot):
    """Twisting at 19 Hz, of which one sample a frame would make slow turns of its own."""
    robot.arm()
    for _ in range(130):
        robot.frame(np.zeros(12))
    errors = []
    for number in range(200):
        hips = np.zeros(12)
        hips[:4] = 0.5 if number % 2 else -0.5
        robot.frame(hips)
        errors.append(np.degrees(heading_rad(robot.report.orientation)
                                 - heading_rad(robot.seen['orientation_xyzw'])))
    errors = np.unwrap(errors, period=360)
    assert np.ptp(errors[-40:]) > 0
    assert abs(np.mean(errors[-20:]) - np.mean(errors[:20])) < 2.0


def test_two_runs_are_the_same_to_the_bit(tmp_path):
    seen = []
    for _ in range(2):
        robot = WholeRobot(tmp_path)
        robot.arm()
        seen.append((robot.seen, robot.report.sample))
    assert seen[0] == seen[1]


def test_a_process_that_was_stopped_does_not_make_up_for_it(robot):
    robot.frame()
    before_s = robot.body.time_s
    robot.now_s += 1000.0
    robot.body.catch_up()
    assert robot.body.time_s - before_s < 2.1


def test_a_calibration_of_other_joints_is_refused():
    with pytest.raises(ValueError, match='quadruped: expected servos of the joints front_left_hip'):
        SimulatedBody(EmulatedRobot(), body='quadruped', calibration=nominal())


def test_a_body_of_a_file_hangs_on_the_outputs_and_in_the_directions_that_the_file_names(tmp_path):
    robot = WholeRobot(tmp_path, body=str(DOG12))
    robot.arm()
    wiring = named(str(DOG12)).wiring
    assert {one.channel for one in wiring} != set(range(12))
    assert {one.direction for one in wiring} == {1, -1}
    asked = np.tile([0.1, -0.2, 0.25], 4)
    for _ in range(40):
        robot.frame(asked)
    assert robot.seen['joint_position_rad'] == pytest.approx(asked, abs=0.03)
