"""
The node `page`: serves the page, and stands between it and the robots' topics and services.

Two threads: ROS runs in the main one, the web server in its own. What a page asks for is queued and
done by the executor, as a task; what robots say goes to the server's loop.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Sequence
from functools import partial

from diagnostic_msgs.msg import DiagnosticArray

from w2b_core.status import Level, Status
from w2b_ros.diagnostics import DiagnosticsReporter
from w2b_ros.managed_node import ManagedNode
from w2b_ros.parameters import Parameter, When, declare
from w2b_ros.ros_messages import STEADY
from w2b_web.discovery import robots_of
from w2b_web.frames import listener
from w2b_web.hub import MOST_CLIENTS, Hub
from w2b_web.lights import Lights
from w2b_web.requests import Request
from w2b_web.robot import Robot
from w2b_web.security import access
from w2b_web.server import Server
from w2b_web.words import Suggestion, Words

PARAMETERS = (
    Parameter('autostart', True, 'Configure and activate without being asked.', when=When.START),
    Parameter('host', '127.0.0.1', 'Address to listen on. Other machines can reach the page only '
              'with certificate, private_key, secret_file and names.', when=When.ACTIVATE),
    Parameter('port', 8096, 'Port to listen on; one that is taken is an error.', (1, 65535),
              when=When.ACTIVATE),
    Parameter('names', '', 'Names, with commas between, by which browsers reach the page besides '
              'localhost, such as robot.local.', when=When.ACTIVATE),
    Parameter('certificate', '', 'PEM file of the TLS certificate.', when=When.ACTIVATE),
    Parameter('private_key', '', 'PEM file of its key.', when=When.ACTIVATE),
    Parameter('secret_file', '', 'File, readable by you alone, with the secret that a person has '
              'to type before the page opens.', when=When.ACTIVATE),
    Parameter('frame_rate', 20.0, 'Frames a second that a page gets at most.', (1.0, 60.0)),
)
#: How often new frames are looked for, and how often everything else is: each look takes time.
LOOK_S, CHECK_S = 0.03, 0.25
#: Between two looks at which robots there are.
DISCOVERY_S = 1.0


class PageNode(ManagedNode):
    """Active, it serves the page."""

    def __init__(self) -> None:
        super().__init__('page')
        declare(self, PARAMETERS, state=lambda: self.state_label)
        self._words = Words()
        self._asked: deque[tuple[str, Request | None, int]] = deque()
        self._ears = listener()
        self._server: Server | None = None
        self._hub = Hub(self)
        self._robots: dict[str, Robot] = {}
        self._lights = Lights()
        self._sent_at_s = self._looked_at_s = 0.0
        self.create_subscription(DiagnosticArray, '/diagnostics', self._on_diagnostics, 50)
        self._look = self.create_timer(LOOK_S, self._on_look, clock=STEADY)
        self._check = self.create_timer(CHECK_S, self._on_check, clock=STEADY)
        self._reporter = DiagnosticsReporter(self, self._statuses, lambda: 'browser')

    def _text(self, name: str) -> str:
        return str(self.get_parameter(name).value)

    # -- lifecycle

    def activate(self) -> None:
        """Serve the page (ValueError if it may not be, or if the port is taken)."""
        found = access(self._text('host'), int(self.get_parameter('port').value), **{
            name: self._text(name) for name in (
                'names', 'certificate', 'private_key', 'secret_file')})
        server = Server(found, self._hub)
        self._discover()
        server.start()
        self._server = server
        self.get_logger().info(f'open {found.address} in a browser')

    def deactivate(self) -> None:
        """Stop serving: what a page moved stands."""
        if self._server is None:
            return
        self._server.close()
        self._server = None
        self._on_asked()
        for robot in self._robots.values():
            robot.close()
        self._robots = {}

    def close(self) -> None:
        """Stop serving before the process ends."""
        super().close()
        self._ears.destroy_node()

    # -- from the pages; called in the server's thread

    def request(self, robot: str, request: Request, client: int) -> None:
        """Do what a page asks for, soon."""
        self._queue((robot, request, client))

    def page_lost(self, client: int) -> None:
        """Stop what a lost page moved, soon."""
        self._queue(('', None, client))

    def _queue(self, entry: tuple[str, Request | None, int]) -> None:
        # However often it is pressed: a stop that waits already is one.
        if entry not in self._asked:
            self._asked.append(entry)
            if self.executor is not None:
                self.executor.create_task(self._on_asked)

    def suggest(self, robot: str, prefix: str) -> list[Suggestion]:
        """Return words that begin so."""
        found = self._robots.get(robot)
        return self._words.suggest(prefix, {} if found is None else found.trained)

    # -- called in the executor

    def _on_asked(self) -> None:
        while self._asked:
            name, request, client = self._asked.popleft()
            if request is None:
                for robot in self._robots.values():
                    robot.lost(client)
            elif request.do == 'stop_all' or (request.do == 'stop' and name not in self._robots):
                for robot in self._robots.values():
                    robot.stop()
            elif name in self._robots:
                self._do(self._robots[name], request, client)

    @staticmethod
    def _do(robot: Robot, request: Request, client: int) -> None:
        if request.do == 'stop':
            robot.stop()
        elif request.do == 'say':
            robot.say(request.text, client)
        elif request.do == 'speed':
            robot.speed(request.number)
        else:
            robot.call(request.do)

    def _on_look(self) -> None:
        if self._server is None:
            return
        now_s = time.monotonic()
        if now_s - self._sent_at_s < 1.0 / float(self.get_parameter('frame_rate').value) - LOOK_S:
            return
        watched = self._hub.watched
        for name, robot in self._robots.items():
            robot.show(name in watched)
            if robot.send_frame():
                self._sent_at_s = now_s

    def _on_check(self) -> None:
        if self._server is None:
            return
        if time.monotonic() - self._looked_at_s > DISCOVERY_S:
            self._discover()
        for name, robot in self._robots.items():
            robot.check()
            if name in self._hub.watched and (text := self._lights.news(name)) is not None:
                self._hub.from_ros(self._hub.tell, name, 'lights', text)

    def _discover(self) -> None:
        self._looked_at_s = time.monotonic()
        own = self.get_namespace().rstrip('/')
        found = robots_of(self.get_topic_names_and_types(), own)
        # One that somebody looks at stays, and says that it is gone.
        names = list(dict.fromkeys([*found, *(
            name for name in self._robots if name in self._hub.watched)]))
        if names == list(self._robots):
            return
        for name in set(self._robots) - set(names):
            self._robots.pop(name).close()
        self._robots = {name: self._robots.get(name) or Robot(
            self, self._ears, name, self._hub, partial(self._lights.silent, name))
                        for name in names}
        self._hub.from_ros(self._hub.robots, names)

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            self._lights.take(status.name, status.level[0], status.message)

    def _statuses(self) -> Sequence[Status]:
        if self._server is None:
            return [Status(Level.WARN, 'page: server', f'{self.state_label}: no page is served')]
        pages, full = len(self._hub), len(self._hub) >= MOST_CLIENTS
        return [Status(Level.WARN if full else Level.OK, 'page: server',
                       f'serving {self._server.access.address}'
                       + (f', no more than {MOST_CLIENTS} pages at once' if full else ''),
                       {'pages': str(pages), 'refused': str(self._hub.refused)})]
