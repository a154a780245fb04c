"""The hardware node over real DDS, on emulated chips that outlive it."""

import signal
import time
from itertools import pairwise

import numpy as np
import pytest
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState

from tests.ros.hardware import HardwareSystem
from tests.ros.harness import System
from w2b_hw.joints import JOINTS
from w2b_hw.transport import Write
from w2b_ros.ros_messages import stamp_ns


@pytest.fixture
def mortal(system, tmp_path):
    """A robot of which a process may be killed."""
    robot = HardwareSystem(system, tmp_path)
    yield robot
    robot.close()


@pytest.fixture(scope='module')
def _shared_robot(environment, tmp_path_factory):
    system = System(environment, tmp_path_factory.mktemp('hardware'))
    robot = HardwareSystem(system, tmp_path_factory.mktemp('chips'))
    yield robot
    robot.close()
    system.close()


@pytest.fixture
def robot(_shared_robot):
    """One robot for all tests that leave it alive; each begins with the servos off."""
    robot = _shared_robot
    robot.answering = False
    robot.wait_for_frames()
    robot.wait_until_off()
    return robot


def transition(robot, label):
    request = ChangeState.Request(transition=Transition(label=label))
    return robot.system.call(ChangeState, 'hardware/change_state', request).success


def test_nothing_moves_until_it_is_armed_with_fresh_targets(robot):
    robot.wait_for_frames()
    refused = robot.trigger('arm')
    assert not refused.success
    assert 'no fresh targets' in refused.message
    robot.answering = True
    robot.spin(1.0)
    robot.wait_for_state('DISARMED')
    assert robot.off()
    started_s = time.monotonic()
    robot.walk()
    energised = [int(np.count_nonzero(pins)) for _, pins in robot.pin_history(started_s)]
    # Servo by servo; the count falls only to 0, where a busy machine made it give up.
    assert max(np.diff(energised)) == 1
    assert all(after == 0 for before, after in pairwise(energised) if after < before)
    assert energised[-1] == 12


def test_frames_say_what_was_really_sent_and_what_was_measured(robot):
    robot.walk()
    robot.wait_until_following()
    robot.frames.clear()
    frame = robot.system.wait(lambda: next((f for f in robot.frames if any(f.velocity)), None),
                              'a frame in motion')
    same = robot.system.wait(
        lambda: next((p for p in robot.pulses if p.header.stamp == frame.header.stamp), None),
        'the pulses of the same frame')
    assert list(frame.name) == list(same.name) == list(JOINTS)
    assert np.array(frame.velocity).any()
    # 2000 us for 180 degrees around 1500 us, in seconds.
    assert np.array(same.position) == pytest.approx(
        1500e-6 + np.array(frame.position) * 2000e-6 / np.pi, abs=1e-9)
    robot.system.wait(lambda: robot.imu_raw and robot.imu and robot.mag and robot.battery
                      and robot.imu[-1].orientation_covariance[0] >= 0,
                      'the IMU, settled, and the battery')
    raw, fused, mag = robot.imu_raw[-1], robot.imu[-1], robot.mag[-1]
    assert raw.header.frame_id == fused.header.frame_id == mag.header.frame_id == 'imu_link'
    assert raw.orientation_covariance[0] == -1  # REP-145: not reported
    assert raw.linear_acceleration.z == pytest.approx(9.81, abs=0.02)
    assert fused.orientation.w == pytest.approx(1, abs=1e-3)
    assert fused.orientation_covariance[8] > 100 > fused.orientation_covariance[0] > 0
    assert mag.magnetic_field.x == pytest.approx(22e-6, abs=1e-6)
    assert np.isnan(robot.battery[-1].voltage)
    assert {name for name in robot.system.statuses if name.startswith('hardware')} == {
        f'hardware: {part}' for part in ('safety', 'servos', 'imu', 'power', 'targets', 'frames')}

    def twenty_frames_in_a_second():
        stamps = [stamp_ns(f.header.stamp) for f in robot.frames]
        return any(abs(after - before - 10**9) < 5e7
                   for before, after in zip(stamps, stamps[20:], strict=False))
    robot.system.wait(twenty_frames_in_a_second, 'twenty frames in a second')


@pytest.mark.parametrize('number', [signal.SIGTERM, signal.SIGSTOP], ids=lambda n: n.name)
def test_a_process_that_ends_or_hangs_turns_all_channels_off_within_a_second(mortal, number):
    robot = mortal
    off_after_s = end(robot, number)
    assert off_after_s <= 1.0
    if number is signal.SIGTERM:
        assert robot.hardware.wait() == 0
    else:
        # Awake again, it must not go on where it was.
        robot.hardware.send(signal.SIGCONT)
        robot.wait_for_state('FAULT')
        assert robot.off()


def end(robot, number):
    """Send a signal to the walking robot's node; return after how long all channels are off."""
    robot.walk()
    assert not robot.off()
    ended_s = time.monotonic()
    robot.hardware.send(number)
    robot.wait_until_off()
    robot.spin(0.2)
    off_s, pins = robot.pin_history(ended_s)[-1]
    assert not pins.any()
    print(f'{number.name}: all channels off after {1e3 * (off_s - ended_s):.1f} ms')
    return off_s - ended_s


