"""The parts of the bench that need processes and DDS: latency, memory and CPU."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from w2b_core.controller import file as controller_file
from w2b_hw.emulation.client import SocketTransport
from w2b_hw.joints import JOINTS

_DEADLINE_S = 20.0
#: The target comes this long after its frame, so that it alone moves the pulses: the slew limit
#: lets a pose that comes 2 ms after the last one move by hardly more than a tick.
_ANSWER_AFTER_S = 0.02
_STEP_RAD = 0.05
#: What a brain has heard before its memory is measured: a word that it never heard, one that is
#: in no vocabulary, a sentence, and what no command is; then it walks.
_SAID = ('halt', 'forwrad', 'please do not go back', 'banana', 'forward')
_BRAIN = 'from w2b_controller.brain import main; raise SystemExit(main())'


class _Client:
    """A ROS node of the bench's own, a hardware node, and the chips that it drives."""

    def __init__(self, folder: str) -> None:
        socket = f'{folder}/chips'
        self._processes: list[subprocess.Popen[bytes]] = []
        server = self.start('-m', 'w2b_hw.emulation.server', socket)
        assert server.stdout is not None
        server.stdout.readline()
        self.chips = SocketTransport(socket)
        self.hardware = self.start('-m', 'w2b_hw.node', '--ros-args',
                                   '-p', f'transport:=emulated:{socket}')
        rclpy.init()
        self.node = Node('bench')
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self.node)

    def start(self, *arguments: str) -> subprocess.Popen[bytes]:
        """Start a Python process."""
        process = subprocess.Popen([sys.executable, *arguments], stdout=subprocess.PIPE,
                                   stderr=subprocess.DEVNULL)
        self._processes.append(process)
        return process

    def spin_until(self, condition: Callable[[], Any], what: str,
                   deadline_s: float = _DEADLINE_S) -> None:
        """Spin until the condition holds (RuntimeError if it never does)."""
        ends_s = time.monotonic() + deadline_s
        while not condition():
            if time.monotonic() > ends_s:
                raise RuntimeError(f'bench: no {what} within {deadline_s:.0f} s')
            self._executor.spin_once(timeout_sec=0.001)

    def spin(self, seconds: float) -> None:
        """Spin for a while."""
        ends_s = time.monotonic() + seconds
        self.spin_until(lambda: time.monotonic() >= ends_s, 'end', seconds + 1)

    def arm(self) -> None:
        """Arm, and wait until all servos are driven."""
        client = self.node.create_client(Trigger, 'hardware/arm')
        self.spin_until(client.service_is_ready, 'hardware node')
        armed = False
        while not armed:
            future = client.call_async(Trigger.Request())
            self.spin_until(future.done, 'answer to arm')
            armed = bool(future.result().success)
        self.spin_until(lambda: all(self.chips.outputs()[-1].pulses_us[:len(JOINTS)]), 'pulses')

    def close(self) -> None:
        """End everything, the chips last."""
        for process in reversed(self._processes):
            process.terminate()
            process.wait()
            assert process.stdout is not None
            process.stdout.close()
        self.chips.close()
        self.node.destroy_node()
        rclpy.shutdown()


@contextmanager
def _client(folder: str) -> Iterator[_Client]:
    client = _Client(folder)
    try:
        yield client
    finally:
        client.close()


def latency(folder: str, seconds: float) -> list[float]:
    """
    Return the times from publishing a target to the change of the emulated chip's pulses.

    Raises
    ------
    RuntimeError
        If the robot stopped: a machine so busy that frames are 250 ms late gives no figures.

    """
    with _client(folder) as client:
        publisher = client.node.create_publisher(JointTrajectory, 'joint_trajectory', 10)
        due: list[tuple[float, JointState]] = []
        published_s: list[float] = []
        client.node.create_subscription(
            JointState, 'joint_states',
            lambda frame: due.append((time.monotonic() + _ANSWER_AFTER_S, frame)), 10)

        def answer() -> None:
            while due and due[0][0] <= time.monotonic():
                _, frame = due.pop(0)
                angle = _STEP_RAD * (1 if len(published_s) % 2 else -1)
                message = JointTrajectory(joint_names=list(JOINTS), points=[
                    JointTrajectoryPoint(positions=[angle] * len(JOINTS))])
                message.header.stamp = frame.header.stamp
                published_s.append(time.monotonic())
                publisher.publish(message)

        client.node.create_timer(0.001, answer)
        client.arm()
        client.spin(1.0)
        first = len(published_s)
        client.spin(seconds)
        outputs = client.chips.outputs()
        if not any(outputs[-1].pulses_us):
            raise RuntimeError('bench: the robot stopped by itself: this machine is too busy now')
        changes_s = [output.since_s for output in outputs]
        return [next(at_s for at_s in changes_s if at_s > sent_s) - sent_s
                for sent_s in published_s[first:-2]]


def footprint(folder: str, seconds: float, controller: str) -> dict[str, Any]:
    """Return memory and CPU of brain, hardware node and guard while the robot walks."""
    try:
        controller_file.resolve(controller)
    except (ValueError, OSError) as error:
        return {'skipped': str(error)}
    with _client(folder) as client:
        brain = client.start('-c', _BRAIN, '--ros-args', '-p', f'controller:={controller}')
        client.arm()
        command = client.node.create_publisher(String, 'command', 10)
        client.spin_until(command.get_subscription_count, 'brain')
        for text in _SAID:
            command.publish(String(data=text))
            client.spin(0.3)
        client.spin(2.0)
        processes = {'brain': brain.pid, 'hardware': client.hardware.pid,
                     'guard': _child(client.hardware.pid)}
        before = {name: _cpu_s(pid) for name, pid in processes.items()}
        started_s = time.monotonic()
        # Not spun: this process' own share of the machine stays out of the picture.
        time.sleep(seconds)
        elapsed_s = time.monotonic() - started_s
        rss_mb = {name: _rss_mb(pid) for name, pid in processes.items()}
        cpu = {name: 100 * (_cpu_s(pid) - before[name]) / elapsed_s
               for name, pid in processes.items()}
    return {**{f'{name}_rss_mb': round(value, 1) for name, value in rss_mb.items()},
            'rss_mb': round(sum(rss_mb.values()), 1),
            **{f'{name}_cpu_percent': round(value, 1) for name, value in cpu.items()},
            'cpu_percent': round(sum(cpu.values()), 1)}


def _child(pid: int) -> int:
    return int(Path(f'/proc/{pid}/task/{pid}/children').read_text().split()[0])


def _rss_mb(pid: int) -> float:
    lines = Path(f'/proc/{pid}/status').read_text().splitlines()
    return next(int(line.split()[1]) / 1024 for line in lines if line.startswith('VmRSS'))


def _cpu_s(pid: int) -> float:
    fields = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')
