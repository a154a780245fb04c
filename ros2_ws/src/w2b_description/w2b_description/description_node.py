"""The node `description`: the robot that is there, as a robot description and as frames."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from nav_msgs.msg import Odometry
from rclpy.node import Node
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import String

from w2b_core import bodies
from w2b_core.bodies.model import Body
from w2b_core.bodies.urdf import describe
from w2b_core.body_status import TOPIC, BodyStatus, BodyStatusError
from w2b_core.status import Level, Status
from w2b_description.footprint import Clearance, footprint
from w2b_description.frames import FrameTree, Transform
from w2b_description.transforms import MISSING, TransformPublisher
from w2b_ros.diagnostics import DiagnosticsReporter
from w2b_ros.frame_clock import FrameClock
from w2b_ros.parameters import Parameter, When, check_frame_id, declare
from w2b_ros.ros_messages import FRAMES_IN, LATCHED, other_publisher, stamp_ns

ODOM = 'odom'


def _check_body(name: str) -> None:
    if name:
        bodies.get(name)


def _check_prefix(value: str) -> None:
    check_frame_id(value + ODOM)


PARAMETERS = (
    Parameter('body', '', 'Body to describe, or the file of one; empty: the one that says its name '
              'on body_status.',
              when=When.START, check=_check_body),
    Parameter('frame_prefix', '', 'Before the names of the frames, such as dog1/: the same as of '
              'the body.', when=When.START, check=_check_prefix),
    Parameter('robot_description', True, 'Publish robot_description; false where '
              'robot_state_publisher does.', when=When.START),
    Parameter('joint_transforms', True, 'Publish the frames behind the joints; false where '
              'robot_state_publisher does.', when=When.START),
    Parameter('footprint', True, 'Publish base_footprint: the level frame on the floor below the '
              'base.', when=When.START),
    Parameter('diagnostics_topic', '/diagnostics', 'How the description is.', when=When.START,
              topic=True),
)
#: Odometry that was silent for this long is gone: the IMU tells the attitude instead.
ODOMETRY_SILENT_S = 1.0
LEVEL = np.array([0.0, 0.0, 0.0, 1.0])


class DescriptionNode(Node):
    """Publishes `robot_description`, `/tf` and `/tf_static`."""

    def __init__(self) -> None:
        super().__init__('description')
        self.exit_code: int | None = None
        declare(self, PARAMETERS)
        self._body: Body | None = None
        self._tree: FrameTree | None = None
        self._clearance: Clearance | None = None
        self._problem, self._foreign = '', ''
        self._attitude_xyzw = LEVEL
        self._odometry_at_s = float('-inf')
        self._frame_clock = FrameClock(self)
        self._description = (self.create_publisher(String, 'robot_description', LATCHED)
                             if self._flag('robot_description') else None)
        self._transforms = TransformPublisher(
            self, str(self.get_parameter('frame_prefix').value))
        self._reporter = DiagnosticsReporter(
            self, self._statuses, lambda: self._body.name if self._body else 'none',
            str(self.get_parameter('diagnostics_topic').value), self._frame_clock.now)
        name = str(self.get_parameter('body').value)
        if name:
            self._become(name)
        else:
            self.create_subscription(DiagnosticStatus, TOPIC, self._on_body_status, LATCHED)
        if self._transforms.available:
            self.create_subscription(JointState, 'joint_states', self._on_joints, FRAMES_IN)
            self.create_subscription(Odometry, 'odom', self._on_odometry, FRAMES_IN)
            self.create_subscription(Imu, 'imu/data', self._on_imu, FRAMES_IN)

    def _flag(self, name: str) -> bool:
        return bool(self.get_parameter(name).value)

    def _on_body_status(self, message: DiagnosticStatus) -> None:
        try:
            status = BodyStatus.from_values({item.key: item.value for item in message.values})
        except BodyStatusError as error:
            self.get_logger().warning(f'ignored: {error}', throttle_duration_sec=5.0)
            return
        # A name that comes from outside opens no file.
        if bodies.is_file(status.body):
            self._problem = f'{TOPIC}: expected the name of a body, got {status.body[:80]!r}'
        elif self._body is None or self._body.name != status.body:
            self._become(status.body)

    def _become(self, name: str) -> None:
        """Describe a body from now on."""
        try:
            self._body = bodies.get(name)
        except ValueError as error:
            self._problem = f'{error}; start this node with -p body:=FILE, or with its plugin in ' \
                            'W2B_PLUGINS, as the body'
            return
        self._problem = self._foreign = ''
        urdf = describe(self._body)
        self._tree = FrameTree(urdf)
        self._clearance = Clearance(self._body, self._tree)
        if self._description is not None:
            self._description.publish(String(data=urdf))
        if self._flag('joint_transforms'):
            self._transforms.fixed(self._frame_clock.now(), self._tree.fixed)
        self.get_logger().info(f'{name}: {len(self._body.links)} links, '
                               f'{len(self._tree.joints)} joints')

    def _on_joints(self, message: JointState) -> None:
        if self._tree is None or self._clearance is None:
            return
        self._frame_clock.frame(stamp_ns(message.header.stamp))
        positions = dict(zip(message.name, message.position, strict=False))
        unknown = sorted(set(positions) - set(self._tree.joints))
        self._foreign = '' if not unknown else (
            f'joint_states: {", ".join(unknown[:3])}: no joint of this body')
        if not self._transforms.heard:
            return
        found = self._tree.moving(positions) if self._flag('joint_transforms') else []
        if self._flag('footprint') and not self._odometry_flows:
            # On a physical robot nothing tells the height but the legs that stand.
            found.append(footprint(self._tree.root, self._attitude_xyzw, self._clearance.height_m(
                positions, self._attitude_xyzw)))
        if found:
            self._transforms.moving(message.header.stamp, found)

    @property
    def _odometry_flows(self) -> bool:
        return time.monotonic() - self._odometry_at_s < ODOMETRY_SILENT_S

    def _on_odometry(self, message: Odometry) -> None:
        self._odometry_at_s = time.monotonic()
        if self._tree is None or not self._transforms.heard:
            return
        place, turn = message.pose.pose.position, message.pose.pose.orientation
        turn_xyzw = np.array([turn.x, turn.y, turn.z, turn.w])
        found = [Transform(ODOM, self._tree.root, np.array([place.x, place.y, place.z]),
                           turn_xyzw)]
        if self._flag('footprint'):
            found.append(footprint(self._tree.root, turn_xyzw, place.z))
        self._transforms.moving(message.header.stamp, found)

    def _on_imu(self, message: Imu) -> None:
        # REP-145: a covariance that begins with -1 is that of a field that is not reported.
        turn = message.orientation
        known = message.orientation_covariance[0] != -1.0
        self._attitude_xyzw = np.array([turn.x, turn.y, turn.z, turn.w]) if known else LEVEL

    def _statuses(self) -> Sequence[Status]:
        return [self._description_status(), self._tf_status()]

    def _description_status(self) -> Status:
        name = 'description: robot_description'
        if self._problem:
            return Status(Level.ERROR, name, self._problem)
        if self._body is None:
            return Status(Level.WARN, name, f'no body says its name on {TOPIC}: start one')
        if self._description is not None:
            other = other_publisher(self, self._description.topic_name)
            if other:
                return Status(Level.WARN, name, f'{other} publishes it too: start this node with '
                              '-p robot_description:=false -p joint_transforms:=false')
        return Status(Level.OK, name, f'describes {self._body.name}')

    def _tf_status(self) -> Status:
        name = 'description: tf'
        if not self._transforms.available:
            return Status(Level.WARN, name, MISSING)
        if self._foreign:
            return Status(Level.WARN, name, self._foreign)
        what = 'odom and joints' if self._odometry_flows else 'joints; no odometry comes'
        return Status(Level.OK, name, f'frames of {what}')

    def close(self) -> None:
        """Nothing is held."""
