"""The hardware node on emulated chips in a process of their own, and what their pins did."""

from __future__ import annotations

import os
import time
from itertools import pairwise
from pathlib import Path

import numpy as np
from rclpy.publisher import Publisher
from sensor_msgs.msg import BatteryState, Imu, JointState, MagneticField
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from tests.ros.harness import EVERYTHING, System
from w2b_hw.emulation.client import SocketTransport
from w2b_hw.joints import JOINTS
from w2b_ros.ros_messages import FRAMES_IN, stamp_ns

#: What a servo shows that does not move: the pulse stays within two ticks of 4.88 us.
STILL_US = 10.0


class HardwareSystem:
    """A hardware node, its chips, and a brain that the test plays (or does not)."""

    def __init__(self, system: System, folder: Path, **parameters: object) -> None:
        self.system = system
        self.socket = str(folder / 'chips')
        self.chips_process = system.start('emulator', self.socket)
        system.wait(lambda: os.path.exists(self.socket), 'the emulated chips')
        self.chips = SocketTransport(self.socket)
        self.hardware = system.start('hardware', transport=f'emulated:{self.socket}',
                                     **parameters)
        self.answering = False
        #: Said again when a busy machine disarmed the robot: a word of before moves nothing.
        self.word = ''
        self.frames: list[JointState] = []
        self.imu_raw: list[Imu] = []
        self.imu: list[Imu] = []
        self.mag: list[MagneticField] = []
        self.battery: list[BatteryState] = []
        self.pulses: list[JointState] = []
        node = system.node
        self._targets: Publisher | None = None
        for kind, topic, take in (
                (JointState, 'joint_states', self._on_frame), (JointState, 'pulses',
                                                               self.pulses.append),
                (Imu, 'imu/data_raw', self.imu_raw.append), (Imu, 'imu/data', self.imu.append),
                (MagneticField, 'imu/mag', self.mag.append),
                (BatteryState, 'battery', self.battery.append)):
            node.create_subscription(kind, topic, take,
                                     FRAMES_IN if kind is not JointState else EVERYTHING)

    def _on_frame(self, frame: JointState) -> None:
        self.frames.append(frame)
        if self.answering:
            self.answer(frame)

    def answer(self, frame: JointState, positions: list[float] | None = None) -> None:
        """Answer a frame: all joints swing by 0.4 rad at 0.5 Hz."""
        if positions is None:
            phase = 2 * np.pi * 0.5 * (frame.header.stamp.sec % 1000
                                       + frame.header.stamp.nanosec * 1e-9)
            positions = [0.4 * float(np.sin(phase + n)) for n in range(12)]
        message = JointTrajectory(joint_names=list(JOINTS),
                                  points=[JointTrajectoryPoint(positions=positions)])
        message.header.stamp = frame.header.stamp
        self.targets.publish(message)

    @property
    def targets(self) -> Publisher:
        """The test's own targets; made on demand, for a brain refuses to be the second."""
        if self._targets is None:
            self._targets = self.system.node.create_publisher(
                JointTrajectory, 'joint_trajectory', 10)
        return self._targets

    def trigger(self, service: str) -> Trigger.Response:
        return self.system.call(Trigger, f'hardware/{service}', Trigger.Request())

    def wait_for_frames(self) -> None:
        """Wait until frames come."""
        self.system.wait(lambda: self.frames, 'a frame')

    def walk(self) -> None:
        """Arm, with the test as brain, and wait until all servos follow."""
        self.answering = True
        self.arm()

    def arm(self) -> None:
        """
        Arm with whatever brain there is, and wait until all servos follow.

        On a busy machine targets may come too late while the servos are energised; the robot then
        rightly disarms, and is armed again.
        """
        self.wait_for_frames()

        def following() -> bool:
            if self.state() in ('', 'DISARMED', 'FAULT'):
                self.trigger('arm')
                self.spin(0.2)
            return self.state() == 'ACTIVE' and self.all_driven()
        self.system.wait(following, 'state ACTIVE')
        if self.word:
            self.say(self.word)

    def say(self, word: str) -> tuple[int, str, dict[str, str]]:
        """Tell the brain a word, which is the robot's until another one is said."""
        self.word = word
        return self.system.tell(word)

    def all_driven(self) -> bool:
        """Whether all twelve servos get pulses, asked of the chip."""
        return all(self.chips.outputs()[-1].pulses_us[:12])

    def following(self) -> bool:
        """Whether all servos are driven, and pulses changed a moment ago."""
        return self.all_driven() and time.monotonic() - self.chips.outputs()[-1].since_s < 0.1

    def wait_until_following(self) -> None:
        """Wait until servos follow targets; arm again what a busy machine disarmed."""
        def following() -> bool:
            if self.off():
                self.arm()
            return self.following()
        self.system.wait(following, 'servos that follow')

    def longest_gap_s(self, since_ns: int, until_ns: int) -> float:
        """Return the longest time between frames of which one lies within two times (ROS clock)."""
        stamps = [stamp_ns(frame.header.stamp) for frame in self.frames]
        return max((after - before for before, after in pairwise(stamps)
                    if after >= since_ns and before <= until_ns), default=0) / 1e9

    def now_ns(self) -> int:
        """Return the time that frames are stamped with."""
        return int(self.system.node.get_clock().now().nanoseconds)

    def wait_for_state(self, state: str) -> None:
        self.system.wait(lambda: self.state() == state, f'state {state}')

    def state(self) -> str:
        status = self.system.statuses.get('hardware: safety')
        values = {} if status is None else {item.key: item.value for item in status.values}
        return values.get('state', '')

    def off(self) -> bool:
        """Whether no channel puts out a pulse, asked of the chip."""
        return not any(self.chips.outputs()[-1].pulses_us)

    def wait_until_off(self) -> None:
        self.system.wait(self.off, 'all channels off')

    def spin(self, seconds: float) -> None:
        """Let time pass."""
        end_s = time.monotonic() + seconds
        self.system.wait(lambda: time.monotonic() >= end_s, 'time', seconds + 5)

    def pin_history(self, since_s: float) -> list[tuple[float, np.ndarray]]:
        """Return what the twelve pins did from a moment of the monotonic clock on."""
        outputs = self.chips.outputs()
        before = [output for output in outputs if output.since_s <= since_s][-1:]
        return [(output.since_s, np.array(output.pulses_us[:12]))
                for output in [*before, *(o for o in outputs if o.since_s > since_s)]]

    def close(self) -> None:
        """End the node before its chips, and all before the system."""
        for process in reversed(self.system.processes):
            process.stop()
        self.chips.close()

    def swing_us(self, seconds: float) -> np.ndarray:
        """
        Return how far each pulse ranged in some seconds from now on.

        Where a busy machine let targets come too late, so that the robot rightly relaxed, it is
        armed and measured again.
        """
        for _ in range(5):
            self.spin(seconds)
            pins = np.array([pulses for _, pulses in self.pin_history(time.monotonic() - seconds)])
            if pins.all():
                return np.ptp(pins, axis=0)
            self.arm()
        raise AssertionError(f'never driven for {seconds:g} s\n{self.system.logs()}')
