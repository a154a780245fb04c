"""
The newest sensor frame of a robot, read when it is needed.

A simulation in lockstep sends hundreds of frames a second and a page shows 20: no executor is woken
by each. The subscriptions are those of a node that none spins; `Frames.take` takes what is there,
one message deep.
"""

from __future__ import annotations

import time
from typing import Any

from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from sensor_msgs.msg import Imu, JointState

from w2b_ros.ros_messages import stamp_ns
from w2b_web.hub import message

NEWEST = QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=1,
                    reliability=ReliabilityPolicy.BEST_EFFORT)
#: Without one for so long a part of the frame is not shown any more.
OLD_S = 1.0
KINDS: dict[str, tuple[str, type]] = {
    'joints': ('joint_states', JointState), 'pose': ('odom', Odometry), 'imu': ('imu/data', Imu),
    'contacts': ('contacts', JointState)}


def listener() -> Node:
    """Return a node whose subscriptions nobody spins."""
    return Node('page_listener', use_global_arguments=False, start_parameter_services=False,
                enable_rosout=False)


class Frames:
    """
    The newest frame of one robot.

    Parameters
    ----------
    node
        The node that listens, see `listener`: not one that is spun.
    namespace
        Of the robot, empty for the root.

    """

    def __init__(self, node: Node, namespace: str) -> None:
        self._node = node
        self._subscriptions: dict[str, Subscription] = {
            name: node.create_subscription(kind, f'{namespace}/{topic}', lambda _message: None,
                                           NEWEST)
            for name, (topic, kind) in KINDS.items()}
        self._newest: dict[str, Any] = {}
        self._taken_at_s: dict[str, float] = {}
        self.joints: list[str] = []
        self.contacts: list[str] = []
        self.named = False

    def close(self) -> None:
        """Stop listening."""
        for subscription in self._subscriptions.values():
            self._node.destroy_subscription(subscription)

    def silent_s(self, part: str = 'joints') -> float:
        """Return for how long one of `KINDS` did not come; infinite before the first."""
        return time.monotonic() - self._taken_at_s.get(part, float('-inf'))

    def take(self) -> bool:
        """Take what is there; return whether there are new joints."""
        if not self._take('joints'):
            return False
        for name in KINDS:
            if name != 'joints':
                self._take(name)
        joints = list(self._newest['joints'].name)
        contacts = self._current('contacts')
        touching = [] if contacts is None else list(contacts.name)
        self.named = self.named and joints == self.joints and touching == self.contacts
        self.joints, self.contacts = joints, touching
        return True

    def _take(self, name: str) -> bool:
        subscription, taken = self._subscriptions[name], False
        with subscription.handle:
            while (found := subscription.handle.take_message(subscription.msg_type, False)):
                self._newest[name], taken = found[0], True
        if taken:
            self._taken_at_s[name] = time.monotonic()
        return taken

    def _current(self, name: str) -> Any:
        return None if self.silent_s(name) > OLD_S else self._newest[name]

    def names_text(self) -> str:
        """Return the message that names what the numbers of a frame are."""
        self.named = True
        return message('names', joints=self.joints, contacts=self.contacts)

    def text(self) -> str:
        """
        Return the frame as a message.

        `t` s, `p` position m and `o` orientation wxyz in `odom`, null without odometry; `o` is
        then the IMU's attitude, if it has one; `w` rad/s, `q` joints rad, `c` contacts.
        """
        joints, pose = self._newest['joints'], self._current('pose')
        imu, contacts = self._current('imu'), self._current('contacts')
        position = orientation = turn = None
        if pose is not None:
            point = pose.pose.pose.position
            position = [round(point.x, 4), round(point.y, 4), round(point.z, 4)]
            orientation = _wxyz(pose.pose.pose.orientation)
            turn = pose.twist.twist.angular
        if imu is not None:
            turn = imu.angular_velocity
            if orientation is None and imu.orientation_covariance[0] != -1.0:
                orientation = _wxyz(imu.orientation)
        return message(
            'f', t=round(stamp_ns(joints.header.stamp) / 1e9, 3), p=position, o=orientation,
            w=None if turn is None else [round(turn.x, 3), round(turn.y, 3), round(turn.z, 3)],
            q=[_finite(angle) for angle in joints.position],
            c=[] if contacts is None else [int(touch > 0.5) for touch in contacts.position])


def _wxyz(turn: Any) -> list[float]:
    return [round(turn.w, 5), round(turn.x, 5), round(turn.y, 5), round(turn.z, 5)]


def _finite(angle: float) -> float | None:
    """Return an angle that JSON can carry: a joint that is not measured has none."""
    return round(angle, 4) if abs(angle) < 1e6 else None
