"""What the hardware node says of each frame: joints, pulses, IMU. What nobody hears is not made."""

from __future__ import annotations

from typing import Any

from builtin_interfaces.msg import Time
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from sensor_msgs.msg import Imu, JointState, MagneticField

from w2b_hw import messages
from w2b_hw.imu.part import Part, Sample
from w2b_hw.robot import Report
from w2b_ros.ros_messages import FRAMES_OUT, to_stamp

PULSES = QoSProfile(depth=10)


class FramePublisher:
    """Publishes the reports of a robot for `node`, whose parameter `imu_frame_id` it reads."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._joint_states = node.create_publisher(JointState, 'joint_states', FRAMES_OUT)
        self._pulses = node.create_publisher(JointState, 'pulses', PULSES)
        self._imu_raw = node.create_publisher(Imu, 'imu/data_raw', FRAMES_OUT)
        self._imu_data = node.create_publisher(Imu, 'imu/data', FRAMES_OUT)
        self._imu_mag = node.create_publisher(MagneticField, 'imu/mag', FRAMES_OUT)

    @property
    def wants_poses(self) -> bool:
        """Whether somebody hears of the poses between frames."""
        return _heard(self._pulses)

    def frame(self, report: Report, part: type[Part] | None, stamp_ns: int) -> None:
        """Publish a frame; `part` is the IMU's kind, None without one."""
        stamp = to_stamp(stamp_ns)
        # First: the brain answers this one.
        self._joint_states.publish(messages.joint_states(report, stamp))
        if _heard(self._pulses):
            self._pulses.publish(messages.pulses(report, stamp))
        if part is not None and report.sample is not None:
            self._imu(report, report.sample, part, stamp)

    def pose(self, report: Report, stamp_ns: int) -> None:
        """Publish the pulses of a pose between two frames."""
        self._pulses.publish(messages.pulses(report, to_stamp(stamp_ns)))

    def _imu(self, report: Report, sample: Sample, part: type[Part], stamp: Time) -> None:
        frame_id = str(self._node.get_parameter('imu_frame_id').value)
        raw_heard, data_heard = _heard(self._imu_raw), _heard(self._imu_data)
        if raw_heard or data_heard:
            raw = messages.imu_raw(sample, part, frame_id, stamp)
            if raw_heard:
                self._imu_raw.publish(raw)
            if data_heard:
                self._imu_data.publish(messages.imu_data(raw, report))
        if sample.field_t is not None and _heard(self._imu_mag):
            self._imu_mag.publish(messages.magnetic_field(sample.field_t, part, frame_id, stamp))


def _heard(publisher: Publisher[Any]) -> bool:
    return bool(publisher.get_subscription_count())
