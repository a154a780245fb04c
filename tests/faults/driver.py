"""
A process that drives the servos as the hardware node does: robot, I/O thread and guard, no ROS.

SIGTERM ends it in order, SIGUSR1 raises an exception in the I/O thread, SIGKILL is SIGKILL.
"""

import math
import signal
import sys
import threading
import time

from w2b_hw.calibration import nominal
from w2b_hw.guard import Guard
from w2b_hw.imu import registry
from w2b_hw.io_thread import IoThread
from w2b_hw.joints import JOINTS
from w2b_hw.power import Power
from w2b_hw.robot import Robot
from w2b_hw.transport import FrameBudget, open_transport

PERIOD_S = 0.05


class InjectedError(RuntimeError):
    """What SIGUSR1 asks for."""


def main(name: str) -> int:
    """Walk until a signal; return the exit code."""
    ended, broken, answered = threading.Event(), threading.Event(), threading.Event()
    signal.signal(signal.SIGTERM, lambda number, frame: ended.set())
    signal.signal(signal.SIGUSR1, lambda number, frame: broken.set())
    bus = FrameBudget(open_transport(name))
    robot = Robot(bus, nominal(), Power())
    robot.connect()
    robot.attach_imu(registry.find(bus))
    guard = Guard(name)

    def on_frame(report):
        if broken.is_set():
            raise InjectedError
        answered.set()
        if all(report.pulses_us):
            print('driven', flush=True)

    io = IoThread(robot, period_s=PERIOD_S, on_frame=on_frame, on_pose=lambda report: None,
                  sign_of_life=guard.sign_of_life)
    io.start()
    while not ended.is_set() and io.alive():
        if answered.wait(PERIOD_S):
            answered.clear()
            phase = 2 * math.pi * time.monotonic()
            io.target(tuple(0.3 * math.sin(phase + n) for n in range(len(JOINTS))))
            if robot.safety.state.value in ('DISARMED', 'FAULT') and not ended.is_set():
                io.ask(robot.arm)
    io.stop()
    bus.close()
    guard.close()
    return 0 if io.error is None else 1


if __name__ == '__main__':
    sys.exit(main(sys.argv[1]))
