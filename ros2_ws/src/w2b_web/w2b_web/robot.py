"""One robot, as the pages that show it see it: what it says of itself, what is said to it."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import BatteryState
from std_msgs.msg import String

from w2b_core import bodies
from w2b_core.behaviours import BEHAVIOURS
from w2b_core.bodies.urdf import describe
from w2b_core.body_status import TOPIC, BodyStatus, BodyStatusError
from w2b_core.command import quoted
from w2b_core.following import BodyWatch
from w2b_ros.ros_messages import COMMANDS, LATCHED, reaches_all
from w2b_web import shape
from w2b_web.frames import OLD_S, Frames
from w2b_web.hub import Hub, message
from w2b_web.requests import LONGEST_TEXT
from w2b_web.senders import Senders
from w2b_web.services import Services
from w2b_web.voice.recogniser import DIRECT, HEARD_TOPIC
from w2b_web.words import trained_words

#: Commands that the strip shows.
SAID_SHOWN = 50
#: A brain that is known counts as one that hears after this time, whoever else is unconnected.
CONNECTS_S = 2.0
STOP = 'stop'
REFUSED = 2


class Robot:
    """
    One robot; used in the thread of the node's executor.

    Parameters
    ----------
    node
        The page's node.
    namespace
        Of the robot, empty for the root.
    ears
        The node that listens to frames, see `frames.listener`.
    hub
        The open pages.
    silent
        Returns whether a node of the robot reported and does not any more.

    """

    def __init__(self, node: Node, ears: Node, namespace: str, hub: Hub,
                 silent: Callable[[str], bool]) -> None:
        self.namespace = namespace
        self._node = node
        self._ears = ears
        self._hub = hub
        self._silent = silent
        self._services = Services(node, namespace)
        self._senders = Senders()
        self._watch = BodyWatch(time.monotonic)
        self._frames: Frames | None = None
        self._shape_of = ''
        self._state: dict[str, Any] = {}
        self._said: deque[dict[str, Any]] = deque(maxlen=SAID_SHOWN)
        self._received = -1
        self._epoch = ''
        self._controller_asked = False
        self.trained: dict[str, str] = {}
        self._seen_s = time.monotonic()
        self._commands = node.create_publisher(String, f'{namespace}/command', COMMANDS)
        self._subscriptions = [
            node.create_subscription(kind, f'{namespace}/{topic}', callback, profile)
            for topic, kind, callback, profile in (
                (TOPIC, DiagnosticStatus, self._on_body, LATCHED),
                ('command_answer', DiagnosticStatus, self._on_answer, LATCHED),
                ('robot_description', String, self._on_description, LATCHED),
                (HEARD_TOPIC, String, self._on_heard, COMMANDS),
                ('battery', BatteryState, self._on_battery, qos_profile_sensor_data))]

    def close(self) -> None:
        """Stop listening."""
        self.show(False)
        self._services.close()
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)
        self._node.destroy_publisher(self._commands)

    def _tell(self, kind: str, *, keep: bool = True, **values: Any) -> None:
        text = message(kind, **values)
        self._hub.from_ros(lambda: self._hub.tell(self.namespace, kind, text, keep=keep))

    # -- what it says of itself

    def _on_body(self, status: DiagnosticStatus) -> None:
        try:
            body = BodyStatus.from_values({item.key: item.value for item in status.values})
        except BodyStatusError as error:
            self._tell('note', level='bad', text=f'ignored: {error}', keep=False)
            return
        self._watch.take(body)
        if body.epoch != self._epoch:
            self._epoch = body.epoch
            self._senders.stopped()
        if self._shape_of not in ('robot_description', body.body):
            self._shape_of = body.body
            self._draw(body.body)
        self.check()

    def _draw(self, name: str) -> None:
        try:
            drawn = shape.read(describe(bodies.get(name)))
        except ValueError as error:
            drawn = {'name': name, 'links': [], 'joints': [], 'notes': [
                f'{error}; to see it, publish its URDF on robot_description: '
                'w2b description --ros-args -p body:=FILE']}
        self._tell('shape', **drawn)

    def _on_description(self, text: String) -> None:
        try:
            drawn = shape.read(text.data)
        except shape.ShapeError as error:
            self._tell('note', level='bad', text=str(error), keep=False)
            return
        self._shape_of = 'robot_description'
        self._tell('shape', **drawn)

    def _on_heard(self, text: String) -> None:
        """Put what `listen` heard into the box of the pages; it has said what stops by itself."""
        self._tell('heard', keep=False, text=text.data[:LONGEST_TEXT], sent=text.data in DIRECT)

    def _on_battery(self, battery: BatteryState) -> None:
        if battery.voltage == battery.voltage:
            self._tell('supply', volts=round(battery.voltage, 3))

    def _on_answer(self, answer: DiagnosticStatus) -> None:
        values = {item.key: item.value for item in answer.values}
        received = values.get('received', '')
        if not received.isdigit() or 'text' not in values:
            return
        level = answer.level[0]
        told = {'level': level, 'message': answer.message, 'text': values['text'],
                'received': int(received), **{key: values[key] for key in (
                    'behaviour', 'probability', 'trained', 'nearest', 'words', 'suggestions',
                    'body_follows', 'why_not') if key in values}}
        self._tell('answer', **told)
        if int(received) == 0:
            self._received = 0
            return
        self._note_sender(told)
        new = int(received) != self._received or (
            bool(self._said) and self._said[-1]['text'] != told['text'])
        self._received = int(received)
        entry = {'text': told['text'], 'level': level, 'message': answer.message,
                 'behaviour': told.get('behaviour', '') if level < REFUSED else '',
                 'at': time.time() if new or not self._said else self._said[-1]['at']}
        if not new and self._said:
            self._said.pop()
        self._said.append(entry)
        self._tell('said', entries=list(self._said))

    def _note_sender(self, told: dict[str, Any]) -> None:
        if told['level'] >= REFUSED:
            self._senders.refused(told['text'])
            return
        behaviour = told.get('behaviour')
        moves = (told['text'] != STOP if behaviour is None else
                 behaviour not in BEHAVIOURS or BEHAVIOURS.get(behaviour).moves)
        if told['message'].startswith('standing'):
            self._senders.stopped()
        elif int(told['received']) != self._received:
            self._senders.understood(told['text'], moves)

    # -- what the page sees of it

    def show(self, shown: bool) -> None:
        """Listen to its frames, or do not: only while somebody looks."""
        if shown and self._frames is None:
            self._frames = Frames(self._ears, self.namespace)
        elif not shown and self._frames is not None:
            self._frames.close()
            self._frames = None

    def send_frame(self) -> bool:
        """Send the newest frame to the pages if there is one; return whether there was."""
        if self._frames is None or not self._frames.take():
            return False
        if not self._frames.named:
            names = self._frames.names_text()
            self._hub.from_ros(self._hub.tell, self.namespace, 'names', names)
        self._hub.from_ros(self._hub.frame, self.namespace, self._frames.text())
        return True

    def check(self) -> None:
        """Tell the pages how the robot is, if that changed."""
        self._services.check()
        body = self._watch.now
        # A process that was killed stays in the graph until its lease ends.
        brain = not self._silent('brain') and bool(
            self._node.count_publishers(f'{self.namespace}/command_answer'))
        if not brain:
            self._seen_s = time.monotonic()
        # A listener that is no brain and never connects is not waited for for ever.
        brain = brain and bool(self._state.get('brain') or reaches_all(self._node, self._commands)
                               or time.monotonic() - self._seen_s > CONNECTS_S)
        if brain and not self._controller_asked and self._node.count_services(
                f'{self.namespace}/brain/get_parameters'):
            self._controller_asked = True
            self._services.controller(self._on_controller)
        self._controller_asked = brain and self._controller_asked
        frames = self._frames is not None and self._frames.silent_s() < OLD_S
        state: dict[str, Any] = {
            'brain': brain, 'frames': frames, 'body': '', 'state': 'none', 'reason': '',
            'follows': False, 'epoch': '', 'hardware': self.is_hardware}
        if body is not None:
            state.update(body=body.body, state=body.state, reason=body.reason,
                         follows=body.follows, epoch=body.epoch)
        if state != self._state:
            self._state = state
            self._tell('state', **state)

    def _on_controller(self, name: str) -> None:
        try:
            self.trained = trained_words(name)
        except (ValueError, OSError):
            # The brain's file may be on another machine: the vocabulary's words will do.
            self.trained = {}

    @property
    def is_hardware(self) -> bool | None:
        """Whether it is a physical robot, None as long as no body has said so."""
        return None if self._watch.last is None else self._watch.last.needs_arming

    # -- what is said to it

    def say(self, text: str, page: int) -> None:
        """Say a word."""
        self._senders.said(page, quoted(text))
        self._commands.publish(String(data=text))
        if not self._state.get('brain'):
            self._tell('note', level='bad', text=f'no brain hears {text!r}', keep=False)

    def stop(self) -> None:
        """Stop it: servos off; a simulation is told to stop and paused, with a brain or without."""
        self._commands.publish(String(data=STOP))
        asked = False
        for do in ('emergency_stop', 'pause'):
            if self._services.ready(do):
                asked = True
                self._services.call(do, self._answered(f'STOP ({do.replace("_", " ")})'))
        if not asked:
            self._tell('note', level='bad', keep=False, text='STOP: no body offers a stop here; '
                       'the word stop was sent. If anything moves, cut its power.')

    def lost(self, page: int) -> None:
        """Say stop to a physical robot that a page moved which can say nothing any more."""
        if self._senders.lost(page) and self.is_hardware is not False:
            self._commands.publish(String(data=STOP))
            self._node.get_logger().warning(
                f'{self.namespace or "/"}: the page that moved the robot is lost: said stop')
            self._tell('note', level='warn', keep=False, text='the page that moved the robot was '
                       'lost: the robot was told to stop')

    def call(self, do: str) -> None:
        """Ask its body for one of `services.CALLS`."""
        self._services.call(do, self._answered(do))

    def speed(self, factor: float) -> None:
        """Ask a simulation for another speed."""
        self._services.set_speed(factor, self._answered('speed'))

    def _answered(self, what: str) -> Callable[[bool, str], None]:
        def tell(done: bool, said: str) -> None:
            self._tell('note', level='ok' if done else 'bad', text=f'{what}: {said}', keep=False)
        return tell
