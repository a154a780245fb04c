"""
The lifecycle node `hardware`: joint targets in, sensor frames out, servos and IMU on the bus.

It takes what the simulation takes and gives what it gives, so that the brain runs unchanged.
Nothing is driven until `~/arm` is called (or `auto_arm` is set), with a calibration that fits and
targets that are fresh.
"""

from __future__ import annotations

import signal
import sys
import time
from collections import deque
from pathlib import Path

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.qos import QoSProfile
from sensor_msgs.msg import BatteryState, Imu, JointState, MagneticField
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory

from w2b_hw import calibration, messages
from w2b_hw.guard import Guard
from w2b_hw.imu import registry
from w2b_hw.imu.orientation import HEADING_VARIANCE, NO_HEADING_VARIANCE
from w2b_hw.imu.part import ImuError, Part
from w2b_hw.io_thread import IoThread
from w2b_hw.power import Power
from w2b_hw.robot import Report, Robot
from w2b_hw.safety import State
from w2b_hw.servo_bank import ChipStateError
from w2b_hw.targets import TargetGate, TargetRefusedError
from w2b_hw.transport import DEFAULT_DEVICE, EMULATED, FrameBudget, open_transport
from w2b_hw.watchdog import Systemd

RATE_HZ = 20.0
_QUEUE = QoSProfile(depth=10)
_DIAGNOSTICS_EVERY_S = 1.0
_EXECUTOR_SILENT_AFTER_S = 1.0
_CHECK_EVERY_S = 0.1
_DEFAULT_CALIBRATION = '~/.config/w2b/calibration.yaml'


