"""
A process that runs one node and always ends in order.

Signals set a flag, nothing else: no exception strikes in the middle of a callback, a second Ctrl-C
is the same as the first, and what a node does at its end (a robot relaxes) is never skipped. This
module imports ROS only when it runs, so that the flag is there while slow imports go on.
"""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Sequence
from types import FrameType
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from rclpy.node import Node

SIGNALS = (signal.SIGINT, signal.SIGTERM)
#: How often the flag is looked at: a signal does not wake the executor.
POLL_S = 0.1


class StartError(ValueError):
    """A node cannot start; one line says why and what to do."""


class RunnableNode(Protocol):
    """What `run` needs of a node besides being one."""

    #: None while the node wants to run, then the exit code of the process.
    exit_code: int | None

    def close(self) -> None:
        """Do the last things while ROS is still up."""


class StopFlag:
    """Set by SIGINT and SIGTERM."""

    def __init__(self) -> None:
        self.requested = False

    def install(self) -> None:
        """Take over the signals, in the main thread."""
        for number in SIGNALS:
            signal.signal(number, self._on_signal)

    @staticmethod
    def retire() -> None:
        """Ignore the signals from now on: at its end Python would give them their old meaning."""
        # One that came in the very moment of the change would make Python complain.
        signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
        for number in SIGNALS:
            signal.signal(number, signal.SIG_IGN)

    def _on_signal(self, _number: int, _frame: FrameType | None) -> None:
        self.requested = True


def run(make_node: Callable[[], Node], args: Sequence[str] | None = None) -> int:
    """
    Run the node that `make_node` builds until a signal or its own end; return the exit code.

    The node is an `rclpy.node.Node` with what `RunnableNode` asks for.
    """
    stop = StopFlag()
    stop.install()
    import rclpy
    from rclpy.executors import SingleThreadedExecutor
    from rclpy.impl.implementation_singleton import rclpy_implementation
    from rclpy.signals import SignalHandlerOptions
    try:
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    except rclpy_implementation.RCLError as error:
        print(f'error: {_one_line(error)}', file=sys.stderr)
        return 1
    node = None
    try:
        node = make_node()
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        while not stop.requested and node.exit_code is None:
            executor.spin_once(timeout_sec=POLL_S)
        return node.exit_code or 0
    except (StartError, rclpy.exceptions.ParameterException,
            rclpy.exceptions.NameValidationException) as error:
        print(f'error: {_one_line(error)}', file=sys.stderr)
        return 1
    finally:
        if node is not None:
            try:
                node.close()
            finally:
                node.destroy_node()
        rclpy.try_shutdown()
        stop.retire()


def _one_line(error: Exception) -> str:
    return ' '.join(str(error).split())
