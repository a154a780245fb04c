"""Publishes what a body says of itself on `body_status`: at every change, and every 0.2 s."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.node import Node

from w2b_core.body_status import TOPIC, BodyStatus
from w2b_ros.ros_messages import LATCHED, STEADY, to_diagnostic

#: Between two messages without a change; the stamp of the last accepted target is that old at most.
PERIOD_S = 0.2
#: How often changes are looked for that no call of `check` told of.
CHECK_S = 0.05


class BodyReporter:
    """
    Publishes a body's status, latched.

    Parameters
    ----------
    node
        The node that is the body.
    status
        Returns the status of now, without the age of its epoch.

    """

    def __init__(self, node: Node, status: Callable[[], BodyStatus]) -> None:
        self._node = node
        self._status = status
        self._publisher = node.create_publisher(DiagnosticStatus, TOPIC, LATCHED)
        self._published: BodyStatus | None = None
        self._published_at_s = 0.0
        self._epoch_began_at_s = time.monotonic()
        self._timer = node.create_timer(CHECK_S, self.check, clock=STEADY)

    def check(self) -> None:
        """Publish at once if something changed but stamp and age, else if it is time."""
        now_s, status = time.monotonic(), self._status()
        if self._published is None or status.epoch != self._published.epoch:
            # Seen a little late, never early: a word said before passes for none said since.
            self._epoch_began_at_s = now_s
        status = replace(status, epoch_age_s=now_s - self._epoch_began_at_s)
        told = replace(status, accepted_stamp_ns=None, epoch_age_s=0.0)
        if told == self._published and now_s - self._published_at_s < PERIOD_S:
            return
        self._published, self._published_at_s = told, now_s
        self._publisher.publish(
            to_diagnostic(status.to_status(
                self._node.get_fully_qualified_name().lstrip('/')), status.body))
