"""Trajectories that would not be executed as they are written move neither robot nor simulation."""

import math

import numpy as np
from builtin_interfaces.msg import Duration
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from tests.ros.hardware import STILL_US, HardwareSystem
from tests.ros.offline import JOINTS as SIMULATED
from w2b_hw.joints import JOINTS
from w2b_ros.ros_messages import to_stamp


def bad_points(count):
    """Return points by kind, each with the reason for its refusal; none goes where it is."""
    def point(**fields):
        return JointTrajectoryPoint(positions=[0.3] * count, **fields)
    return {
        'in 10 s': (point(time_from_start=Duration(sec=10)), 'got 10 s'),
        'before now': (point(time_from_start=Duration(sec=-1)), 'got -1 s'),
        'nanosec': (point(time_from_start=Duration(nanosec=1_000_000_000)), 'nanosec below'),
        'velocities': (point(velocities=[0.5] * count), 'only positions are followed'),
        'velocities of another length': (point(velocities=[0.0]), 'none or one for each of'),
        'velocity NaN': (point(velocities=[math.nan] * count), 'nan'),
        'accelerations': (point(accelerations=[1.0] * count), 'only positions are followed'),
        'effort': (point(effort=[0.1] * count), 'effort: expected none')}


def message(names, point, stamp):
    trajectory = JointTrajectory(joint_names=list(names), points=[point])
    trajectory.header.stamp = stamp
    return trajectory


def test_a_robot_stays_where_it_is_and_says_why(system, tmp_path):
    robot = HardwareSystem(system, tmp_path)
    try:
        bad = []

        def answer(frame):
            for trajectory in bad:
                trajectory.header.stamp = frame.header.stamp
                robot.targets.publish(trajectory)
            robot.targets.publish(message(JOINTS, JointTrajectoryPoint(positions=[0.0] * 12),
                                          frame.header.stamp))
        robot.answering = True
        robot.answer = answer
        robot.arm()
        for point, reason in bad_points(12).values():
            bad[:] = [message(JOINTS, point, to_stamp(0))]
            system.statuses.clear()
            system.wait_for_status('hardware: targets', 1, reason)
            bad.clear()
        swing_us = np.ptp([pulses for _, pulses in robot.pin_history(0.0) if all(pulses)], axis=0)
        assert swing_us.max() < STILL_US, swing_us
        # A stamp of its own making, nanosec beyond a second.
        stamp = robot.frames[-1].header.stamp
        stamp.sec, stamp.nanosec = stamp.sec - 1, stamp.nanosec + 1_000_000_000
        robot.targets.publish(message(JOINTS, JointTrajectoryPoint(positions=[0.3] * 12), stamp))
        system.wait_for_status('hardware: targets', 1, 'stamp: expected a nanosec below')
    finally:
        robot.close()


def test_a_simulation_waits_on_and_says_why(system):
    system.start('sim')
    system.wait(lambda: system.positions_m, 'a frame')
    first, = system.positions_m
    publisher = system.node.create_publisher(JointTrajectory, 'joint_trajectory', 10)
    # The client itself listens to targets.
    system.wait(lambda: publisher.get_subscription_count() > 1, 'the sim')
    for point, reason in bad_points(len(SIMULATED)).values():
        system.statuses.clear()
        publisher.publish(message(SIMULATED, point, to_stamp(first)))
        system.wait_for_status('sim: targets', 1, reason)
    assert list(system.positions_m) == [first], 'the same frame again and again'
    publisher.publish(message(SIMULATED, JointTrajectoryPoint(
        positions=[0.3] * len(SIMULATED), velocities=[0.0] * len(SIMULATED),
        time_from_start=Duration(nanosec=50_000_000)), to_stamp(first)))
    system.wait(lambda: len(system.positions_m) == 2, 'the next frame')
