"""The robot takes its joints from the description of its body; the twin is one."""

import math
from dataclasses import replace

import pytest

from w2b_core import bodies
from w2b_hw import calibration, joints
from w2b_hw.calibration import CalibrationError, nominal
from w2b_hw.calibration_session import Session, mark_rad
from w2b_hw.emulation.robot import EmulatedRobot
from w2b_hw.joints import TWIN, JointList, of_body
from w2b_hw.messages import joint_states
from w2b_hw.power import Power
from w2b_hw.robot import Robot
from w2b_hw.safety import State
from w2b_hw.servo_bank import ServoBank
from w2b_hw.targets import TargetGate, TargetRefusedError
from w2b_hw.transport import FrameBudget

ARM = JointList('arm', ('shoulder', 'elbow', 'grip'), (-1.0, -1.5, 0.2), (1.2, 0.3, 0.9))


def test_the_twin_is_as_it_was():
    assert TWIN.names == joints.JOINTS
    assert len(TWIN.names) == 12
    for name, low, high in zip(TWIN.names, TWIN.lower_rad, TWIN.upper_rad, strict=True):
        degrees = 30 if name.endswith('hip') else 45
        assert (math.degrees(low), math.degrees(high)) == pytest.approx((-degrees, degrees))
    assert TWIN.park_rad == (0.0,) * 12


@pytest.mark.parametrize('name', [name for name in bodies.names()
                                  if len(bodies.get(name).joints) > 0])
def test_every_body_makes_a_robot_that_arms_and_goes_where_it_is_told(name, tmp_path):
    driven = joints.named(name)
    path = tmp_path / 'c.yaml'
    calibration.save(nominal(joints=driven), path)
    found = calibration.load(path, driven)
    assert drive(found, [0.1] * len(driven.names)) == pytest.approx(
        [1500 + min(0.1, high) * 2000 / math.pi for high in driven.upper_rad], abs=5)


def drive(found, pose):
    """Arm a robot on emulated chips, send it to a pose; return the pulses of its servos."""
    chips = EmulatedRobot('none')
    robot = Robot(FrameBudget(chips.wire), found, Power(), clock=lambda: 0.0)
    robot.connect()
    gate = TargetGate(joints=found.joints.names)
    now_s = 100.0
    for number in range(120):
        now_s += 0.05
        robot.frame(now_s)
        stamp_ns = round(now_s * 1e9)
        robot.safety.take_target(gate.check(found.joints.names, [pose], stamp_ns, stamp_ns), now_s)
        if number == 5:
            assert robot.arm(now_s) is None
    report = robot.frame(now_s + 0.05)
    assert report.state is State.ACTIVE
    assert joint_states(report, None).name == list(found.joints.names)
    return list(report.pulses_us)


def test_limits_that_are_not_symmetric_hold_and_the_park_pose_is_within_them():
    assert ARM.park_rad == (0.0, 0.0, 0.2)
    found = nominal(joints=ARM)
    slope = 2000 / math.pi
    assert drive(found, [9.0, 9.0, 9.0]) == pytest.approx(
        [1500 + slope * value for value in (1.2, 0.3, 0.9)], abs=5)
    assert drive(found, [-9.0, -9.0, -9.0]) == pytest.approx(
        [1500 + slope * value for value in (-1.0, -1.5, 0.2)], abs=5)


def test_a_file_of_another_body_is_refused(tmp_path):
    path = tmp_path / 'c.yaml'
    calibration.save(nominal(joints=ARM), path)
    with pytest.raises(CalibrationError, match='expected each of the 12 joints once'):
        calibration.load(path)
    assert calibration.load(path, ARM).joints is ARM
    with pytest.raises(TargetRefusedError, match='another body'):
        TargetGate(joints=ARM.names).check(TWIN.names, [[0.0] * 12], 1, 1)


def test_a_mark_lies_on_the_side_that_the_joint_can_reach():
    assert math.degrees(mark_rad('shoulder', ARM)) == pytest.approx(45)
    assert math.degrees(mark_rad('elbow', ARM)) == pytest.approx(-45)
    assert mark_rad('grip', ARM) == pytest.approx(math.radians(45))
    bank = ServoBank(EmulatedRobot('none').wire, range(16))
    bank.connect()
    session = Session(bank, nominal(calibrated=False, joints=ARM))
    for key in 'ne' + '<' * 25 + 'm':
        session.press(key)
    assert session.message == '-45 degrees is here'
    servo = session.finished().servos[1]
    assert servo.direction == 1
    assert servo.angle_rad(1000) == pytest.approx(math.radians(-45))


def test_more_joints_than_outputs_are_refused_with_the_number():
    body = bodies.get('physical_twin')
    many = replace(body, joints=tuple(replace(body.joints[0], name=f'j{n}') for n in range(17)))
    with pytest.raises(ValueError, match=r'expected 1 to 16 joints.* got 17'):
        of_body(many)
