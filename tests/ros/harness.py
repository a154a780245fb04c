"""Real processes in a ROS domain of their own, and a client that watches and disturbs them."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from nav_msgs.msg import Odometry
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import String
from std_srvs.srv import SetBool, Trigger
from trajectory_msgs.msg import JointTrajectory

from demo.ros_session import Domain
from w2b_controller.say import values_of
from w2b_ros.ros_messages import stamp_ns
from w2b_sim.sim_logic import first_stamp_ns

#: By then a thing has happened, or never will: on a machine with six times as much to do as it can,
#: a node alone takes 20 s to start. Tests that pass do not wait for it.
DEADLINE_S = 120.0
#: Executables that are not of w2b_controller.
PACKAGES = {'sim': 'w2b_sim', 'description': 'w2b_description', 'hardware': 'w2b_hw',
            'emulator': 'w2b_hw', 'relax': 'w2b_hw', 'preflight': 'w2b_hw', 'calibrate': 'w2b_hw',
            'page': 'w2b_web', 'play': 'w2b_web', 'listen': 'w2b_web'}
#: Executable -> a parameter and its value, where a test does not say otherwise.
PRIMED = {'sim': ('body', 'quadruped'), 'brain': ('controller', 'quadruped_serial')}
EVERYTHING = QoSProfile(depth=5000)
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Process:
    """An installed executable that runs; its output goes to a file."""

    def __init__(self, path: Path, arguments: list[str], environment: Mapping[str, str],
                 log: Path) -> None:
        self.name = path.name
        self._log = log
        with log.open('wb') as output:
            self._popen = subprocess.Popen(
                [str(path), *arguments], env=environment, stdin=subprocess.PIPE,
                stdout=output, stderr=subprocess.STDOUT)
        self.killed = False

    @property
    def log(self) -> str:
        return self._log.read_text(errors='replace')

    @property
    def exit_code(self) -> int | None:
        return self._popen.poll()

    @property
    def pid(self) -> int:
        return self._popen.pid

    def send(self, number: signal.Signals) -> None:
        self._popen.send_signal(number)

    def type(self, text: str) -> None:
        """Type into its standard input, all there will be."""
        assert self._popen.stdin is not None
        self._popen.stdin.write(text.encode())
        self._popen.stdin.close()

    def kill(self) -> None:
        """End it as the kernel does when memory runs out: nothing is said to anybody."""
        self.killed = True
        self._popen.kill()
        self._popen.wait()

    def wait(self, deadline_s: float = DEADLINE_S) -> int:
        return self._popen.wait(deadline_s)

    def stop(self) -> int:
        """End it with Ctrl-C; return the exit code."""
        if self.exit_code is None:
            self.send(signal.SIGINT)
        return self.wait()


class System:
    """A ROS domain with the processes of one test, and what its client saw of them."""

    def __init__(self, environment: Mapping[str, str], folder: Path) -> None:
        self._domain = Domain()
        self._environment = {**environment, 'ROS_DOMAIN_ID': str(self._domain.number)}
        self._folder = folder
        self.processes: list[Process] = []
        self._context = Context()
        # The middleware of this process reads the same variables as the others.
        os.environ.update({name: self._environment[name] for name in (
            'ROS_AUTOMATIC_DISCOVERY_RANGE', 'FASTRTPS_DEFAULT_PROFILES_FILE')})
        rclpy.init(context=self._context, domain_id=int(self._environment['ROS_DOMAIN_ID']),
                   signal_handler_options=SignalHandlerOptions.NO)
        self.node = Node('test_client', context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._since_ns = 0
        self.positions_m: dict[int, list[float]] = {}
        self.targets_rad: dict[int, dict[str, float]] = {}
        self.answers: list[DiagnosticStatus] = []
        self.statuses: dict[str, DiagnosticStatus] = {}
        node = self.node
        self._commands = node.create_publisher(String, 'command', 10)
        self._odometry = node.create_subscription(
            Odometry, 'odom', self._on_odometry, EVERYTHING)
        self._trajectories = node.create_subscription(
            JointTrajectory, 'joint_trajectory', self._on_targets, EVERYTHING)
        node.create_subscription(DiagnosticStatus, 'command_answer', self.answers.append, LATCHED)
        node.create_subscription(DiagnosticArray, '/diagnostics', self._on_diagnostics, EVERYTHING)

    @property
    def environment(self) -> Mapping[str, str]:
        """The environment of this system's processes."""
        return self._environment

    @property
    def install(self) -> str:
        """The folder with the installed packages."""
        return self._environment['W2B_INSTALL']

    def forget_before(self, first_ns: int) -> None:
        """Forget the frames before a stamp, also those that are still under way."""
        self._since_ns = first_ns
        for seen in (self.positions_m, self.targets_rad):
            for stamp in [stamp for stamp in seen if stamp < first_ns]:
                del seen[stamp]

    def forget(self) -> None:
        """Forget what was seen so far, but the answers to commands."""
        self._since_ns = 0
        self.positions_m.clear()
        self.targets_rad.clear()
        self.statuses.clear()

    def _on_odometry(self, message: Odometry) -> None:
        point = message.pose.pose.position
        if stamp_ns(message.header.stamp) >= self._since_ns:
            self.positions_m[stamp_ns(message.header.stamp)] = [point.x, point.y, point.z]

    def _on_targets(self, message: JointTrajectory) -> None:
        if stamp_ns(message.header.stamp) >= self._since_ns:
            self.targets_rad[stamp_ns(message.header.stamp)] = dict(
                zip(message.joint_names, message.points[0].positions, strict=False)
                if message.points else ())

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            self.statuses[status.name] = status

    def set_environment(self, **variables: str) -> None:
        """Set variables of the processes that are started from now on."""
        self._environment = {**self._environment, **variables}

    def start(self, executable: str, *arguments: str, **parameters: object) -> Process:
        """Start an installed node with ROS parameters; None: the node's own default."""
        if executable == 'brain' and 'claim_wait' not in parameters:
            # Where only one brain is started, looking for another need not take long.
            parameters['claim_wait'] = 0.2
        if executable in PRIMED and not any('params-file' in word for word in arguments):
            # Most tests are of one body and a controller that walks whatever it hears first.
            parameters.setdefault(*PRIMED[executable])
        parameters = {name: value for name, value in parameters.items() if value is not None}
        package = PACKAGES.get(executable, 'w2b_controller')
        path = Path(self._environment['W2B_INSTALL']) / package / 'lib' / package / executable
        ros = [word for name, value in parameters.items() for word in ('-p', f'{name}:={value}')]
        process = Process(path, [*arguments, *(['--ros-args', *ros] if ros else [])],
                          self._environment, self._folder / f'{len(self.processes)}.log')
        self.processes.append(process)
        return process

    def wait(self, condition: Callable[[], Any], what: str, deadline_s: float = DEADLINE_S) -> Any:
        """Spin until the condition is true, and return it; fail with the logs if it never is."""
        end_s = time.monotonic() + deadline_s
        while not (result := condition()):
            if time.monotonic() > end_s:
                raise AssertionError(f'waited {deadline_s:g} s for {what}\n{self.logs()}')
            self._executor.spin_once(timeout_sec=0.05)
        return result

    def last_frame(self) -> int:
        """Return the stamp of a waiting sim's frame, when all frames up to it have arrived here."""
        def all_seen() -> bool:
            status = self.statuses.get('sim: clock')
            stamp_ns = round(float(values_of(status).get('stamp_s', '-1')) * 1e9)
            return bool(self.positions_m) and stamp_ns == max(self.positions_m)
        self.wait(all_seen, "the sim's last frame")
        return max(self.positions_m)

    def spin_for_frames(self, count: int) -> None:
        """Spin until so many more frames were seen."""
        before = len(self.positions_m)
        self.wait(lambda: len(self.positions_m) >= before + count, f'{count} more frames')

    def logs(self) -> str:
        return '\n'.join(f'--- {process.name} (exit code {process.exit_code})\n{process.log}'
                         for process in self.processes)

    def call(self, kind: Any, name: str, request: Any) -> Any:
        """Call a service."""
        client = self.node.create_client(kind, name)
        try:
            self.wait(client.service_is_ready, f'service {name}')
            future = client.call_async(request)
            self.wait(future.done, f'the answer of {name}')
            return future.result()
        finally:
            self.node.destroy_client(client)

    def pause(self, paused: bool) -> None:
        assert self.call(SetBool, 'sim/pause', SetBool.Request(data=paused)).success

    def reset(self) -> int:
        """Put the robot back to its start, forget its past, return its first frame's stamp."""
        self.wait(self._odometry.get_publisher_count, 'a sim whose frames come here')
        response = self.call(Trigger, 'sim/reset', Trigger.Request())
        assert response.success
        self._since_ns = first_stamp_ns(response.message)
        self.forget_before(self._since_ns)
        return self._since_ns

    def wait_for_no_sim(self) -> None:
        """Wait until this client knows that the sim is gone: else its services still look ready."""
        self.wait(lambda: not self._odometry.get_publisher_count()
                  and not self.node.count_services('sim/reset'), 'the end of the sim')

    def transition(self, label: str) -> bool:
        """Ask the brain for a transition; return whether it succeeded."""
        request = ChangeState.Request(transition=Transition(label=label))
        return bool(self.call(ChangeState, 'brain/change_state', request).success)

    def brain_state(self) -> str:
        return str(self.call(GetState, 'brain/get_state', GetState.Request()).current_state.label)

    def say(self, *words: str) -> Process:
        """Run `say`, with the tests' own patience; return the ended process."""
        patience = () if '--timeout' in words else ('--timeout', str(DEADLINE_S))
        process = self.start('say', *patience, *words)
        self.wait(lambda: process.exit_code is not None, f'the end of say {words}')
        return process

    def tell(self, text: str | bytes) -> tuple[int, str, dict[str, str]]:
        """Publish a command, raw bytes as they are, and return level, message, values."""
        self.wait(lambda: self.answers and self._commands.get_subscription_count(), 'a brain')
        count = int(values_of(self.answers[-1])['received'])
        self._commands.publish(text if isinstance(text, bytes) else String(data=text))
        self.wait(lambda: int(values_of(self.answers[-1])['received']) > count, 'an answer')
        return self.last_answer()

    def connected_listeners(self) -> int:
        """How many listeners what this client says reaches."""
        return int(self._commands.get_subscription_count())

    def wait_for_brain(self) -> None:
        """Wait until a brain listens to this client, and what it sends comes here."""
        self.wait(lambda: self.answers and self._commands.get_subscription_count()
                  and self._trajectories.get_publisher_count(), 'an active brain')

    def wait_for_no_brain(self) -> None:
        """Wait until this client has no ends of a brain's topics left, which would look alive."""
        self.wait(lambda: not self._commands.get_subscription_count()
                  and not self._trajectories.get_publisher_count(), 'the end of the brain')

    def wait_for_status(self, name: str, level: int, text: str = '') -> DiagnosticStatus:
        """Wait for a status of this level with this text in its message."""
        def matches() -> DiagnosticStatus | None:
            status = self.statuses.get(name)
            return status if (status is not None and status.level[0] == level
                              and text in status.message) else None
        try:
            status: DiagnosticStatus = self.wait(matches, f'{name} at level {level}: {text!r}')
        except AssertionError as error:
            raise AssertionError(f'{error}\nlast: {self.statuses.get(name)}') from None
        return status

    def last_answer(self) -> tuple[int, str, dict[str, str]]:
        """Level, message and values of the last answer to a command."""
        answer = self.answers[-1]
        return answer.level[0], answer.message, values_of(answer)

    def close(self) -> None:
        """End everything; fail if something did not end in order."""
        codes = []
        for process in self.processes:
            if process.exit_code is None:
                process.send(signal.SIGINT)
        for process in self.processes:
            try:
                codes.append(process.stop())
            except subprocess.TimeoutExpired:
                # With PYTHONFAULTHANDLER set its log then tells where it hangs.
                process.send(signal.SIGABRT)
                codes.append(process.wait())
        self._executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self._context)
        self._domain.release()
        for process, code in zip(self.processes, codes, strict=True):
            assert 'Traceback' not in process.log, self.logs()
            if not process.killed and process.name in ('brain', 'sim') and \
                    not getattr(process, 'may_fail', False):
                assert code == 0, f'{process.name} ended with {code}\n{self.logs()}'
