"""The whole robot without a robot: brain and hardware node over DDS, chips on a simulated body."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any

import numpy as np
from std_srvs.srv import Trigger

from tests.ros.harness import System
from w2b_controller.say import values_of
from w2b_hw.emulation.client import SocketTransport


class WholeRobot:
    """
    Processes: the emulated chips with their body, the hardware node, the brain.

    They run in lockstep: the body's time goes on when the brain has answered, so that a busy
    machine makes a run slow and not wrong. All times here are the body's.
    """

    def __init__(self, system: System, folder: Path, controller: Path,
                 body: str = 'physical_twin') -> None:
        self.system = system
        self.refusals: list[str] = []
        socket = str(folder / 'chips')
        system.start('emulator', socket, '--body', body, '--lockstep')
        system.wait(lambda: os.path.exists(socket), 'the emulated chips')
        self.chips = SocketTransport(socket, timeout_s=60.0)
        self.hardware = system.start('hardware', transport=f'simulated:{socket}',
                                     real_time_factor=0.0, body=body)
        self.brain = system.start('brain', controller=str(controller))
        system.wait_for_brain()

    def arm(self) -> None:
        """Arm, as soon as the brain answers frames, and wait until it stands."""
        def standing() -> bool:
            if self.state() in ('', 'DISARMED', 'FAULT'):
                answer = self.system.call(Trigger, 'hardware/arm', Trigger.Request())
                self.refusals.append(answer.message)
                self.go_on(0.5)
            return self.state() == 'ACTIVE' and self.height_m() > 0.06
        self.system.wait(standing, 'a robot that stands')

    def state(self) -> str:
        status = self.system.statuses.get('hardware: safety')
        return '' if status is None else values_of(status).get('state', '')

    def seen(self) -> dict[str, Any]:
        """Where the body is."""
        seen: dict[str, Any] = self.chips.request({'body': True})['body']
        return seen

    def height_m(self) -> float:
        return float(self.seen()['position_m'][2])

    def follow(self, word: str, seconds: float) -> Way:
        """Say a word, let it be followed, and return the way of the body since then."""
        level, message, _ = self.system.tell(word)
        assert level == 0, message
        return self.go_on(seconds)

    def go_on(self, seconds: float) -> Way:
        """Return the way of the body in some of its seconds from now on."""
        log = [self.seen()]

        def over() -> bool:
            log.append(self.seen())
            return bool(log[-1]['time_s'] >= log[0]['time_s'] + seconds)
        self.system.wait(over, f'{seconds:g} s of the body', 20 * seconds + 60)
        return Way(log)

    def close(self) -> None:
        """End the nodes before the chips."""
        for process in reversed(self.system.processes):
            process.stop()
        self.chips.close()


class Way:
    """Where a body went, in the axes of its heading at the beginning."""

    def __init__(self, log: list[dict[str, Any]]) -> None:
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
        return (f'{self.seconds:.1f} s: along {self.along_m:+.3f} m, across {self.across_m:+.3f} m'
                f', turned {self.turned_deg:+.1f} deg, height {self.height_m:.3f} m')
