"""
What a controller with legs asks of its servos: `python -m training servos CONTROLLER`.

Of each behaviour, walked in a physics engine: rhythm, torque, time at the speed limit, and an
*estimate* of current and heating. Nothing of it was measured on a real servo. The estimate takes
the servo for a DC motor whose current grows with its torque from that of idling to that of a stall;
what heats it is the copper loss I^2 R. The numbers of `Motor` are of data sheets and hobbyists'
measurements of metal-gear micro servos, and may be off by a half.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict, dataclass
from math import exp

import numpy as np
from numpy.typing import NDArray

from training.judge.command import commands_of
from w2b_core.controller import file as controller_file
from w2b_core.controller.model import Controller
from w2b_sim.engines import registry
from w2b_sim.recording import SETTLE_S, Recording, phase_outcome
from w2b_sim.walking import Phase, walk
from w2b_sim.worlds import WORLDS

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Motor:
    """A metal-gear micro servo of 14 g: supply, currents, and how its case takes heat."""

    supply_v: float = 5.0
    idle_a: float = 0.01
    stall_a: float = 0.8
    #: Of the whole servo to still air; with its heat capacity of about 10 J/K, four minutes.
    kelvin_per_w: float = 25.0
    time_constant_s: float = 250.0

    def current_a(self, torque_share: Array) -> Array:
        """Return the current at a torque, as a share of the stall torque."""
        return self.idle_a + (self.stall_a - self.idle_a) * torque_share

    def heat_w(self, torque_share: Array) -> Array:
        """Return the copper loss."""
        loss: Array = self.current_a(torque_share) ** 2 * (self.supply_v / self.stall_a)
        return loss

    def warmer_k(self, heat_w: float, seconds: float) -> float:
        """Return the temperature above the air's after so long at a mean loss."""
        return heat_w * self.kelvin_per_w * (1 - exp(-seconds / self.time_constant_s))


@dataclass(frozen=True)
class Facts:
    """
    Of one behaviour; means over time, after the first second.

    `hottest_*` are of the joint that gets warmest; `current_a` is of all servos together, `peak_a`
    that of the worst control period.
    """

    rhythm_hz: float
    fastest_joint_hz: float
    at_speed_limit: float
    mean_torque_nm: float
    hottest_torque_nm: float
    hottest_joint: str
    current_a: float
    peak_a: float
    hottest_w: float
    warmer_k_after_10_min: float


def facts(recording: Recording, joints: list[str], stall_nm: Array, motor: Motor | None = None
          ) -> Facts:
    """Return the facts of a recording of one behaviour (`stall_nm` (J,) of each servo)."""
    motor = motor or Motor()
    did = phase_outcome(recording)
    settled = round(SETTLE_S / recording.period_s)
    torque = np.asarray(recording.torque_nm[settled + 1:], dtype=np.float64)
    share = np.clip(torque / stall_nm, 0.0, 1.0)
    current, heat = motor.current_a(share), motor.heat_w(share).mean(axis=0)
    hottest = int(heat.argmax())
    return Facts(
        float(did.rhythm_hz), float(did.fastest_joint_hz), float(did.at_speed_limit),
        float(torque.mean()), float(torque[:, hottest].mean()), joints[hottest],
        float(current.sum(axis=1).mean()), float(current.sum(axis=1).max()), float(heat[hottest]),
        motor.warmer_k(float(heat[hottest]), 600.0))


def measured(controller: Controller, engine: str, seconds: float) -> dict[str, Facts]:
    """Return the facts of every behaviour (ValueError as `judge` raises it)."""
    body = controller.described()
    world = WORLDS[body.world]
    simulation = registry.make_simulation(engine, body, world)
    stall = np.array([joint.servo.max_torque_nm for joint in body.joints])
    found = {}
    try:
        for name, heard in commands_of(controller).items():
            simulation.reset()
            recording = walk(simulation, body, controller,
                             [Phase(heard, round(seconds / world.control_period_s))],
                             period_s=world.control_period_s)
            found[name] = facts(recording, [joint.name for joint in body.joints], stall)
    finally:
        simulation.close()
    return found


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    add = parser.add_argument
    add('controller', help='a controller file, or the name of one that ships')
    add('--engine', choices=registry.stepwise_names(), default='mujoco',
        help='default: %(default)s')
    add('--seconds', type=float, default=10.0, metavar='S', help='default: %(default)s')
    add('--json', action='store_true', help='print JSON')


def main(args: argparse.Namespace) -> int:
    """Run the command; return the exit code: 0, or 2 for an error."""
    try:
        if not 2.0 <= args.seconds <= 3600:
            raise ValueError(f'--seconds: expected 2 to 3600, got {args.seconds}')
        controller = controller_file.load(controller_file.resolve(args.controller))
        found = measured(controller, args.engine, args.seconds)
    except (ValueError, OSError) as error:
        print(f'servos: {" ".join(str(error).split())}', file=sys.stderr)
        return 2
    if args.json:
        print(json.dumps({name: asdict(one) for name, one in found.items()}, indent=1))
    else:
        print(table(found))
    return 0


def table(found: dict[str, Facts]) -> str:
    """Return the facts as Markdown."""
    lines = ['| behaviour | rhythm, fastest joint, Hz | at speed limit | '
             'torque, mean; hottest joint, N m | current of all, mean; peak, A | '
             'heat of the hottest, W | warmer after 10 min, K |',
             '|---|---|---|---|---|---|---|']
    lines += [f'| {name} | {one.rhythm_hz:.2f}, {one.fastest_joint_hz:.2f} | '
              f'{one.at_speed_limit:.1%} | {one.mean_torque_nm:.3f}; {one.hottest_torque_nm:.3f} '
              f'({one.hottest_joint}) | {one.current_a:.1f}; {one.peak_a:.1f} | '
              f'{one.hottest_w:.2f} | {one.warmer_k_after_10_min:.0f} |'
              for name, one in found.items()]
    return '\n'.join(lines)
