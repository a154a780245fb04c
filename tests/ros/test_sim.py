"""The sim node: what it publishes, its services, and its clock."""

import math

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState

from tests.ros.harness import EVERYTHING
from tests.ros.offline import FEET, JOINTS
from w2b_ros.ros_messages import stamp_ns


def collect(system, kind, topic):
    messages = []
    system.node.create_subscription(kind, topic, messages.append, EVERYTHING)
    return messages


def test_a_frame_is_one_stamp_on_every_topic(system):
    joints = collect(system, JointState, 'joint_states')
    contacts = collect(system, JointState, 'contacts')
    imu = collect(system, Imu, 'imu/data')
    odometry = collect(system, Odometry, 'odom')
    clock = collect(system, Clock, '/clock')
    system.start('sim')
    system.wait(lambda: joints and contacts and imu and odometry and clock, 'a frame')
    assert joints[0].name == JOINTS
    assert len(joints[0].position) == len(joints[0].velocity) == len(JOINTS)
    assert contacts[0].name == FEET
    assert set(contacts[0].position) <= {0.0, 1.0}
    assert (odometry[0].header.frame_id, odometry[0].child_frame_id) == ('odom', 'base_link')
    stamps = {stamp_ns(message.header.stamp) for message in (
        joints[0], contacts[0], imu[0], odometry[0])}
    assert stamps == {stamp_ns(clock[0].clock)} == {50_000_000}


@pytest.mark.parametrize('engine', ['pybullet', 'mujoco'])
def test_the_imu_of_either_engine_shows_gravity_with_the_frames_stamp(system, engine):
    joints = collect(system, JointState, 'joint_states')
    imu = collect(system, Imu, 'imu/data')
    sim = system.start('sim', body='physical_twin', engine=engine)
    system.wait(lambda: joints and imu, 'a frame')
    assert stamp_ns(joints[0].header.stamp) == stamp_ns(imu[0].header.stamp)
    assert imu[0].header.frame_id == 'imu_link'
    assert abs(imu[0].linear_acceleration.z - 9.81) < 1e-6
    assert imu[0].orientation.w == 1.0
    assert 0 < imu[0].orientation_covariance[8] < 1e-6
    assert f'moved by {engine}' in sim.log


def test_an_engine_that_there_is_not_is_refused_in_a_line(system):
    sim = system.start('sim', engine='ode')
    sim.may_fail = True
    system.wait(lambda: sim.exit_code is not None, 'the end of the sim')
    assert sim.exit_code == 1
    assert "engine: expected one of pybullet, mujoco, got 'ode'" in sim.log


def test_the_imu_has_the_bodys_attitude(system):
    imu = collect(system, Imu, 'imu/data')
    system.start('sim', start_yaw=0.5)
    system.wait(lambda: imu, 'a frame')
    first = imu[0]
    assert first.header.frame_id == 'imu_link'
    heading = 2.0 * math.atan2(first.orientation.z, first.orientation.w)
    assert heading == pytest.approx(0.5, abs=1e-3)


def test_without_an_answer_the_same_frame_is_sent_again(system):
    joints = collect(system, JointState, 'joint_states')
    system.start('sim', republish_timeout=0.05)
    system.wait(lambda: len(joints) >= 5, 'repetitions')
    assert len({stamp_ns(message.header.stamp) for message in joints}) == 1


def test_a_body_without_touch_sensors_has_no_contacts(system):
    system.start('sim', body='quadruped_blind')
    system.wait(lambda: system.positions_m, 'a frame')
    assert system.node.count_publishers('contacts') == 0


def test_seeded_starts_differ_a_little_and_repeat(system):
    starts = []
    for _ in range(2):
        sim = system.start('sim', seed=7)
        heights = []
        for _ in range(3):
            first = system.reset()
            system.wait(lambda first=first: first in system.positions_m, 'the start')
            heights.append(system.positions_m[first][2])
        starts.append(heights)
        sim.stop()
        # The next one begins with the same stamps.
        system.wait_for_no_sim()
        system.forget()
    assert starts[0] == starts[1]
    assert len(set(starts[0])) == 3
    assert all(0.12 - 1e-6 <= height <= 0.122 + 1e-6 for height in starts[0])


def test_start_parameters_and_heading(system):
    odometry = collect(system, Odometry, 'odom')
    system.start('sim', start_height=0.05, start_yaw=math.pi / 2)
    system.wait(lambda: odometry, 'a frame')
    pose = odometry[0].pose.pose
    assert math.isclose(pose.position.z, 0.17, abs_tol=1e-5)
    assert math.isclose(pose.orientation.z, math.sin(math.pi / 4), abs_tol=1e-9)


