"""A simulated frame as ROS messages."""

from __future__ import annotations

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Quaternion, Vector3
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, JointState

from w2b_core.bodies.model import Body
from w2b_sim.engines.interface import Frame
from w2b_sim.rotation import into_body

IMU_FRAME, ODOM_FRAME = 'imu_link', 'odom'
#: Of each number, in its unit squared: a simulation knows exactly, and filters need more than 0.
EXACT_VARIANCE = 1e-9


def joint_states(frame: Frame, body: Body, stamp: Time) -> JointState:
    """Return the measured joints, in rad and rad/s."""
    message = JointState(name=[joint.name for joint in body.joints],
                         position=frame.joint_position_rad.tolist(),
                         velocity=frame.joint_velocity_rad_s.tolist())
    message.header.stamp = stamp
    return message


def contacts(frame: Frame, stamp: Time) -> JointState:
    """Return the touch sensors by their links: position 1 while they touch."""
    message = JointState(name=list(frame.touching),
                         position=[float(touch) for touch in frame.touching.values()])
    message.header.stamp = stamp
    return message


def imu(frame: Frame, stamp: Time, prefix: str) -> Imu:
    """Return what an IMU in the base shows, exactly (REP-145); its axes are the base's."""
    message = Imu(orientation=_quaternion(frame.orientation_xyzw),
                  angular_velocity=_vector(frame.imu.angular_velocity_rad_s),
                  linear_acceleration=_vector(frame.imu.specific_force_m_s2))
    message.header.frame_id = prefix + IMU_FRAME
    message.header.stamp = stamp
    for covariance in (message.orientation_covariance, message.angular_velocity_covariance,
                       message.linear_acceleration_covariance):
        covariance[:] = _diagonal(3)
    return message


def odometry(frame: Frame, body: Body, stamp: Time, prefix: str) -> Odometry:
    """Return the pose in `odom` and the velocity in the base's own frame, as Odometry asks for."""
    message = Odometry(child_frame_id=prefix + body.links[0].name)
    message.header.frame_id = prefix + ODOM_FRAME
    message.header.stamp = stamp
    message.pose.pose.position = Point(**_xyz(frame.position_m))
    message.pose.pose.orientation = _quaternion(frame.orientation_xyzw)
    message.pose.covariance = _diagonal(6)
    message.twist.twist.linear = _vector(into_body(frame.orientation_xyzw, frame.velocity_m_s))
    message.twist.twist.angular = _vector(
        into_body(frame.orientation_xyzw, frame.angular_velocity_rad_s))
    message.twist.covariance = _diagonal(6)
    return message


def _diagonal(size: int) -> list[float]:
    return (EXACT_VARIANCE * np.eye(size)).ravel().tolist()


def _xyz(vector: np.ndarray) -> dict[str, float]:
    return dict(zip('xyz', map(float, vector), strict=True))


def _vector(vector: np.ndarray) -> Vector3:
    return Vector3(**_xyz(vector))


def _quaternion(xyzw: np.ndarray) -> Quaternion:
    return Quaternion(**dict(zip('xyzw', map(float, xyzw), strict=True)))