def test_a_killed_node_leaves_no_channel_on_and_its_successor_starts_relaxed(mortal):
    robot = mortal
    robot.hardware.killed = True
    assert end(robot, signal.SIGKILL) <= 1.0
    robot.hardware.wait()
    drive_by_hand(robot)
    robot.frames.clear()
    robot.hardware = robot.system.start('hardware', transport=f'emulated:{robot.socket}')
    robot.system.wait(lambda: robot.frames, 'the next node')
    assert robot.off()
    # As if there had been no guard: what systemd runs after the node has ended.
    robot.hardware.stop()
    drive_by_hand(robot)
    relax = robot.system.start('relax', '--transport', f'emulated:{robot.socket}')
    assert relax.wait() == 0
    assert robot.off()
    assert 'all channels' in relax.log


def drive_by_hand(robot):
    """Wake the chip and drive two channels, as a program that was killed leaves it."""
    robot.chips.transfer([Write(0x40, bytes([0x00, 0x20]))])
    robot.chips.transfer([Write(0x40, bytes([0x06, 0, 0, 0x33, 1, 0, 0, 0x33, 1]))])
    assert not robot.off()


def test_emergency_stop_then_arm_again(robot):
    taken_s = []
    # The machine's own delays only add: one stop in time shows that the robot needs no more.
    while not taken_s or (min(taken_s) >= 0.1 and len(taken_s) < 5):
        robot.walk()
        stopped_s = time.monotonic()
        assert robot.trigger('emergency_stop').success
        robot.wait_until_off()
        taken_s.append(robot.pin_history(stopped_s)[-1][0] - stopped_s)
        robot.wait_for_state('FAULT')
    assert min(taken_s) < 0.1, taken_s
    robot.spin(0.5)
    assert robot.off()
    robot.arm()
    assert robot.trigger('disarm').success
    robot.wait_for_state('DISARMED')
    assert robot.off()


def test_bad_targets_move_nothing_and_are_told(robot):
    robot.walk()
    robot.answering = False
    seen = len(robot.frames)
    robot.system.wait(lambda: len(robot.frames) > seen, 'a frame')
    robot.answer(robot.frames[-1], [float('nan')] * 12)
    robot.system.wait_for_status('hardware: targets', 1, 'finite numbers')
    robot.wait_for_state('DISARMED')
    assert robot.off()


def provoke(robot, request, texts, undo):
    """Do something to the chips under a driven robot, and wait for the fault that it is."""
    def told():
        status = robot.system.statuses.get('hardware: safety')
        return (status is not None and status.level[0] == 2
                and any(text in status.message for text in texts))
    for _ in range(5):
        robot.walk()
        robot.system.statuses.clear()
        robot.chips.request(request)
        # On a busy machine targets may stop first, and a robot that relaxed has no fault.
        robot.system.wait(lambda: told() or robot.state() == 'DISARMED', f'{texts}, or relaxed')
        if told():
            return
        robot.chips.request(undo)
    raise AssertionError(f'never driven when it happened\n{robot.system.logs()}')


def test_a_brown_out_is_a_fault_and_a_stuck_bus_is_told(robot):
    # Power that goes between two reads of a health check leaves a chip half as it was set up.
    provoke(robot, {'power_on': True}, ('lost power', 'not as it was set up'), {})
    assert robot.off()
    provoke(robot, {'held': True}, ('CUT THEIR SUPPLY',), {'held': False})
    released_s = time.monotonic()
    robot.chips.request({'held': False})
    robot.wait_until_off()
    assert robot.pin_history(released_s)[-1][0] - released_s < 1.0


def test_deactivating_turns_off_and_activating_starts_disarmed(robot):
    robot.walk()
    assert transition(robot, 'deactivate')
    ended_ns = robot.now_ns()
    assert robot.off()
    robot.spin(0.5)
    # What was under way may still arrive, and nothing that was made since.
    assert all(stamp_ns(frame.header.stamp) <= ended_ns for frame in robot.frames)
    assert not robot.trigger('arm').success
    robot.frames.clear()
    assert transition(robot, 'activate')
    robot.wait_for_frames()
    assert robot.off()
    robot.arm()


@pytest.mark.parametrize(('parameters', 'message'), [
    ({'calibration': '/nowhere/c.yaml', 'transport': 'emulated'},
     'no calibration file at /nowhere/c.yaml: make one with'),
    ({}, 'no calibration file at'),
    ({'transport': 'emulatd'}, 'transport: expected a device such as /dev/i2c-1, emulated, '
                               'emulated:SOCKET, simulated, simulated:ENGINE or '
                               "simulated:/SOCKET, got 'emulatd'"),
    ({'transport': 'emulated', 'imu': 'mpu6050'}, 'imu: expected one of auto, none')])
def test_what_is_missing_is_said_in_one_line_and_the_process_ends(system, parameters, message,
                                                                  tmp_path, monkeypatch):
    monkeypatch.setitem(system._environment, 'HOME', str(tmp_path))
    hardware = system.start('hardware', **parameters)
    system.wait(lambda: hardware.exit_code is not None, 'its end')
    assert hardware.exit_code == 1
    assert message in hardware.log
    assert 'Traceback' not in hardware.log


def test_the_whole_robot_without_hardware_in_one_command(system):
    from sensor_msgs.msg import JointState
    frames, pulses = [], []
    system.node.create_subscription(JointState, 'joint_states', frames.append, 10)
    system.node.create_subscription(JointState, 'pulses', pulses.append, 10)
    system.start('hardware', transport='emulated')
    system.wait(lambda: len(frames) > 3 and len(pulses) > 3, 'frames')
    assert list(frames[-1].position) == [0.0] * 12
    assert list(pulses[-1].position) == [0.0] * 12