def test_paced_walks_with_the_clock_and_holds_still_without_a_brain(system):
    system.start('sim', real_time_factor=4.0)
    brain = system.start('brain')
    system.wait_for_brain()
    assert system.tell('forward')[0] == 0
    system.spin_for_frames(1)
    before = system.positions_m[max(system.positions_m)]
    system.spin_for_frames(200)
    walked = np.subtract(system.positions_m[max(system.positions_m)], before)
    assert walked[0] > 0.03
    brain.kill()
    system.wait_for_status('sim: targets', 1, 'no targets: the body holds its last targets')
    # Servos of 1 rad/s still have their way to go, and a body caught in mid-stride may sink.
    for _ in range(6):
        settled = system.positions_m[max(system.positions_m)]
        system.spin_for_frames(100)
        rest = np.subtract(system.positions_m[max(system.positions_m)], settled)
        if np.abs(rest).max() < 0.01:
            break
    assert np.abs(rest).max() < 0.01


def test_pause_after_stops_the_clock_at_that_frame(system):
    system.start('sim', pause_after=30)
    system.wait(lambda: system.positions_m, 'the first frame')
    system.start('brain')
    system.wait(lambda: len(system.positions_m) >= 30, '30 frames')
    system.wait_for_status('sim: clock', 0, 'lockstep, paused')
    first = system.reset()
    system.pause(False)
    last = first + 29 * 50_000_000
    system.wait(lambda: last in system.positions_m, '30 more frames')
    system.wait_for_status('sim: clock', 0, 'lockstep, paused')
    assert max(system.positions_m) == last


def test_another_body_in_the_same_domain_is_pointed_out_by_both(system):
    first = system.start('sim')
    system.wait_for_status('sim: clock', 0, 'lockstep')
    second = system.start('sim', '--ros-args', '-r', '__node:=other')
    for process, names in ((first, ['/other']), (second, ['/sim', '/other'])):
        # Until names are discovered, a node has none.
        system.wait(lambda process=process, names=names: any(
            f'node {name} also publishes on /joint_states' in process.log
            or f'name {name} also publishes on /joint_states' in process.log
            for name in names), f'{names} in the log of {process.name}')
    system.wait_for_status('sim: clock', 1, 'also publishes on /joint_states')
    second.stop()
    system.wait(lambda: system.node.count_publishers('joint_states') == 1, 'the end of the second')
    system.statuses.clear()
    system.wait_for_status('sim: clock', 0, 'lockstep')
    system.wait_for_status('sim: targets', 1, 'no targets: the body waits')


def test_a_parameter_that_there_is_not_is_pointed_out(system):
    sim = system.start('sim', real_time_facto=1.0, use_sim_time=False)
    system.wait(lambda: system.positions_m, 'a frame')
    warnings = [line for line in sim.log.splitlines() if 'no parameter' in line]
    assert len(warnings) == 1
    assert "no parameter 'real_time_facto' here; did you mean 'real_time_factor'?" in warnings[0]


def test_a_body_of_a_users_own_is_simulated(system, tmp_path):
    plugin = tmp_path / 'mine.py'
    plugin.write_text("""
from dataclasses import replace

from w2b_core.bodies import BODIES
from w2b_core.bodies.minimal import minimal

BODIES.add('small_walker', lambda: replace(minimal(), name='small_walker'))
""")
    system.set_environment(W2B_PLUGINS=str(plugin))
    joints = collect(system, JointState, 'joint_states')
    system.start('sim', body='small_walker')
    system.wait(lambda: joints, 'a frame of the body')
    assert joints[0].name == ['hinge']


def test_diagnostics_are_stamped_on_the_clock_of_the_frames(walking):
    """Of the sim and of a brain that was not told to use simulated time."""
    arrays = collect(walking, DiagnosticArray, '/diagnostics')
    walking.pause(False)
    walking.spin_for_frames(20)
    walking.pause(True)
    seen = len(arrays)
    walking.wait(lambda: {status.name.partition(':')[0] for array in arrays[seen:]
                          for status in array.status} == {'brain', 'sim'}, 'both')
    frames_ns = max(walking.positions_m)
    for array in arrays[seen:]:
        assert abs(stamp_ns(array.header.stamp) - frames_ns) < 10 * 10**9, array


def test_of_two_clocks_both_warn_and_a_clock_in_a_namespace_is_its_own(system):
    first = ('--ros-args', '-r', '__ns:=/dog1')
    system.start('sim', *first)
    second = system.start('sim', '--ros-args', '-r', '__ns:=/dog2')
    for dog in ('dog1', 'dog2'):
        status = system.wait_for_status(f'{dog}/sim: clock', 1, 'also publishes on /clock')
        assert 'start one with -p clock_topic:=clock' in status.message
    second.stop()
    system.wait(lambda: system.node.count_publishers('/clock') == 1, 'the end of the second')
    clocks = collect(system, Clock, '/dog2/clock')
    odometry = collect(system, Odometry, '/dog2/odom')
    system.start('sim', '--ros-args', '-r', '__ns:=/dog2', '-p', 'clock_topic:=clock', '-p',
                 'frame_prefix:=dog2/')
    system.wait(lambda: clocks and odometry, 'its own clock')
    assert odometry[0].header.frame_id == 'dog2/odom'
    system.statuses.clear()
    for dog in ('dog1', 'dog2'):
        system.wait_for_status(f'{dog}/sim: clock', 0, 'lockstep')
