"""One trial of the judge: every behaviour, and every switch between two, from one start."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import radians

import numpy as np

from training.judge.conditions import Conditions, Trial
from w2b_core.behaviours import BEHAVIOURS, Bounds
from w2b_core.controller.model import Controller
from w2b_core.hearing.heard import Heard
from w2b_sim.engines import registry
from w2b_sim.recording import PhaseOutcome, Recording, phase_outcome
from w2b_sim.walking import ExactImu, Imu, NoImu, Phase, walk

#: Standing before the first word, in which the filter settles and the gyroscope's bias is learnt.
STAND_S = 6.0
#: A word must be obeyed by then, judged over the second before.
OBEYED_BY_S = 2.0
#: What a second of a behaviour must show, in body lengths and degrees.
MOVED_LENGTHS, STILL_LENGTHS, STRAY_LENGTHS, TURNED_DEG, SAT = 0.3, 0.1, 0.5, 4.0, 0.85


@dataclass(frozen=True)
class Plan:
    """What is done in a trial; `switch_s` 0 for no switches."""

    engine: str
    seconds: float
    switch_s: float
    conditions: Conditions


@dataclass(frozen=True)
class Seen:
    """Of each behaviour what it did; of each switch (from, to) whether it was obeyed."""

    behaviours: dict[str, PhaseOutcome]
    switches: dict[tuple[str, str], bool]


def run(controller: Controller, commands: dict[str, Heard], trial: Trial, plan: Plan) -> Seen:
    """Return what the controller does under every command (behaviour -> heard)."""
    world = trial.world
    simulation = registry.make_simulation(plan.engine, trial.body, world, trial.start)
    frames = round(plan.seconds / world.control_period_s)
    stand = _stand(plan, world.control_period_s)

    def recorded(phases: Sequence[Phase]) -> Recording:
        simulation.reset(trial.start)
        return walk(simulation, trial.body, controller, [*stand, *phases],
                    period_s=world.control_period_s, imu=_imu(trial, plan, world.control_period_s),
                    flaws=trial.flaws)

    first = sum(phase.frames for phase in stand)
    try:
        behaviours = {name: phase_outcome(recorded([Phase(heard, frames)]), first)
                      for name, heard in commands.items()}
        switches: dict[tuple[str, str], bool] = {}
        if plan.switch_s:
            each = round(plan.switch_s / world.control_period_s)
            names = tour(list(commands))
            log = recorded([Phase(commands[name], each) for name in names])
            for number, pair in enumerate(pairwise(names), 1):
                switches[pair] = obeyed(log, pair[1], first + number * each, each,
                                        trial.body.length_m, trial.body.height_m)
    finally:
        simulation.close()
    return Seen(behaviours, switches)


def _stand(plan: Plan, period_s: float) -> list[Phase]:
    """Return the standing before the first word; none is needed where the attitude is exact."""
    return [Phase(None, round(STAND_S / period_s))] if plan.conditions.simulated_imu else []


def _imu(trial: Trial, plan: Plan, period_s: float) -> Imu:
    given = plan.conditions
    if given.no_imu:
        return NoImu()
    if not given.simulated_imu:
        return ExactImu()
    from training.judge.imu import SimulatedImu

    return SimulatedImu(period_s, trial.gyro_bias_rad_s, trial.imu_seed,
                        given.imu_noise or given.hard, trial.world.gravity_m_s2)


def tour(names: Sequence[str]) -> list[str]:
    """Return a sequence in which each ordered pair of different names stands once (a circuit)."""
    left = {name: [other for other in reversed(names) if other != name] for name in names}
    stack, found = [names[0]], []
    while stack:
        if left[stack[-1]]:
            stack.append(left[stack[-1]].pop())
        else:
            found.append(stack.pop())
    return found[::-1]


def obeyed(log: Recording, behaviour: str, first: int, frames: int, length_m: float,
           height_m: float) -> bool:
    """
    Return whether a word said at frame `first` is obeyed in time, and still at its phase's end.

    Judged are the second before `OBEYED_BY_S` (or before the end, if that is earlier) and the last
    second, each from the pose at its own beginning; for sitting, from the start's height.
    """
    second = round(1.0 / log.period_s)
    by = min(round(OBEYED_BY_S / log.period_s), frames)
    known = BEHAVIOURS.get(behaviour)
    turns = known.course.turn != 0
    bounds = Bounds(move_m=MOVED_LENGTHS * length_m, turn_rad=radians(TURNED_DEG), sit_height=SAT,
                    still_m=(STRAY_LENGTHS if turns else STILL_LENGTHS) * length_m)
    for end in {first + by, first + frames}:
        did = phase_outcome(log, end - second, end)
        motion = did.motion
        motion = type(motion)(motion.along_m, motion.away_m, motion.yaw_rad,
                              did.final_height_m / height_m)
        if did.lowest_up < FALLEN_UP or not bool(known.obeyed(motion, bounds)):
            return False
    return True


#: A base tilted further than 60 degrees has fallen.
FALLEN_UP = float(np.cos(np.pi / 3))
