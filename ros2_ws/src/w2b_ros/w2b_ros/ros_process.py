"""
A process that runs one node and always ends in order.

Signals set a flag, nothing else: no exception strikes in the middle of a callback, a second Ctrl-C
is the same as the first, and what a node does at its end (a robot relaxes) is never skipped. This
module imports ROS only when it runs, so that the flag is there while slow imports go on.
"""

from __future__ import annotations

import faulthandler
import os
import signal
import sys
import tempfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from types import FrameType
from typing import TYPE_CHECKING, NoReturn, Protocol

if TYPE_CHECKING:
    from rclpy.executors import Executor
    from rclpy.node import Node

SIGNALS = (signal.SIGINT, signal.SIGTERM)
#: How often the flag is looked at: a signal does not wake the executor.
POLL_S = 0.1
#: Leaving the middleware takes a tenth of that; after it the process ends with the stack printed.
LONGEST_END_S = 5.0
#: The exit code of a command line that is refused, as argparse has it.
USAGE_ERROR = 2


class StartError(ValueError):
    """A node cannot start; one line says why and what to do."""


class RunnableNode(Protocol):
    """What `run` needs of a node besides being one."""

    #: None while the node wants to run, then the exit code of the process.
    exit_code: int | None

    def close(self) -> None:
        """Release what the node holds while ROS is still up."""


def own(arguments: Sequence[str]) -> list[str]:
    """Return a command line's arguments that are not ROS's, without the program's name."""
    left, of_ros = [], False
    for argument in arguments[1:]:
        if of_ros:
            of_ros = argument != '--'
        elif argument == '--ros-args':
            of_ros = True
        else:
            left.append(argument)
    return left


class StopFlag:
    """Set by SIGINT and SIGTERM."""

    def __init__(self) -> None:
        self.requested = False

    def install(self) -> None:
        """Take over the signals, in the main thread."""
        for number in SIGNALS:
            signal.signal(number, self._on_signal)

    def _on_signal(self, _number: int, _frame: FrameType | None) -> None:
        self.requested = True


def provide_log_folder() -> None:
    """
    Give ROS a folder for its logs where its own cannot be written: without one it does not start.

    That is ROS_LOG_DIR, else ROS_HOME/log, else ~/.ros/log.
    """
    home = os.environ.get('ROS_HOME') or os.path.join(os.path.expanduser('~'), '.ros')
    folder = os.environ.get('ROS_LOG_DIR') or os.path.join(home, 'log')
    with suppress(OSError, ValueError):
        os.makedirs(folder, exist_ok=True)
        # ROS itself finds no home where HOME is not set.
        if os.access(folder, os.W_OK | os.X_OK) and (
                os.environ.get('HOME') or os.environ.get('ROS_HOME')
                or os.environ.get('ROS_LOG_DIR')):
            return
    with suppress(OSError):
        os.environ['ROS_LOG_DIR'] = tempfile.mkdtemp(prefix='w2b-log-')
        print(f'warning: {folder}: expected a folder that can be written, for logs; they are in '
              f'{os.environ["ROS_LOG_DIR"]} (ROS_LOG_DIR chooses another)', file=sys.stderr)


def start_ros() -> bool:
    """Start ROS without its signal handlers; False, having said why in one line, if it cannot."""
    import rclpy
    from rclpy.exceptions import NameValidationException
    from rclpy.impl.implementation_singleton import rclpy_implementation
    from rclpy.signals import SignalHandlerOptions
    provide_log_folder()
    try:
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    except rclpy_implementation.UnknownROSArgsError as error:
        print(f'error: {_unknown(error)}', file=sys.stderr)
        return False
    except (rclpy_implementation.RCLError, NameValidationException) as error:
        print(f'error: {" ".join(str(error).split())}', file=sys.stderr)
        return False
    return True


def run(make_node: Callable[[], Node], args: Sequence[str] | None = None) -> NoReturn:
    """
    Run the node that `make_node` builds until a signal or its own end; then end the process.

    The node is an `rclpy.node.Node` with what `RunnableNode` asks for. The exit code is 0 after a
    signal, the node's own if it wants to end, 1 if it cannot start, and 2 for arguments after
    --ros-args that ROS does not know.
    """
    stop = StopFlag()
    stop.install()
    import rclpy
    from rclpy.exceptions import NameValidationException, ParameterException
    from rclpy.impl.implementation_singleton import rclpy_implementation
    from rclpy.signals import SignalHandlerOptions
    code = 1
    provide_log_folder()
    try:
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
        code = _spin(make_node, stop)
    except rclpy_implementation.UnknownROSArgsError as error:
        print(f'error: {_unknown(error)}', file=sys.stderr)
        code = USAGE_ERROR
    except (StartError, ParameterException, NameValidationException,
            rclpy_implementation.RCLError) as error:
        print(f'error: {" ".join(str(error).split())}', file=sys.stderr)
    _end_soon()
    rclpy.try_shutdown()
    leave(code)


def _unknown(error: Exception) -> str:
    return f'--ros-args: expected -p NAME:=VALUE and the like, got {error}'


def _spin(make_node: Callable[[], Node], stop: StopFlag) -> int:
    node = make_node()
    try:
        executor = _executor()
        executor.add_node(node)
        while not stop.requested and node.exit_code is None:
            executor.spin_once(timeout_sec=POLL_S)
        return node.exit_code or 0
    finally:
        try:
            node.close()
        finally:
            _end_soon()
            node.destroy_node()


def _executor() -> Executor:
    """Return the executor that costs least: one that is told of events, where this ROS has it."""
    try:
        from rclpy.experimental import EventsExecutor
    except ImportError:
        # Before rclpy 7.1.5. It looks at each entity of the node whenever one wakes it.
        from rclpy.executors import SingleThreadedExecutor
        return SingleThreadedExecutor()
    return EventsExecutor()


def _end_soon() -> None:
    """Bound the time to leave the middleware: nothing else depends on this process any more."""
    faulthandler.dump_traceback_later(LONGEST_END_S, exit=True)


def leave(code: int) -> NoReturn:
    """
    End the process now, without the destructors of Python and of the middleware.

    Those take their time, in rare cases for ever, and a signal that comes meanwhile kills.
    """
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError, AttributeError):  # closed, or nobody reads it
            stream.flush()
    os._exit(code)
