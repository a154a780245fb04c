"""The whole robot without a robot: brain and hardware node over DDS, chips on a simulated body."""

from __future__ import annotations

import math
import os
import time
from pathlib import Path

import numpy as np
from std_srvs.srv import Trigger

from tests.ros.harness import System
from w2b_controller.say import values_of
from w2b_hw.emulation.client import SocketTransport


class WholeRobot:
    """Processes: the emulated chips with their body, the hardware node, the brain."""

    def __init__(self, system: System, folder: Path, controller: Path) -> None:
        self.system = system
        socket = str(folder / 'chips')
        system.start('emulator', socket, '--body', 'physical_twin')
        system.wait(lambda: os.path.exists(socket), 'the emulated chips')
        self.chips = SocketTransport(socket)
        self.hardware = system.start('hardware', transport=f'emulated:{socket}')
        self.brain = system.start('brain', controller=str(controller), command_timeout=0.0)
        system.wait_for_brain()

    def arm(self) -> None:
        """Arm and wait until it stands; arm again where a busy machine let targets come late."""
        def active() -> bool:
            if self.state() in ('', 'DISARMED', 'FAULT'):
                self.system.call(Trigger, 'hardware/arm', Trigger.Request())
                self.spin(0.3)
            return self.state() == 'ACTIVE' and self.height_m() > 0.06
        self.system.wait(active, 'a robot that stands')

    def state(self) -> str:
        status = self.system.statuses.get('hardware: safety')
        return '' if status is None else values_of(status).get('state', '')

    def spin(self, seconds: float) -> None:
        """Let time pass."""
        end_s = time.monotonic() + seconds
        self.system.wait(lambda: time.monotonic() >= end_s, 'time', seconds + 5)

    def seen(self) -> dict:
        """Where the body is."""
        return self.chips.request({'body': True})['body']

    def height_m(self) -> float:
        return float(self.seen()['position_m'][2])

    def follow(self, word: str, seconds: float, every_s: float = 0.25) -> Way:
        """Say a word, let it be followed, and return the way of the body since then."""
        level, message, _ = self.system.tell(word)
        assert level == 0, message
        return self.follow_nothing(seconds, every_s)

    def follow_nothing(self, seconds: float, every_s: float = 0.25) -> Way:
        """Return the way of the body in some seconds from now on."""
        log = [self.seen()]
        for _ in range(round(seconds / every_s)):
            self.spin(every_s)
            log.append(self.seen())
        return Way(log)

    def close(self) -> None:
        """End the nodes before the chips."""
        for process in reversed(self.system.processes):
            process.stop()
        self.chips.close()


class Way:
    """Where a body went, in the axes of its heading at the beginning."""

    def __init__(self, log: list[dict]) -> None:
        self.seconds = log[-1]['time_s'] - log[0]['time_s']
        turns = np.array([seen['orientation_xyzw'] for seen in log])
        x, y, z, w = turns.T
        yaw = np.unwrap(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))
        self.turned_deg = math.degrees(yaw[-1] - yaw[0])
        places = np.array([seen['position_m'] for seen in log])
        dx, dy = places[-1, :2] - places[0, :2]
        self.along_m = math.cos(yaw[0]) * dx + math.sin(yaw[0]) * dy
        self.across_m = -math.sin(yaw[0]) * dx + math.cos(yaw[0]) * dy
        self.away_m = math.hypot(dx, dy)
        self.height_m = float(places[-1, 2])
        self.swing_rad = np.ptp([seen['joint_position_rad'] for seen in log], axis=0)

    def __repr__(self) -> str:
        return (f'{self.seconds:.1f} s: along {self.along_m:+.3f} m, across {self.across_m:+.3f} m, '
                f'turned {self.turned_deg:+.1f} deg, height {self.height_m:.3f} m')
