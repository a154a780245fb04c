"""Publishes frames on `/tf` and `/tf_static`, where the message type for them is installed."""

from __future__ import annotations

from collections.abc import Iterable
from importlib.util import find_spec

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Quaternion, TransformStamped, Vector3
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy

from w2b_description.frames import Transform
from w2b_ros.ros_messages import LATCHED

#: As tf2_ros has it: absolute names, that many messages kept for late readers.
TF, TF_STATIC, DEPTH = '/tf', '/tf_static', 100
#: ROS 2 from PyPI has no tf2_msgs.
MISSING = ('no tf: expected the package tf2_msgs, got none; build it with '
           '`.venv/bin/python scripts/build_tf2_msgs` (needs g++ and the headers of Python), or '
           'install ros-jazzy-tf2-msgs')


class TransformPublisher:
    """
    Publishes transforms.

    Parameters
    ----------
    node
        The node that publishes.
    prefix
        Before the names of all frames, such as dog1/.

    """

    def __init__(self, node: Node, prefix: str) -> None:
        self._prefix = prefix
        self.available = find_spec('tf2_msgs') is not None
        if not self.available:
            return
        from tf2_msgs.msg import TFMessage
        self._message = TFMessage
        self._moving = node.create_publisher(
            TFMessage, TF, QoSProfile(depth=DEPTH, reliability=ReliabilityPolicy.RELIABLE))
        self._fixed = node.create_publisher(TFMessage, TF_STATIC, LATCHED)

    @property
    def heard(self) -> bool:
        """Whether anybody listens to moving frames: else they need not be made."""
        return self.available and self._moving.get_subscription_count() > 0

    def moving(self, stamp: Time, transforms: Iterable[Transform]) -> None:
        """Publish frames that move."""
        self._moving.publish(self._to_message(stamp, transforms))

    def fixed(self, stamp: Time, transforms: Iterable[Transform]) -> None:
        """Publish all frames that do not move; they take the place of those published before."""
        if self.available:
            self._fixed.publish(self._to_message(stamp, transforms))

    def _to_message(self, stamp: Time, transforms: Iterable[Transform]) -> object:
        return self._message(transforms=[self._stamped(stamp, one) for one in transforms])

    def _stamped(self, stamp: Time, transform: Transform) -> TransformStamped:
        message = TransformStamped(child_frame_id=self._prefix + transform.child)
        message.header.frame_id = self._prefix + transform.parent
        message.header.stamp = stamp
        message.transform.translation = Vector3(
            **dict(zip('xyz', map(float, transform.place_m), strict=True)))
        message.transform.rotation = Quaternion(
            **dict(zip('xyzw', map(float, transform.turn_xyzw), strict=True)))
        return message
