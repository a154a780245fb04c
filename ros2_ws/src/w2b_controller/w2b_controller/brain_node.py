"""
The node `brain`: a thin wrap of `brain_logic.Brain` in topics, parameters and a lifecycle.

Controller and vocabulary are loaded when it is configured, topics and times read when activated.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

from builtin_interfaces.msg import Duration
from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.subscription import Subscription
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import String
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from w2b_controller.twist_input import TwistInput
from w2b_core.body_status import TOPIC, BodyStatus, BodyStatusError, mark
from w2b_core.brain import Brain, Targets
from w2b_core.command import Answer, quoted
from w2b_core.controller import file as controller_file
from w2b_core.controller.file import Controller
from w2b_core.hearing import Ear, EarError
from w2b_core.status import Level, Status
from w2b_core.twist import Full, TwistDriver, words_of
from w2b_core.vocabulary import Vocabulary
from w2b_ros.diagnostics import DiagnosticsReporter
from w2b_ros.frame_clock import FrameClock
from w2b_ros.managed_node import ManagedNode
from w2b_ros.parameters import Parameter, When, declare
from w2b_ros.ros_messages import (
    COMMANDS,
    FRAMES_IN,
    LATCHED,
    NS_PER_S,
    TARGETS,
    full_name,
    publisher_name,
    stamp_ns,
    to_diagnostic,
    to_stamp,
)


def _load_controller(name: str) -> Controller:
    return controller_file.load(controller_file.resolve(name))


def _tuned(controller: Controller, strictness: float, priority: str) -> Controller:
    """Return the controller with its ear as the parameters have it (EarError)."""
    names = tuple(name.strip() for name in priority.split(',') if name.strip())
    if not strictness and not names:
        return controller
    if not isinstance(controller.ear, Ear):
        raise EarError('hearing_strictness, hearing_priority: expected a controller with an ear, '
                       f'got one of {controller.body} that is primed; leave them at 0 and empty')
    return replace(controller, ear=controller.ear.tuned(strictness, names))


PARAMETERS = (
    Parameter('autostart', True, 'Configure and activate without being asked.', when=When.START),
    Parameter('controller', 'physical_twin',
              "Name of a controller that ships, path of a controller file, or of a robot's YAML "
              'whose controller lies beside it.',
              when=When.CONFIGURE, check=_load_controller),
    Parameter('vocabulary', 'default',
              'default (embedded), name of an installed one, or path of a word2vec file.',
              when=When.CONFIGURE, check=Vocabulary.load),
    Parameter('hearing_strictness', 0.0, 'Added to the threshold of the ear: how much more like a '
              'command a word must be that it never heard.', (-20.0, 20.0), when=When.CONFIGURE),
    Parameter('hearing_priority', '', 'All behaviours with commas between, stop first: of two in '
              'one clause the earlier wins. Empty: as the ear has it.', when=When.CONFIGURE),
    Parameter('frame_timeout', 0.5, 'Seconds without a sensor frame until they count as lost.',
              (0.05, 60.0)),
    Parameter('command_timeout', 0.0, 'Seconds that a word lasts; then the robot stands until it '
              'is said again. 0: as long as nothing else ends it.', (0.0, 86400.0)),
    Parameter('claim_wait', 1.0, 'Seconds after its start that a brain looks for another one '
              'before it sends targets.', (0.0, 60.0), when=When.ACTIVATE),
    Parameter('command_topic', 'command', 'Words to hear (std_msgs/String).',
              when=When.ACTIVATE, topic=True),
    Parameter('command_answer_topic', 'command_answer',
              'What became of a command (diagnostic_msgs/DiagnosticStatus, latched).',
              when=When.ACTIVATE, topic=True),
    Parameter('joint_states_topic', 'joint_states', 'Measured joints (sensor_msgs/JointState).',
              when=When.ACTIVATE, topic=True),
    Parameter('contacts_topic', 'contacts',
              'Touch sensors, 1 while they touch (sensor_msgs/JointState).',
              when=When.ACTIVATE, topic=True),
    Parameter('imu_topic', 'imu/data',
              'Attitude (sensor_msgs/Imu), for controllers that sense it.',
              when=When.ACTIVATE, topic=True),
    Parameter('cmd_vel', True, 'Whether velocities (geometry_msgs/Twist) move the robot, too.',
              when=When.ACTIVATE),
    Parameter('cmd_vel_topic', 'cmd_vel', 'Velocities of joysticks, keyboards, navigation.',
              when=When.ACTIVATE, topic=True),
    Parameter('cmd_vel_timeout', 1.0, 'Seconds that a velocity lasts: without a new one the robot '
              'stands.', (0.1, 10.0)),
    Parameter('cmd_vel_speed', 0.18, 'Speed in m/s that counts as full: of a velocity that asks '
              'for both, the larger share is followed.', (0.01, 10.0)),
    Parameter('cmd_vel_turn', 0.27, 'Turn in rad/s that counts as full.', (0.01, 20.0)),
    Parameter('body_status_topic', TOPIC,
              'How the body is (diagnostic_msgs/DiagnosticStatus, latched).',
              when=When.ACTIVATE, topic=True),
    Parameter('joint_trajectory_topic', 'joint_trajectory',
              'Where the joints shall go (trajectory_msgs/JointTrajectory).',
              when=When.ACTIVATE, topic=True),
    Parameter('diagnostics_topic', '/diagnostics', 'How the brain is.', when=When.START,
              topic=True),
)
RIVAL = 'another brain is active: neither sends targets until one is stopped'


class BrainNode(ManagedNode):
    """Hears words, senses frames, sends targets."""

    def __init__(self) -> None:
        super().__init__('brain')
        self._started_at_s = time.monotonic()
        self._controller: Controller | None = None
        self._vocabulary: Vocabulary | None = None
        self._brain: Brain | None = None
        declare(self, PARAMETERS, state=lambda: self.state_label, applied=self._apply_parameters)
        self._twist: TwistInput | None = None
        self._epoch = ''
        self._rival = False
        self._logged = ''
        self._frame_clock = FrameClock(self)
        self._ears: list[Subscription] = []
        self._reporter = DiagnosticsReporter(
            self, self._statuses, self._hardware_id, self._topic('diagnostics'),
            self._frame_clock.now)

    def _text(self, name: str) -> str:
        return str(self.get_parameter(name).value)

    def _number(self, name: str) -> float:
        return float(self.get_parameter(name).value)

    def _topic(self, name: str) -> str:
        """Return the full name of a topic parameter."""
        return self.resolve_topic_name(self._text(f'{name}_topic'))

    def _apply_parameters(self) -> None:
        """Take over what can be set at any time."""
        if self._brain is not None:
            self._brain.set_timeouts(frame_s=self._number('frame_timeout'),
                                     command_s=self._number('command_timeout'))
        if self._twist is not None:
            self._twist.driver.configure(self._full(), self._number('cmd_vel_timeout'))

    def _full(self) -> Full:
        return Full(self._number('cmd_vel_speed'), self._number('cmd_vel_turn'))

    def configure(self) -> None:
        """Load controller and vocabulary (ValueError, OSError)."""
        name = self._text('controller')
        self._controller = _tuned(_load_controller(name), self._number('hearing_strictness'),
                                  self._text('hearing_priority'))
        self._vocabulary = Vocabulary.load(self._text('vocabulary'))
        self.get_logger().info(
            f'{self._controller.body}, controller {name}, words from {self._vocabulary.source}')

    def activate(self) -> None:
        """Listen and answer, unless another brain does (ValueError)."""
        assert self._controller is not None
        assert self._vocabulary is not None
        self._look_for_another_brain()
        self._brain = Brain(self._controller, self._vocabulary, clock=time.monotonic,
                            frame_timeout_s=self._number('frame_timeout'),
                            command_timeout_s=self._number('command_timeout'))
        self._targets = self.create_publisher(
            JointTrajectory, self._topic('joint_trajectory'), TARGETS)
        self._answers = self.create_publisher(
            DiagnosticStatus, self._topic('command_answer'), LATCHED)
        self._logged = ''
        self._publish_answer(self._brain.greet())
        # In this order the executor takes what is there at once: a word that was said after the
        # body began a new epoch is heard after it.
        self._ears = [
            self.create_subscription(DiagnosticStatus, self._topic('body_status'),
                                     self._on_body_status, LATCHED),
            self.create_subscription(String, self._topic('command'), self._on_command, COMMANDS),
            self.create_subscription(JointState, self._topic('joint_states'),
                                     self._on_joint_states, FRAMES_IN)]
        if self._brain.uses_contacts:
            self._ears.append(self.create_subscription(
                JointState, self._topic('contacts'), self._on_contacts, FRAMES_IN))
        if self._brain.uses_imu:
            self._ears.append(self.create_subscription(
                Imu, self._topic('imu'), self._on_imu, FRAMES_IN))
        if self.get_parameter('cmd_vel').value:
            self._twist = TwistInput(
                self, self._topic('cmd_vel'), TwistDriver(
                    words_of(self._controller), self._full(), self._number('cmd_vel_timeout'),
                    time.monotonic),
                hear=self._on_twist_word, stand=self._stand, renew=self._brain.renew)

    def deactivate(self) -> None:
        """Neither listen nor answer: the body gets no more targets."""
        if self._brain is None:
            return
        self._brain = None
        if self._twist is not None:
            self._twist.close()
            self._twist = None
        for subscription in self._ears:
            self.destroy_subscription(subscription)
        self._ears = []
        self.destroy_publisher(self._answers)
        self.destroy_publisher(self._targets)

    def cleanup(self) -> None:
        """Forget controller and vocabulary."""
        self._controller = self._vocabulary = None

    def _look_for_another_brain(self) -> None:
        """Look until `claim_wait` seconds after the start: discovery takes its time."""
        until_s = self._started_at_s + float(self.get_parameter('claim_wait').value)
        while True:
            for topic in (self._topic('joint_trajectory'), self._topic('command_answer')):
                others = self.get_publishers_info_by_topic(topic)
                if others:
                    raise ValueError(f'{publisher_name(others[0])} already publishes on {topic}, '
                                     'and two brains cannot move one body: stop it first')
            if time.monotonic() >= until_s:
                return
            time.sleep(0.02)

    def _on_command(self, message: String) -> None:
        if self._hear(message.data) and self._twist is not None:
            # Who speaks takes over: a velocity that is held since before counts no more.
            self._twist.driver.block(f'{quoted(message.data)!r} was said')

    def _hear(self, text: str) -> bool:
        """Hear and answer; return whether it is followed."""
        assert self._brain is not None
        if self._check_rival():
            answer = self._brain.refuse(text, RIVAL)
        else:
            answer = self._brain.hear(text)
            if answer.level is not Level.ERROR:
                answer = self._brain.with_following(answer, self._body_there())
        self._publish_answer(answer)
        self._log_answer(answer)
        return answer.level is not Level.ERROR

    def _on_twist_word(self, word: str) -> None:
        """Hear the word that a velocity asks for."""
        if not self._hear(word) and self._twist is not None:
            self._twist.block(f'the brain refused {word!r}')

    def _stand(self, reason: str) -> None:
        """Let the robot stand because velocities ended."""
        if self._brain is not None:
            self._brain.stand(reason)
            self._tell_if_stopped(of_twist=True)

    def _log_answer(self, answer: Answer) -> None:
        """Log an answer, unless it is the last one again: a word may be said every second."""
        line = f'heard {answer.heard!r}: {answer.message}'
        if line == self._logged:
            return
        self._logged = line
        # rclpy allows one severity a line of code.
        if answer.level is Level.OK:
            self.get_logger().info(line)
        else:
            self.get_logger().warning(line)

    def _body_there(self) -> bool:
        return bool(self.count_publishers(self._topic('body_status')))

    def _on_body_status(self, message: DiagnosticStatus) -> None:
        if self._brain is None:
            return
        try:
            status = BodyStatus.from_values({item.key: item.value for item in message.values})
        except BodyStatusError as error:
            self.get_logger().warning(f'ignored: {error}', throttle_duration_sec=5.0)
            return
        self._brain.body(status)
        if status.epoch != self._epoch:
            self._epoch = status.epoch
            if self._twist is not None:
                self._twist.block(f'the body is {status.state} ({status.reason})')
        self._tell_news()

    def _tell_if_stopped(self, of_twist: bool = False) -> None:
        """Take back the answer to a word that ended by itself."""
        answer = None if self._brain is None else self._brain.stopped()
        if answer is not None:
            if not of_twist and self._twist is not None:
                self._twist.driver.block(answer.message)
            self._publish_answer(answer)
            self._logged = ''
            self.get_logger().warning(answer.message)

    def _tell_news(self) -> None:
        """Publish the answer again if the word ended or a body began to follow it."""
        if self._brain is not None:
            self._brain.end_old_word()
        self._tell_if_stopped()
        answer = None if self._brain is None else self._brain.news(self._body_there())
        if answer is not None:
            self._publish_answer(answer)
            self._log_answer(answer)

    def _publish_answer(self, answer: Answer) -> None:
        values = {'received': str(answer.received), 'text': answer.heard, **answer.values}
        status = Status(answer.level, full_name(self, 'brain: command'), answer.message, values)
        self._answers.publish(to_diagnostic(status, self._hardware_id()))

    def _on_joint_states(self, message: JointState) -> None:
        if self._twist is not None:
            # Before the answer: on a busy machine the timer may come late.
            self._twist.check()
        if self._brain is not None and not self._check_rival():
            self._send(self._brain.joint_states(
                stamp_ns(message.header.stamp), message.name, message.position))

    def _on_contacts(self, message: JointState) -> None:
        if self._brain is not None and not self._check_rival():
            self._send(self._brain.contacts(
                stamp_ns(message.header.stamp), message.name, message.position))

    def _on_imu(self, message: Imu) -> None:
        if self._brain is not None and not self._check_rival():
            orientation, turn = message.orientation, message.angular_velocity
            # REP-145: a covariance that begins with -1 is that of a field that is not reported.
            known = message.orientation_covariance[0] != -1.0
            self._send(self._brain.imu(
                stamp_ns(message.header.stamp),
                (orientation.x, orientation.y, orientation.z, orientation.w) if known else None,
                (turn.x, turn.y, turn.z)))

    def _send(self, targets: Targets | None) -> None:
        self._tell_if_stopped()
        if targets is None:
            return
        self._frame_clock.frame(targets.stamp_ns)
        seconds, rest = divmod(round(targets.period_s * NS_PER_S), NS_PER_S)
        message = JointTrajectory(
            joint_names=list(targets.joints),
            points=[JointTrajectoryPoint(positions=targets.position_rad.tolist(),
                                         time_from_start=Duration(sec=seconds, nanosec=rest))])
        message.header.stamp = to_stamp(targets.stamp_ns)
        message.header.frame_id = mark(targets.word_epoch)
        self._targets.publish(message)

    def _check_rival(self) -> bool:
        """Return whether a second brain is active: two that start at once find each other so."""
        if self._brain is None:
            return False
        rival = (self.count_publishers(self._answers.topic_name) > 1
                 and self.count_publishers(self._targets.topic_name) > 1)
        if rival != self._rival:
            self._rival = rival
            self._brain.stand('another brain was active')
            self._tell_news()
        return rival

    def _hardware_id(self) -> str:
        return self._controller.body if self._controller is not None else 'none'

    def _statuses(self) -> Sequence[Status]:
        if self._brain is None:
            message = f'{self.state_label}: no targets are sent'
            return [Status(Level.WARN, 'brain: frames', message),
                    Status(Level.WARN, 'brain: command', message)]
        self._tell_news()
        twist = [] if self._twist is None else [self._twist.status()]
        return [self._frames_status(self._brain.frames_status()),
                self._command_status(self._brain.command_status()), *twist]

    def _frames_status(self, status: Status) -> Status:
        topic = self._topic('joint_states')
        bodies = self.count_publishers(topic)
        if bodies > 1 and status.level is Level.OK:
            return replace(status, level=Level.WARN,
                           message=f'{status.message}; {bodies} nodes publish on {topic}')
        return status

    def _command_status(self, status: Status) -> Status:
        if self._check_rival():
            return replace(status, level=Level.ERROR, message=RIVAL)
        topic = self._targets.topic_name
        if self.count_publishers(topic) > 1:
            return replace(status, level=Level.WARN,
                           message=f'{status.message}; another node publishes on {topic}')
        return status
