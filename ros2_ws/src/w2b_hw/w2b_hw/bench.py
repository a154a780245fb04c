"""
How fast and how heavy the robot's side is, on emulated chips.

    python -m w2b_hw.bench [--json] [--seconds 10] [--controller physical_twin]

Four measurements: bits and time of a frame on the I2C wire, lateness of frames, time from a
published target to the pulse, memory and CPU of brain and hardware node at work.
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from tempfile import TemporaryDirectory
from typing import Any

from w2b_hw.bench_ros import footprint, latency
from w2b_hw.calibration import nominal
from w2b_hw.emulation.robot import IMUS, EmulatedRobot
from w2b_hw.imu import registry
from w2b_hw.io_thread import IoThread
from w2b_hw.joints import JOINTS
from w2b_hw.power import Power
from w2b_hw.robot import Report, Robot
from w2b_hw.targets import FRAME_S
from w2b_hw.transport import FrameBudget

_ANSWER_S = 0.002
CLOCKS_HZ = (100_000, 400_000)


def wire(imu: str) -> dict[str, Any]:
    """Return bits, transfers and time of a frame and of the pose in answer to its target."""
    clock = itertools.accumulate(itertools.cycle((FRAME_S - _ANSWER_S, _ANSWER_S)),
                                 initial=1000.0)
    now_s = next(clock)
    chips = EmulatedRobot(imu, clock=lambda: now_s)
    bus = FrameBudget(chips.wire)
    robot = Robot(bus, nominal(), Power())
    robot.connect()
    robot.attach_imu(registry.find(bus, imu))
    counts = {'frame': (0, 0), 'answer': (0, 0)}
    for _ in range(60):
        now_s = next(clock)
        counts['frame'] = _counted(chips, robot.frame, now_s)
        now_s = next(clock)
        robot.safety.take_target((0.0,) * len(JOINTS), now_s)
        counts['answer'] = _counted(chips, robot.drive, now_s)
        if robot.safety.state.value == 'DISARMED':
            robot.arm(now_s)
    bits = counts['frame'][0] + counts['answer'][0]
    return {'imu': imu, 'frame_bits': counts['frame'][0], 'answer_bits': counts['answer'][0],
            'bits': bits, 'transfers': counts['frame'][1] + counts['answer'][1],
            **{f'ms_at_{clock_hz // 1000}_khz': round(1e3 * bits / clock_hz, 2)
               for clock_hz in CLOCKS_HZ}}


def _counted(chips: EmulatedRobot, act: Callable[[float], Report], now_s: float
             ) -> tuple[int, int]:
    bits, transfers = chips.wire.bits, chips.wire.transfers
    act(now_s)
    return chips.wire.bits - bits, chips.wire.transfers - transfers


def jitter(seconds: float) -> dict[str, Any]:
    """Return how late frames begin, with a brain that answers each; no ROS."""
    bus = FrameBudget(EmulatedRobot().wire)
    robot = Robot(bus, nominal(), Power())
    robot.connect()
    robot.attach_imu(registry.find(bus))
    frame = threading.Event()
    io = IoThread(robot, period_s=FRAME_S, on_frame=lambda report: frame.set(),
                  on_pose=lambda report: None)
    io.lateness_s = deque()
    io.start()
    ends_s = time.monotonic() + seconds
    while time.monotonic() < ends_s:
        frame.wait(FRAME_S)
        frame.clear()
        phase = 2 * math.pi * time.monotonic()
        io.target(tuple(0.3 * math.sin(phase + n) for n in range(len(JOINTS))))
    io.stop()
    return {'frames': len(io.lateness_s), **percentiles('late', [*io.lateness_s][1:])}


def percentiles(name: str, seconds: Sequence[float]) -> dict[str, float]:
    """Return median, 99th percentile and maximum in ms."""
    ordered = sorted(1e3 * value for value in seconds)
    return {f'{name}_ms_median': round(ordered[len(ordered) // 2], 3),
            f'{name}_ms_p99': round(ordered[math.ceil(0.99 * len(ordered)) - 1], 3),
            f'{name}_ms_max': round(ordered[-1], 3)}


def bench(seconds: float = 10.0, controller: str = 'physical_twin') -> dict[str, Any]:
    """Return all measurements."""
    with TemporaryDirectory() as folder:
        delays_s = latency(folder, seconds)
        weights = footprint(folder, seconds, controller)
    return {'wire': [wire(imu) for imu in IMUS], 'jitter': jitter(seconds),
            'latency': {'targets': len(delays_s), **percentiles('target_to_pulse', delays_s)},
            'footprint': weights}


def main() -> None:
    """Print the measurements."""
    parser = argparse.ArgumentParser(description='Timing, memory and CPU of the robot side.')
    parser.add_argument('--json', action='store_true')
    parser.add_argument('--seconds', type=float, default=10.0, help='of each measurement')
    parser.add_argument('--controller', default='physical_twin',
                        help="the brain's, by name or path (default: %(default)s)")
    arguments = parser.parse_args()
    results = bench(arguments.seconds, arguments.controller)
    if arguments.json:
        print(json.dumps(results, indent=1))
        return
    for name, values in results.items():
        for row in values if isinstance(values, list) else [values]:
            print(f'{name}: ' + ', '.join(f'{key} {value}' for key, value in row.items()))


if __name__ == '__main__':
    main()
