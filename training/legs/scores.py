"""What a phase earns: progress times exp(-faults), a bounded pure function of its figures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from training.legs.parts import Terms
from training.legs.recipe import Recipe
from w2b_core import bodies
from w2b_core.behaviours import course_of
from w2b_sim.recording import PhaseOutcome

Array = NDArray[np.float64]


class Scores:
    """
    The scores of a recipe's behaviours.

    A product, since a sum of penalties teaches to stand still: nothing is better than to stand
    only because it moves badly. Scores are in -1..1; a fall is -1.
    """

    def __init__(self, recipe: Recipe) -> None:
        self.recipe = recipe
        body = bodies.get(recipe.body)
        self.length_m = body.length_m
        self.greatest_torque_nm = float(np.mean([joint.servo.max_torque_nm
                                                 for joint in body.joints]))

    def score(self, behaviour: str, did: PhaseOutcome, offset_rad: Array | float = 0.0) -> Array:
        """
        Return the scores (...) of a phase under a behaviour.

        `offset_rad` is the heading that was to be held, from the one at the phase's begin.
        """
        aims, kind = self.recipe.aims, self.recipe.kind(behaviour)
        faults = self._faults(getattr(aims, kind), self.figures(behaviour, did, offset_rad))
        progress = np.clip(self._progress(behaviour, did, offset_rad), -1.0, 1.0)
        score = np.where(progress > 0, progress * np.exp(-faults), progress)
        score = np.where(did.lowest_up < aims.fallen_up, -1.0, score)
        return np.nan_to_num(score, nan=-1.0)

    def _progress(self, behaviour: str, did: PhaseOutcome, offset_rad: Array | float) -> Array:
        """Return the speed (...) as a share of the aim; 1 of a behaviour that stays."""
        aims, course = self.recipe.aims, course_of(behaviour)
        match self.recipe.kind(behaviour):
            case 'walk':
                # Straight on may mean a heading that is not the one at the begin.
                speed = did.going_m_s / np.cos(np.clip(offset_rad, -1.0, 1.0)) * course.along
                return speed / (aims.walk_body_lengths_s * self.length_m)
            case 'turn':
                return did.turning_rad_s * course.turn / aims.turn_rad_s
        return np.ones_like(did.going_m_s)

    def figures(self, behaviour: str, did: PhaseOutcome, offset_rad: Array | float
                ) -> dict[str, Array]:
        """Return the figures (...) that terms of a recipe may name."""
        way = np.hypot(did.along_m, did.across_m)
        across = did.across_m * np.cos(offset_rad) - did.along_m * np.sin(offset_rad)
        share = did.height_m / did.start_height_m
        return {
            'rhythm_hz': did.rhythm_hz, 'fastest_joint_hz': did.fastest_joint_hz,
            'at_speed_limit': did.at_speed_limit,
            'torque_share': np.nan_to_num(did.torque_nm) / self.greatest_torque_nm,
            'tilt': did.tilt, 'lowered': 1 - did.lowest_m / did.start_height_m,
            'heading_error_rad': np.abs(did.yaw_rad - offset_rad),
            'across_share': np.abs(across) / (way + self.length_m),
            'wobble_rad': did.wobble_rad, 'displacement_m': way,
            'displacement_lengths': way / self.length_m,
            'excess': np.maximum(self._progress(behaviour, did, offset_rad) - 1.0, 0.0),
            'drift_m': did.drift_m, 'drift_lengths': did.drift_m / self.length_m,
            'joint_speed_rad_s': did.joint_speed_rad_s,
            'height_change': np.abs(share - 1.0), 'height_share': share}

    @staticmethod
    def _faults(terms: Terms, figures: dict[str, Array]) -> Array:
        total: Array = np.zeros(())
        for name, term in terms.items():
            share = (figures[name] - term.free) / (term.full - term.free)
            total = total + term.weight * np.clip(share, 0.0, 1.0)
        return total
