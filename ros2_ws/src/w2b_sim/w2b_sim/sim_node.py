"""
The node `sim`: a thin wrap of `sim_logic.SimulatedRobot` in topics, services and a clock.

It is a plain node, not a lifecycle node: it holds no device and drives nothing outside itself, so
a process that runs is a body that is there; pause and reset are what its users need.
"""

from __future__ import annotations

import math
import secrets
import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from builtin_interfaces.msg import Time
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.timer import Timer
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState
from std_srvs.srv import SetBool, Trigger
from trajectory_msgs.msg import JointTrajectory

from w2b_core import bodies, trajectory
from w2b_core.body_status import marked_epoch
from w2b_core.status import Level, Status
from w2b_core.trajectory import TrajectoryError
from w2b_ros.body_reporter import BodyReporter
from w2b_ros.diagnostics import DiagnosticsReporter
from w2b_ros.parameters import LARGEST_INTEGER, Parameter, When, check_frame_id, declare
from w2b_ros.ros_messages import (
    FRAMES_OUT,
    STEADY,
    TARGETS,
    other_publisher,
    to_stamp,
)
from w2b_ros.ros_process import StartError
from w2b_sim import sim_messages
from w2b_sim.engines import registry
from w2b_sim.engines.interface import Start
from w2b_sim.sim_logic import SimulatedRobot, reset_answer
from w2b_sim.worlds import WORLDS

#: In lockstep frames come faster than a busy listener reads: who records a run gets all of it.
LOG_OUT = QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=1000,
                     reliability=ReliabilityPolicy.RELIABLE)

#: What a seeded start may differ by from the nominal one.
SPREAD_HEIGHT_M = 0.002
SPREAD_TILT_RAD = math.radians(0.5)

#: Slower than that a frame takes 5 s: most likely a mistake.
SMALLEST_FACTOR = 0.01


def _check_factor(value: float) -> None:
    if 0.0 < value < SMALLEST_FACTOR:
        raise ValueError(f'expected 0 for lockstep or at least {SMALLEST_FACTOR}, got {value}')


def _check_prefix(value: str) -> None:
    check_frame_id(value + sim_messages.ODOM_FRAME)


PARAMETERS = (
    Parameter('body', 'physical_twin', 'Body to simulate.', when=When.START),
    Parameter('world', '', 'World to simulate it in; empty: the one the body is meant for.',
              when=When.START),
    Parameter('engine', registry.DEFAULT, 'What moves it: pybullet or mujoco.',
              when=When.START),
    Parameter('real_time_factor', 0.0, '0: lockstep, the body waits for the targets that answer '
              'each frame. Above 0: paced, simulated seconds a second, and can be set to '
              'another speed while it runs.', (0.0, 100.0), check=_check_factor),
    Parameter('republish_timeout', 0.5,
              'Seconds until a frame without an answer is sent again.', (0.05, 60.0),
              when=When.START),
    Parameter('paused', False, 'Start paused.', when=When.START),
    Parameter('pause_after', 0, 'Frames after a reset until the clock stops; 0: never.',
              (0, LARGEST_INTEGER), when=When.START),
    Parameter('seed', -1, f'Of the starts: each is raised by up to {SPREAD_HEIGHT_M * 1e3:g} mm '
              f'and tilted by up to {math.degrees(SPREAD_TILT_RAD):g} degrees; '
              '-1: all are exactly the nominal one.', (-1, LARGEST_INTEGER), when=When.START),
    Parameter('start_height', 0.0, 'Metres to raise the start by, from the next reset on.',
              (0.0, 1.0)),
    Parameter('start_roll', 0.0, 'Radians to tilt it about x.', (-math.pi, math.pi)),
    Parameter('start_pitch', 0.0, 'Radians to tilt it about y.', (-math.pi, math.pi)),
    Parameter('start_yaw', 0.0, 'Radians to turn it about z.', (-math.pi, math.pi)),
    Parameter('clock_topic', '/clock', 'Simulated time. Only one node can tell it on /clock: of '
              'several robots each has its own in its namespace, with clock.', when=When.START,
              topic=True),
    Parameter('frame_prefix', '', 'Before the names of the frames, such as dog1/: of several '
              'robots each has its own.', when=When.START, check=_check_prefix),
    Parameter('diagnostics_topic', '/diagnostics', 'How the simulation is.', when=When.START,
              topic=True),
)