class HardwareNode(LifecycleNode):
    """Configure: bus, chips, calibration. Activate: frames. The safety machine does the rest."""

    def __init__(self) -> None:
        super().__init__('hardware')
        self.declare_parameter('transport', DEFAULT_DEVICE)
        self.declare_parameter('calibration', _DEFAULT_CALIBRATION)
        self.declare_parameter('imu', registry.AUTO)
        self.declare_parameter('use_magnetometer', False)
        self.declare_parameter('imu_frame_id', 'imu_link')
        self.declare_parameter('autostart', True)
        self.declare_parameter('auto_arm', False)
        self._systemd = Systemd()
        self._bus: FrameBudget | None = None
        self._guard: Guard | None = None
        self._robot: Robot | None = None
        self._io: IoThread | None = None
        self._part: Part | None = None
        self._gate = TargetGate()
        self._refusal = ''
        self._auto_arm = False
        self._reports: deque[tuple[int, Report]] = deque(maxlen=4)
        self._poses: deque[tuple[int, Report]] = deque(maxlen=16)
        self._last: Report | None = None
        self._diagnosed_at_s = float('-inf')
        self._executor_at_s = 0.0
        self._joint_states = self.create_publisher(JointState, 'joint_states', _QUEUE)
        self._pulses = self.create_publisher(JointState, 'pulses', _QUEUE)
        self._imu_raw = self.create_publisher(Imu, 'imu/data_raw', _QUEUE)
        self._imu_data = self.create_publisher(Imu, 'imu/data', _QUEUE)
        self._imu_mag = self.create_publisher(MagneticField, 'imu/mag', _QUEUE)
        self._battery = self.create_publisher(BatteryState, 'battery', _QUEUE)
        self._diagnostics = self.create_publisher(DiagnosticArray, '/diagnostics', _QUEUE)
        self.create_subscription(JointTrajectory, 'joint_trajectory', self._on_target, _QUEUE)
        self.create_service(Trigger, '~/arm', self._on_arm)
        self.create_service(Trigger, '~/disarm', self._on_disarm)
        self.create_service(Trigger, '~/emergency_stop', self._on_emergency_stop)
        self._news = self.create_guard_condition(self._on_news)
        self.create_timer(_CHECK_EVERY_S, self._on_check)

    # -- lifecycle

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Open the bus, turn everything off, set the chips up."""
        name = str(self.get_parameter('transport').value)
        try:
            self._configure(name)
        except (OSError, ValueError, ImuError, ChipStateError, RuntimeError) as error:
            self.get_logger().error(f'cannot configure on {name}: {error}')
            self._release()
            return TransitionCallbackReturn.FAILURE
        return TransitionCallbackReturn.SUCCESS

    def _configure(self, name: str) -> None:
        found = self._calibration(name)
        self._bus = FrameBudget(open_transport(name))
        self._part = registry.find(self._bus, str(self.get_parameter('imu').value))
        self._robot = Robot(self._bus, found, self._part, Power(), rate_hz=RATE_HZ,
                            use_magnetometer=bool(self.get_parameter('use_magnetometer').value))
        self._robot.connect()
        if name != EMULATED:
            # Chips that outlive this process need somebody who does, too.
            self._guard = Guard(name, found.board.address)

    def _calibration(self, transport: str) -> calibration.Calibration:
        path = str(self.get_parameter('calibration').value)
        if transport.partition(':')[0] == EMULATED and path == _DEFAULT_CALIBRATION:
            return calibration.nominal()
        return calibration.load(Path(path).expanduser())

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Begin the frames."""
        assert self._robot is not None
        self._gate = TargetGate()
        self._auto_arm = bool(self.get_parameter('auto_arm').value)
        self._io = IoThread(self._robot, period_s=1.0 / RATE_HZ, on_frame=self._on_frame,
                            on_pose=self._on_pose, sign_of_life=self._sign_of_life)
        self._io.start()
        self._systemd.ready()
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Turn everything off and end the frames."""
        self._stop()
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Release the bus."""
        self._release()
        return TransitionCallbackReturn.SUCCESS

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Turn everything off, whatever the state."""
        self._release()
        return TransitionCallbackReturn.SUCCESS

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Turn everything off after an error in a transition."""
        self._release()
        return TransitionCallbackReturn.SUCCESS

    def _stop(self) -> None:
        if self._io is not None:
            self._io.stop()
            self._io = None

    def _release(self) -> None:
        self._stop()
        if self._bus is not None:
            self._bus.close()
            self._bus = None
        if self._guard is not None:
            self._guard.close()
            self._guard = None
        self._robot = None

    def close(self) -> None:
        """Turn everything off and release all; for the end of the process."""
        self._systemd.stopping()
        self._release()

    # -- called in the I/O thread

    def _on_frame(self, report: Report) -> None:
        self._reports.append((self.get_clock().now().nanoseconds, report))
        self._news.trigger()

    def _on_pose(self, report: Report) -> None:
        self._poses.append((self.get_clock().now().nanoseconds, report))
        self._news.trigger()

    def _sign_of_life(self, driven: bool) -> None:
        if time.monotonic() - self._executor_at_s < _EXECUTOR_SILENT_AFTER_S:
            self._systemd.alive()
        if self._guard is None:
            return
        self._guard.sign_of_life(driven)
        if driven and not self._guard.alive() and self._robot is not None:
            self._robot.emergency_stop('the guard process ended: start this node again')

    # -- called in the executor

    def _on_news(self) -> None:
        while self._poses:
            stamp_ns, report = self._poses.popleft()
            self._pulses.publish(messages.pulses(report, messages.time_message(stamp_ns)))
            self._note(report)
        while self._reports:
            stamp_ns, report = self._reports.popleft()
            self._publish(report, stamp_ns)
            self._note(report)

    def _publish(self, report: Report, stamp_ns: int) -> None:
        stamp = messages.time_message(stamp_ns)
        # First: the brain answers this one.
        self._joint_states.publish(messages.joint_states(report, stamp))
        self._pulses.publish(messages.pulses(report, stamp))
        if self._part is None or report.sample is None or report.orientation is None:
            return
        frame_id, part = str(self.get_parameter('imu_frame_id').value), type(self._part)
        raw = messages.imu_raw(report.sample, part, frame_id, stamp)
        self._imu_raw.publish(raw)
        heading = HEADING_VARIANCE if self.get_parameter('use_magnetometer').value \
            else NO_HEADING_VARIANCE
        self._imu_data.publish(messages.imu_data(raw, report.orientation, heading))
        if report.sample.field_t is not None:
            self._imu_mag.publish(
                messages.magnetic_field(report.sample.field_t, part, frame_id, stamp))

    def _note(self, report: Report) -> None:
        """Publish diagnostics once a second, and at once when the state changes."""
        changed = self._last is None or report.state is not self._last.state
        now_s = time.monotonic()
        if changed:
            sentence = f'{report.state.value}: {report.reason}'
            # Two calls on two lines: rclpy ties a line of code to one severity.
            if report.state is State.FAULT:
                self.get_logger().error(sentence)
            else:
                self.get_logger().info(sentence)
        self._last = report
        if not changed and now_s - self._diagnosed_at_s < _DIAGNOSTICS_EVERY_S:
            return
        self._diagnosed_at_s = now_s
        stamp = messages.time_message(self.get_clock().now().nanoseconds)
        lateness = sorted(self._io.lateness_s.copy()) if self._io is not None else []
        parts = messages.statuses(
            report, imu='no IMU' if self._part is None else self._part.name,
            targets={'accepted': str(self._gate.accepted), 'refused': str(self._gate.refused)},
            refusal=self._refusal,
            frames={'late_ms_median': f'{1e3 * lateness[len(lateness) // 2]:.2f}',
                    'late_ms_p99': f'{1e3 * lateness[int(0.99 * (len(lateness) - 1))]:.2f}'}
            if lateness else {})
        self._refusal = ''
        self._diagnostics.publish(messages.diagnostics(
            parts, str(self.get_parameter('transport').value), stamp))
        self._battery.publish(messages.battery(report, stamp))

    def _on_target(self, message: JointTrajectory) -> None:
        if self._io is None:
            return
        stamp = message.header.stamp
        try:
            pose = self._gate.check(
                message.joint_names, [point.positions for point in message.points],
                stamp.sec * 1_000_000_000 + stamp.nanosec, self.get_clock().now().nanoseconds)
        except TargetRefusedError as error:
            self._refusal = str(error)
            self.get_logger().warning(self._refusal, throttle_duration_sec=1.0)
            return
        self._io.target(pose)
        if self._auto_arm:
            # Once: after a fault or a stop, a person arms.
            self._auto_arm = False
            refusal = self._arm()
            if refusal is not None:
                self.get_logger().error(f'not armed: {refusal}')

    def _arm(self) -> str | None:
        if self._io is None or self._robot is None:
            return 'the node is not active'
        if self._guard is not None and not self._guard.alive():
            return 'the guard process ended: start this node again'
        return self._io.ask(self._robot.arm)

    def _on_arm(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        refusal = self._arm()
        response.success = refusal is None
        response.message = refusal or 'arming: the servos are energised one by one'
        return response

    def _on_disarm(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        io, robot = self._io, self._robot
        if io is None or robot is None:
            refusal: str | None = 'the node is not active; the servos are off'
        else:
            def disarm(now_s: float) -> None:
                robot.safety.park('asked to disarm', now_s)
            refusal = io.ask(disarm)
        response.success = refusal is None
        response.message = refusal or 'parking, then the servos are turned off'
        return response

    def _on_emergency_stop(self, request: Trigger.Request, response: Trigger.Response
                           ) -> Trigger.Response:
        io, robot = self._io, self._robot
        response.success = True
        response.message = 'off; call ~/arm to start again'
        if io is not None and robot is not None:
            def stop(now_s: float) -> None:
                robot.emergency_stop('emergency stop')
            if io.ask(stop) is not None:
                # The thread hangs: the guard turns the servos off when its pipe closes.
                if self._guard is not None:
                    self._guard.close()
                response.success = self._guard is not None
                response.message = 'the I/O thread hangs; the guard was told to turn all off'
        return response

    def _on_check(self) -> None:
        self._executor_at_s = time.monotonic()
        if self._io is not None and not self._io.alive():
            raise RuntimeError(f'the I/O thread ended: {self._io.error!r}')


def main() -> None:
    """Run the node until it is told to stop; the servos are off when it ends."""
    rclpy.init()
    node = HardwareNode()
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    code = 0
    try:
        if node.get_parameter('autostart').value:
            started = (node.trigger_configure() == TransitionCallbackReturn.SUCCESS
                       and node.trigger_activate() == TransitionCallbackReturn.SUCCESS)
            if not started:
                # The reason was logged.
                code = 1
        if code == 0:
            executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except Exception as error:
        print(f'hardware: {error}', file=sys.stderr)
        code = 1
    finally:
        # Ctrl-C reaches a launched node twice; the second must not skip the safe stop.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        node.close()
        node.destroy_node()
        rclpy.try_shutdown()
    sys.exit(code)


if __name__ == '__main__':
    main()
