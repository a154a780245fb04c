"""What the packages' own tests (`colcon test`) share: a node as a process, and one that listens."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import rclpy
from rclpy.node import Node

#: A loaded machine takes long to start a process.
DEADLINE_S = 120.0


def own_domain() -> dict[str, str]:
    """Return what a process's environment needs for a ROS domain of its own on this machine."""
    return {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
            'ROS_DOMAIN_ID': str(1 + os.getpid() % 101)}


@contextmanager
def listener() -> Iterator[Node]:
    """Yield a node in a domain of its own, in which processes that are started meanwhile are."""
    before = dict(os.environ)
    os.environ.update(own_domain())
    rclpy.init()
    node = rclpy.create_node('test_client')
    try:
        yield node
    finally:
        node.destroy_node()
        rclpy.shutdown()
        os.environ.clear()
        os.environ.update(before)


def run_until(condition: Callable[[], bool], node: Node, module: str, *parameters: str) -> None:
    """
    Run a node's process, and spin the listening one, until a condition holds; then end the process.

    Parameters
    ----------
    condition
        What is waited for, for `DEADLINE_S` at most.
    node
        The node that listens.
    module
        Its `main` is run.
    parameters
        Of the process, such as `body:=quadruped`.

    Raises
    ------
    RuntimeError
        If the condition does not come to hold, or if the process does not end with 0.

    """
    process = subprocess.Popen([
        sys.executable, '-c', f'from {module} import main; raise SystemExit(main())', '--ros-args',
        *(word for parameter in parameters for word in ('-p', parameter))])
    try:
        end_s = time.monotonic() + DEADLINE_S
        while not condition():
            if time.monotonic() > end_s:
                raise RuntimeError(f'{module}: what is waited for did not come within '
                                   f'{DEADLINE_S:g} s')
            rclpy.spin_once(node, timeout_sec=0.1)
    finally:
        process.terminate()
        code = process.wait(DEADLINE_S)
    if code:
        raise RuntimeError(f'{module}: expected an end with 0 after SIGTERM, got {code}')
