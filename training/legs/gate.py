"""
The gate of legs: what both independent engines say of a controller, before it ships.

Evolution may exploit its own engine. A controller that gets less than `KEPT` of the evolved way in
PyBullet or in MuJoCo, or falls there, does not ship. What it misses of `BOUNDS` is said.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from training.judge.command import judge
from training.judge.conditions import Conditions
from training.judge.trial import Plan
from w2b_core.behaviours import BEHAVIOURS, course_of
from w2b_core.controller.model import Controller
from w2b_sim.engines import registry

#: Share of the evolved speed, and of the evolved rate of turn, that each engine must see.
KEPT = 0.5
#: Of the gate; of each behaviour.
STARTS, SECONDS = 10, 10.0


@dataclass(frozen=True)
class Bounds:
    """What any robot's legs should reach in every start but for speeds and turns, medians."""

    body_lengths_per_s: float = 0.5
    heading_deg: float = 20.0
    turn_deg: float = 30.0
    stop_m: float = 0.01


BOUNDS = Bounds()


def seen(controller: Controller, *, starts: int = STARTS, seconds: float = SECONDS,
         processes: int = 1) -> dict[str, dict[str, Any]]:
    """Return engine -> behaviour -> the judge's figures, of every engine that steps a robot."""
    return {engine: judge(controller, Plan(engine, seconds, 0.0, Conditions()), starts,
                          processes)['behaviours'] for engine in registry.stepwise_names()}


def refusals(evolved: Mapping[str, Mapping[str, Any]],
             judged: Mapping[str, Mapping[str, Mapping[str, Any]]], *,
             seconds: float = SECONDS) -> list[str]:
    """
    Return why a controller does not ship, a line each; none if it does.

    Parameters
    ----------
    evolved
        Behaviour -> figures of the champion's examination in the engine that it evolved in.
    judged
        As `seen` returns.
    seconds
        Of each behaviour there.

    """
    found = []
    for engine, behaviours in judged.items():
        for name, figures in behaviours.items():
            course = course_of(name)
            if figures['falls']:
                found.append(f'{engine}: falls in {figures["falls"]} starts under {name}')
            for there, here, unit in (
                    *([(evolved[name]['body_lengths_per_s'], figures['body_lengths_per_s'],
                        'body lengths/s')] if course.along else []),
                    *([(evolved[name]['turning_deg_s'] * course.turn,
                        figures['yaw_deg'] * course.turn / seconds, 'degrees/s')]
                      if course.turn else [])):
                if there <= 0 or here < KEPT * there:
                    found.append(f'{engine}: {name} at {here:.2f} {unit}, evolved {there:.2f}: '
                                 f'expected at least {KEPT:.0%} of it')
    return found


def misses(judged: Mapping[str, Mapping[str, Mapping[str, Any]]], bounds: Bounds = BOUNDS
           ) -> list[str]:
    """Return the bounds that are not reached, and by how much; none if all are."""
    found = []

    def expect(holds: bool, text: str) -> None:
        if not holds:
            found.append(text)

    for engine, behaviours in judged.items():
        for name, figures in behaviours.items():
            course, of = course_of(name), f'{engine}: {name}'
            if course.along:
                speed = figures['body_lengths_per_s']
                expect(speed >= bounds.body_lengths_per_s,
                       f'{of} at {speed:.2f} of {bounds.body_lengths_per_s} body lengths/s')
                worst = figures['worst_heading_error_deg']
                expect(worst <= bounds.heading_deg, f'{of} leaves its heading by {worst:.0f} '
                       f'degrees, more than {bounds.heading_deg:.0f}')
            if course.turn:
                turned = figures['yaw_deg'] * course.turn
                expect(turned >= bounds.turn_deg,
                       f'{of} turns by {turned:.0f} of {bounds.turn_deg:.0f} degrees')
            if name == 'stop':
                shift = max(figures['worst_displacement_m'], figures['worst_drift_m'])
                expect(shift <= bounds.stop_m, f'{of} shifts by {1000 * shift:.0f} mm, more than '
                       f'{1000 * bounds.stop_m:.0f}')
    return found


HEAD = ('| engine | asked for | body lengths/s (worst start) | off its heading (worst) | turned '
        '| shifts (worst) | falls |\n' + '|---' * 7 + '|')


def table(judged: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> str:
    """Return the figures as Markdown."""
    lines = [HEAD]
    for engine, behaviours in sorted(judged.items()):
        for name in (name for name in BEHAVIOURS if name in behaviours):
            figures = behaviours[name]
            walks, turns = course_of(name).along != 0, course_of(name).turn != 0
            speed = (f'{figures["body_lengths_per_s"]:.2f} '
                     f'({figures["worst_body_lengths_per_s"]:.2f})') if walks else ''
            error = (f'{figures["heading_error_deg"]:.1f} '
                     f'({figures["worst_heading_error_deg"]:.1f}) degrees') if walks else ''
            turned = f'{figures["yaw_deg"]:+.0f} degrees' if turns else ''
            shift = '' if walks else (f'{1000 * figures["displacement_m"]:.0f} '
                                      f'({1000 * figures["worst_displacement_m"]:.0f}) mm')
            lines.append(f'| {engine} | {name} | {speed} | {error} | {turned} | {shift} | '
                         f'{figures["falls"]} |')
    return '\n'.join(lines)
