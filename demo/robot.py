"""What the demo does to the robot over ROS 2: pause, reset, speak, watch."""

from __future__ import annotations

import subprocess
import time
from collections.abc import Callable, Sized
from dataclasses import dataclass, field

import numpy as np
import rclpy
from nav_msgs.msg import Odometry
from rclpy.client import Client
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState
from std_srvs.srv import SetBool, Trigger

from demo.ros_session import RosSession
from w2b_core.senses import heading_of
from w2b_ros.ros_messages import stamp_ns
from w2b_sim.sim_logic import first_stamp_ns

DEADLINE_S = 20.0


@dataclass
class Motion:
    """What was seen of the robot after a word: poses by stamp in ns, joint angles by stamp."""

    poses: dict[int, tuple[list[float], list[float]]] = field(default_factory=dict)
    joints: dict[int, list[float]] = field(default_factory=dict)

    @property
    def positions_m(self) -> np.ndarray:
        """Positions (T, 3) of the base, in time."""
        return np.array([self.poses[stamp][0] for stamp in sorted(self.poses)])

    @property
    def headings_rad(self) -> np.ndarray:
        """Directions (T,) of the base's x axis about the vertical, in time."""
        return np.array([heading_of(self.poses[stamp][1]) for stamp in sorted(self.poses)])

    @property
    def displacement_m(self) -> np.ndarray:
        """From the first position to the last, x and y."""
        positions = self.positions_m
        return (positions[-1] - positions[0])[:2]

    @property
    def path_length_m(self) -> float:
        """Length of the path in x-y."""
        return float(np.linalg.norm(np.diff(self.positions_m[:, :2], axis=0), axis=1).sum())


class Robot:
    """A client of the running sim and brain."""

    def __init__(self, session: RosSession) -> None:
        self._session = session
        self._node = Node('demo')
        self._motion: Motion | None = None
        self._frames = 0
        #: Of the first frame after the last start: what is older may still be on its way here.
        self._first_ns = 0
        self.joint_names: list[str] = []
        every = QoSProfile(depth=2000, reliability=ReliabilityPolicy.RELIABLE)
        self._node.create_subscription(Odometry, 'odom', self._on_odometry, every)
        self._node.create_subscription(JointState, 'joint_states', self._on_joints, every)
        self._pause = self._node.create_client(SetBool, 'sim/pause')
        self._reset = self._node.create_client(Trigger, 'sim/reset')

    def say(self, words: str) -> tuple[bool, str]:
        """
        Run `say`; return whether the brain accepted the words, and the first line of its answer.

        Words are said to a paused simulation: that no body follows yet is left out.
        """
        try:
            done = subprocess.run(['say', '--understood', words], env=self._session.environment,
                                  text=True, capture_output=True, timeout=DEADLINE_S, check=False)
        except subprocess.TimeoutExpired as error:
            raise RuntimeError(f'say {words!r} did not end in {DEADLINE_S:.0f} s') from error
        accepted = done.returncode == 0
        answer = (done.stdout if accepted else done.stderr).strip()
        return accepted, answer.partition('\n')[0].partition('; no body follows')[0]

    def start_over(self) -> None:
        """Pause the sim and put the robot back to its start."""
        self._call(self._pause, SetBool.Request(data=True))
        self._first_ns = first_stamp_ns(self._call(self._reset, Trigger.Request()).message)

    def watch(self, frames: int) -> Motion:
        """Let the sim go on for `frames` sensor frames and return what was seen; then pause."""
        motion = self._motion = Motion()
        self._frames = frames
        self._call(self._pause, SetBool.Request(data=False))
        self._wait(lambda: len(motion.poses) >= frames and len(motion.joints) >= frames,
                   f'{frames} sensor frames (got {len(motion.poses)})', deadline_s=60.0)
        self._motion = None
        self._call(self._pause, SetBool.Request(data=True))
        return motion

    def _on_odometry(self, message: Odometry) -> None:
        if self._motion is not None and self._counts(message, self._motion.poses):
            p, q = message.pose.pose.position, message.pose.pose.orientation
            self._motion.poses[stamp_ns(message.header.stamp)] = (
                [p.x, p.y, p.z], [q.x, q.y, q.z, q.w])

    def _on_joints(self, message: JointState) -> None:
        if self._motion is not None and self._counts(message, self._motion.joints):
            self.joint_names = list(message.name)
            self._motion.joints[stamp_ns(message.header.stamp)] = list(message.position)

    def _counts(self, message: Odometry | JointState, seen: Sized) -> bool:
        """Whether a message is of this start, and more are to be seen."""
        return stamp_ns(message.header.stamp) >= self._first_ns and len(seen) < self._frames

    def _call(self, client: Client, request: SetBool.Request | Trigger.Request
              ) -> SetBool.Response | Trigger.Response:
        self._wait(client.service_is_ready, f'the service {client.srv_name}')
        future = client.call_async(request)
        self._wait(future.done, f'an answer of {client.srv_name}')
        response = future.result()
        if not response.success:
            raise RuntimeError(f'{client.srv_name} refused: {response.message}')
        return response

    def _wait(self, condition: Callable[[], bool], what: str,
              deadline_s: float = DEADLINE_S) -> None:
        end = time.monotonic() + deadline_s
        while not condition():
            self._session.check_alive()
            if time.monotonic() > end:
                raise RuntimeError(f'waited {deadline_s:.0f} s for {what}')
            rclpy.spin_once(self._node, timeout_sec=0.2)
