"""What the judge saw as figures: medians over the starts, and the worst."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from training.judge.trial import FALLEN_UP, Seen
from w2b_core.behaviours import course_of
from w2b_sim.recording import PhaseOutcome

Array = NDArray[np.float64]
_TINY_M = 1e-9


def summary(seen: Sequence[Seen], length_m: float) -> dict[str, Any]:
    """Return the figures by behaviour, and how many switches of words were obeyed."""
    switches = [obeyed for one in seen for obeyed in one.switches.values()]
    missed = sorted({' to '.join(pair) for one in seen for pair, obeyed in one.switches.items()
                     if not obeyed})
    return {'behaviours': {name: _figures([one.behaviours[name] for one in seen], length_m,
                                          course_of(name).along or 1.0)
                           for name in seen[0].behaviours},
            'switches': {'obeyed': int(sum(switches)), 'of': len(switches), 'missed': missed}}


def _figures(outcomes: Sequence[PhaseOutcome], length_m: float, sense: float) -> dict[str, Any]:
    def all_of(name: str) -> Array:
        return np.array([float(getattr(outcome, name)) for outcome in outcomes])

    def median(values: Array) -> float:
        return float(np.median(values))

    speed = sense * all_of('along_m') / (outcomes[0].seconds * length_m)
    error_deg = np.degrees(np.abs(all_of('yaw_rad')))
    up = all_of('lowest_up')
    return {
        'along_m': median(all_of('along_m')), 'across_m': median(all_of('across_m')),
        'body_lengths_per_s': median(speed), 'worst_body_lengths_per_s': float(speed.min()),
        'heading_error_deg': median(error_deg), 'worst_heading_error_deg': float(error_deg.max()),
        'worst_across_share': float(np.max(np.abs(all_of('across_m')) / np.maximum(
            np.hypot(all_of('along_m'), all_of('across_m')), _TINY_M))),
        'yaw_deg': median(np.degrees(all_of('yaw_rad'))),
        'displacement_m': median(np.hypot(all_of('along_m'), all_of('across_m'))),
        'worst_displacement_m': float(np.hypot(all_of('along_m'), all_of('across_m')).max()),
        'drift_m': median(all_of('drift_m')), 'worst_drift_m': float(all_of('drift_m').max()),
        'rhythm_hz': median(all_of('rhythm_hz')),
        'fastest_joint_hz': median(all_of('fastest_joint_hz')),
        'at_speed_limit': median(all_of('at_speed_limit')),
        'mean_torque_nm': median(all_of('torque_nm')), 'height_m': median(all_of('height_m')),
        'falls': int((up < FALLEN_UP).sum()), 'lowest_up': float(up.min())}


HEAD = (f'{"":12}{"along m":>9}{"across m":>9}{"lengths/s":>10}{"(worst)":>8}{"off deg":>8}'
        f'{"(worst)":>8}{"yaw deg":>9}{"drift m":>9}{"Hz":>6}{"joint":>6}{"limit":>7}{"N m":>7}'
        f'{"height":>8}{"falls":>6}')


def line(name: str, row: dict[str, Any]) -> str:
    """Return one behaviour's figures as a line under `HEAD`."""
    return (f'{name:12}{row["along_m"]:9.3f}{row["across_m"]:9.3f}{row["body_lengths_per_s"]:10.2f}'
            f'{row["worst_body_lengths_per_s"]:8.2f}{row["heading_error_deg"]:8.1f}'
            f'{row["worst_heading_error_deg"]:8.1f}{row["yaw_deg"]:9.1f}{row["drift_m"]:9.4f}'
            f'{row["rhythm_hz"]:6.2f}{row["fastest_joint_hz"]:6.2f}{row["at_speed_limit"]:7.1%}'
            f'{row["mean_torque_nm"]:7.4f}{row["height_m"]:8.4f}{row["falls"]:6d}')
