"""Examination: what a network does under every behaviour, and whether a seed is dropped for it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from training.legs.parts import Drop
from training.legs.recipe import Recipe
from training.legs.task import Task
from w2b_core.behaviours import course_of

Array = NDArray[np.float64]

SECONDS = 8.0


def examine(task: Task, genome: Array, physics_steps: int) -> dict[str, Any]:
    """
    Return the fitness and each behaviour's figures, as JSON, in situations always the same.

    The situations hang on the recipe's seed alone, so that seeds are compared in the same worlds.
    """
    recipe = task.recipe
    rng = np.random.default_rng([recipe.seed, 2**20])
    trial = task.examination((SECONDS,), recipe.examination, rng)
    earned = task.run(genome[None], trial, physics_steps)
    report: dict[str, Any] = {'fitness': round(float(earned.fitness[0]), 4), 'behaviours': {}}
    for behaviour, (did,) in earned.phases.items():
        course = course_of(behaviour)
        held = task.held(behaviour, trial)
        speed = did.going_m_s * (course.along or 1.0) / task.scores.length_m
        report['behaviours'][behaviour] = {
            'score': float(earned.scores[behaviour][0]),
            'body_lengths_per_s': _median(speed), 'worst_body_lengths_per_s': float(speed.min()),
            'turning_deg_s': float(np.degrees(_median(did.turning_rad_s))),
            'heading_error_deg': float(np.degrees(_median(np.abs(did.yaw_rad - held)))),
            'worst_heading_error_deg': float(np.degrees(np.abs(did.yaw_rad - held).max())),
            'drift_m': _median(did.drift_m), 'rhythm_hz': _median(did.rhythm_hz),
            'fastest_joint_hz': _median(did.fastest_joint_hz),
            'worst_fastest_joint_hz': float(did.fastest_joint_hz.max()),
            'at_speed_limit': _median(did.at_speed_limit), 'mean_torque_nm': _torque(did.torque_nm),
            'height_m': _median(did.height_m), 'lowest_up': float(did.lowest_up.min())}
    return report


def _median(values: Array) -> float:
    return float(np.median(values))


def _torque(values: Array) -> float | None:
    """Return the median; None where the engine cannot say."""
    return None if np.isnan(values).any() else _median(values)


def reason_to_drop(report: dict[str, Any], recipe: Recipe, rule: Drop) -> str | None:
    """Return why a seed is dropped whatever its rank; None if it may go on."""
    for behaviour, figures in report['behaviours'].items():
        if recipe.kind(behaviour) == 'walk' and (
                figures['body_lengths_per_s'] < rule.walk_below_body_lengths_s):
            return (f'stands: {behaviour} at {figures["body_lengths_per_s"]:.2f} body lengths/s, '
                    f'less than {rule.walk_below_body_lengths_s}')
        if figures['fastest_joint_hz'] > rule.fastest_joint_above_hz:
            return (f'vibrates: a joint at {figures["fastest_joint_hz"]:.1f} Hz under {behaviour}, '
                    f'more than {rule.fastest_joint_above_hz}')
    return None
