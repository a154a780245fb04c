"""Publish the status of a node: on /diagnostics at 1 Hz and on change, and in the log."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node

from w2b_core.status import Level, Status
from w2b_ros.ros_messages import STEADY, full_name, to_diagnostic

#: How often changes are looked for, which bounds the messages that flapping states cause.
CHECK_S = 0.1
PERIOD_S = 1.0
#: Between two lines of the log about the same part, unless it got worse.
LOG_S = 1.0


class DiagnosticsReporter:
    """
    Publishes what `statuses` returns.

    Parameters
    ----------
    node
        The node that reports.
    statuses
        Returns the statuses of now.
    hardware_id
        Returns what the node drives, such as the body's name (REP-107).
    topic
        Where to publish.
    now
        Returns the time to stamp with, on the clock of the sensor frames; the node's if not given.

    """

    def __init__(self, node: Node, statuses: Callable[[], Sequence[Status]],
                 hardware_id: Callable[[], str], topic: str = '/diagnostics',
                 now: Callable[[], Time] | None = None) -> None:
        self._node = node
        self._statuses = statuses
        self._hardware_id = hardware_id
        self._now = now or (lambda: node.get_clock().now().to_msg())
        self._publisher = node.create_publisher(DiagnosticArray, topic, 10)
        self._published: dict[str, tuple[Level, str]] = {}
        self._published_at_s = -PERIOD_S
        self._logged: dict[str, tuple[Level, str]] = {}
        self._logged_at_s: dict[str, float] = {}
        self._timer = node.create_timer(CHECK_S, self.check, clock=STEADY)

    def check(self) -> None:
        """Publish if a second has passed or a status has changed."""
        now_s = time.monotonic()
        statuses = [replace(status, name=full_name(self._node, status.name))
                    for status in self._statuses()]
        states = {status.name: (status.level, status.message) for status in statuses}
        if states != self._published or now_s - self._published_at_s >= PERIOD_S:
            self._published, self._published_at_s = states, now_s
            message = DiagnosticArray(
                status=[to_diagnostic(status, self._hardware_id()) for status in statuses])
            message.header.stamp = self._now()
            self._publisher.publish(message)
        for status in statuses:
            self._log(status, now_s)

    def _log(self, status: Status, now_s: float) -> None:
        level, message = self._logged.get(status.name, (Level.OK, ''))
        changed = (status.level, status.message) != (level, message)
        due = now_s - self._logged_at_s.get(status.name, -LOG_S) >= LOG_S
        if not changed or not (due or status.level > level):
            return
        self._logged[status.name] = (status.level, status.message)
        self._logged_at_s[status.name] = now_s
        logger, line = self._node.get_logger(), f'{status.name}: {status.message}'
        if status.level is Level.OK:
            logger.info(line)
        elif status.level is Level.WARN:
            logger.warning(line)
        else:
            logger.error(line)
