"""A short-lived ROS node of a command: it waits with a deadline and can be interrupted."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from w2b_controller.say import seconds
from w2b_ros.ros_process import StopFlag, own, start_ros

if TYPE_CHECKING:
    from rclpy.node import Node

DONE, REFUSED, UNANSWERED = 0, 1, 2


class UnansweredError(RuntimeError):
    """Nobody answered in time, or the user interrupted; one line says which."""


@dataclass
class Client:
    """The node, and the flag that a signal sets."""

    node: Node
    stop: StopFlag

    def wait(self, condition: Callable[[], bool], timeout_s: float, reason: str) -> None:
        """
        Spin until a condition holds.

        Raises
        ------
        UnansweredError
            With `reason`, after `timeout_s`; or if interrupted.

        """
        if not self.spin(condition, timeout_s):
            raise UnansweredError(reason)

    def spin(self, condition: Callable[[], bool], timeout_s: float) -> bool:
        """Spin until a condition holds or `timeout_s` has passed; return whether it holds."""
        import rclpy
        deadline_s = time.monotonic() + timeout_s
        while not condition():
            if self.stop.requested:
                raise UnansweredError('interrupted')
            if time.monotonic() > deadline_s:
                return False
            rclpy.spin_once(self.node, timeout_sec=0.05)
        return True

    def call(self, kind: type, name: str, request: object, timeout_s: float, absent: str) -> Any:
        """
        Call a service and return its response.

        Raises
        ------
        UnansweredError
            With `absent`, if there is no such service within `timeout_s`; or if it is silent.

        """
        service = self.node.create_client(kind, name)
        deadline_s = time.monotonic() + timeout_s
        self.wait(service.service_is_ready, timeout_s, absent)
        future = service.call_async(request)
        self.wait(future.done, max(1.0, deadline_s - time.monotonic()),
                  f'{service.srv_name} did not answer within {timeout_s:g} s')
        return future.result()


def parser(name: str, about: str, timeout_s: float = 5.0) -> argparse.ArgumentParser:
    """Return the parser of a command, with its `--timeout`."""
    made = argparse.ArgumentParser(
        prog=f'w2b {name}', description=about,
        epilog='ROS arguments go behind --ros-args, e.g. -r __ns:=/robot1.')
    made.add_argument('--timeout', type=seconds, default=timeout_s, metavar='S',
                      help='seconds to wait for an answer (default: %(default)s)')
    return made


def arguments() -> list[str]:
    """Return the command line's arguments that are not ROS's."""
    return own(sys.argv)


@contextmanager
def _client(name: str) -> Iterator[Client | None]:
    stop = StopFlag()
    stop.install()
    if not start_ros():
        yield None
        return
    import rclpy
    node = rclpy.create_node(f'w2b_{name}')
    try:
        yield Client(node, stop)
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


def run(name: str, command: Callable[[Client], int]) -> int:
    """Run a command with a client; return its exit code, 2 if nobody answered it."""
    with _client(name) as client:
        if client is None:
            return UNANSWERED
        try:
            return command(client)
        except UnansweredError as error:
            print(f'error: {error}', file=sys.stderr)
            return UNANSWERED