class SimNode(Node):
    """Sends sensor frames, takes targets."""

    def __init__(self) -> None:
        super().__init__('sim')
        self.exit_code: int | None = None
        self._tick: Timer | None = None
        declare(self, PARAMETERS, applied=self._apply_speed)
        self.add_on_set_parameters_callback(self._refuse_another_clock)
        self._random = np.random.default_rng(max(0, self._integer('seed')))
        self._prefix = str(self.get_parameter('frame_prefix').value)
        self._process, self._resets = secrets.token_hex(4), 0
        self._robot = self._make_robot()
        self._joint_states = self.create_publisher(JointState, 'joint_states', LOG_OUT)
        self._contacts = (self.create_publisher(JointState, 'contacts', FRAMES_OUT)
                          if self._robot.frame.touching else None)
        self._imu = self.create_publisher(Imu, 'imu/data', FRAMES_OUT)
        self._odometry = self.create_publisher(Odometry, 'odom', LOG_OUT)
        self._clock_publisher = self.create_publisher(
            Clock, str(self.get_parameter('clock_topic').value), FRAMES_OUT)
        self.create_subscription(JointTrajectory, 'joint_trajectory', self._on_targets, TARGETS)
        self.create_service(Trigger, '~/reset', self._on_reset)
        self.create_service(SetBool, '~/pause', self._on_pause)
        self._body = BodyReporter(self, lambda: self._robot.body_status(
            self._epoch, self._number('real_time_factor')))
        self._reporter = DiagnosticsReporter(
            self, self._statuses, lambda: self._robot.body.name,
            str(self.get_parameter('diagnostics_topic').value), self._now)
        if self._robot.paced:
            self._tick = self.create_timer(
                self._period_s / self._number('real_time_factor'), self._on_tick, clock=STEADY)
        self._republish = self.create_timer(
            self._number('republish_timeout'), self._on_unanswered, clock=STEADY)
        if not self._robot.paused:
            self._publish_frame()

    def _number(self, name: str) -> float:
        return float(self.get_parameter(name).value)

    def _integer(self, name: str) -> int:
        return int(self.get_parameter(name).value)

    def _refuse_another_clock(self, given: list[RosParameter]) -> SetParametersResult:
        """Refuse to go from lockstep to a paced clock or back: frames would be lost or doubled."""
        for one in given:
            if one.name == 'real_time_factor' and (float(one.value) > 0.0) != self._robot.paced:
                return SetParametersResult(successful=False, reason=(
                    'real_time_factor: lockstep (0) and paced (above 0) cannot take turns: start '
                    f'the node again with -p real_time_factor:={one.value}'))
        return SetParametersResult(successful=True)

    def _apply_speed(self) -> None:
        if self._tick is not None:
            self._tick.timer_period_ns = round(
                self._period_s / self._number('real_time_factor') * 1e9)

    def _make_robot(self) -> SimulatedRobot:
        """Build what the parameters ask for (StartError)."""
        try:
            body = bodies.get(str(self.get_parameter('body').value))
        except ValueError as error:
            raise StartError(str(error)) from error
        name = str(self.get_parameter('world').value) or body.world
        if name not in WORLDS:
            raise StartError(f'unknown world {name!r}: expected one of {", ".join(WORLDS)}')
        world = WORLDS[name]
        self._period_s = world.control_period_s
        engine = str(self.get_parameter('engine').value)
        try:
            self._simulation = registry.make_simulation(engine, body, world)
        except ValueError as error:
            raise StartError(str(error)) from error
        robot = SimulatedRobot(
            body, self._simulation, next_start=self._next_start, period_s=self._period_s,
            paced=self._number('real_time_factor') > 0.0,
            pause_after=self._integer('pause_after'), clock=time.monotonic)
        robot.pause(bool(self.get_parameter('paused').value) or robot.paused)
        self.get_logger().info(f'{body.name} in the world {name}, moved by {engine}, '
                               f'{robot.clock_status().message}')
        return robot

    def _next_start(self) -> Start:
        height, roll, pitch, yaw = (self._number(f'start_{name}')
                                    for name in ('height', 'roll', 'pitch', 'yaw'))
        if self._integer('seed') >= 0:
            height += self._random.uniform(0.0, SPREAD_HEIGHT_M)
            roll += self._random.uniform(-SPREAD_TILT_RAD, SPREAD_TILT_RAD)
            pitch += self._random.uniform(-SPREAD_TILT_RAD, SPREAD_TILT_RAD)
        return Start(height, roll, pitch, yaw)

    @property
    def _epoch(self) -> str:
        """Epoch of the body: a word ends with a reset, and with the process."""
        return f'{self._process}.{self._resets}'

    def _on_targets(self, message: JointTrajectory) -> None:
        try:
            answered_ns = trajectory.nanoseconds('joint_trajectory: stamp', message.header.stamp)
            trajectory.check(message.joint_names, message.points, self._period_s)
        except TrajectoryError as error:
            self._robot.refuse(str(error))
            return
        if marked_epoch(message.header.frame_id) not in (None, '', self._epoch):
            self._robot.refuse('the word was said before the reset: say it again')
            return
        taken = self._robot.take(answered_ns, message.joint_names,
                                 [point.positions for point in message.points])
        if taken and not self._robot.paced:
            self._move_if_may()

    def _on_tick(self) -> None:
        self._move_if_may()

    def _move_if_may(self) -> None:
        if self._robot.may_move:
            self._robot.move()
            self._publish_frame()

    def _on_unanswered(self) -> None:
        """Send the frame again: the brain was not there, or the frame or its answer got lost."""
        if not self._robot.paused and not self._robot.paced and not self._robot.answered:
            self._publish_frame()

    def _on_reset(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._robot.reset()
        self._resets += 1
        # Before the answer and the frame: a word that is said after them is a new one.
        self._body.check()
        if not self._robot.paused:
            self._publish_frame()
        response.success = True
        response.message = reset_answer(self._robot.stamp_ns)
        return response

    def _on_pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        was_paused = self._robot.paused
        self._robot.pause(request.data)
        self._body.check()
        if was_paused and not request.data:
            if self._robot.answered and not self._robot.paced:
                self._move_if_may()
            else:
                self._publish_frame()
        response.success = True
        response.message = self._robot.clock_status().message
        return response

    def _publish_frame(self) -> None:
        self._republish.reset()
        frame, body, stamp = self._robot.frame, self._robot.body, self._now()
        self._clock_publisher.publish(Clock(clock=stamp))
        self._odometry.publish(sim_messages.odometry(frame, body, stamp, self._prefix))
        if self._contacts is not None:
            self._contacts.publish(sim_messages.contacts(frame, stamp))
        self._imu.publish(sim_messages.imu(frame, stamp, self._prefix))
        self._joint_states.publish(sim_messages.joint_states(frame, body, stamp))

    def _now(self) -> Time:
        """Return the simulated time."""
        return to_stamp(self._robot.stamp_ns)

    def _statuses(self) -> Sequence[Status]:
        return [self._robot.targets_status(), self._clock_status()]

    def _clock_status(self) -> Status:
        """How time goes, and who else sends frames: a brain takes those of one body only."""
        status = self._robot.clock_status()
        for publisher, todo in (
                (self._joint_states, 'stop one of them'), (self._odometry, 'stop one of them'),
                (self._clock_publisher, 'start one with -p clock_topic:=clock, and the nodes that '
                 'use its time with -r /clock:=clock')):
            other = other_publisher(self, publisher.topic_name)
            if other:
                return replace(status, level=Level.WARN, message=f'{status.message}; {other} '
                               f'also publishes on {publisher.topic_name}: {todo}')
        return status

    def close(self) -> None:
        """Leave the physics server."""
        self._simulation.close()
