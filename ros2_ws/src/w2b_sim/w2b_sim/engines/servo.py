"""The servo law, one for all engines that move a body step by step."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from w2b_core.bodies.model import Joint

Array = NDArray[np.float64]
Driven = NDArray[np.bool_]

#: Torque of a servo without pulses, as a share of its greatest: what its gears resist with.
LIMP_TORQUE_SHARE = 0.05


class Servos:
    """
    The servos of M joints, see `w2b_core.bodies.model.Servo`.

    In every physics step an engine asks for the velocity that each servo steers for, and holds the
    joint at it with a motor constraint of at most `max_torque_nm` (M,).
    """

    def __init__(self, joints: Sequence[Joint]) -> None:
        servos = [joint.servo for joint in joints]
        self.max_torque_nm = np.array([servo.max_torque_nm for servo in servos])
        self._gain = np.array([servo.gain_per_s for servo in servos])
        self._speed_up = np.array([servo.max_speed_up_rad_s for servo in servos])
        self._speed_down = np.array([servo.max_speed_down_rad_s for servo in servos])

    def speeds_rad_s(self, targets_rad: Array, angles_rad: Array,
                     driven: Driven | None = None) -> Array:
        """Return the velocities (M,) that servos at `angles_rad` steer for; 0 if not driven."""
        speeds: Array = np.clip(self._gain * (targets_rad - angles_rad), -self._speed_down,
                                self._speed_up)
        return speeds if driven is None else np.where(driven, speeds, 0.0)

    def torques_nm(self, driven: Driven | None) -> Array:
        """Return the greatest torques (M,); servos that are not `driven` only resist."""
        if driven is None:
            return self.max_torque_nm
        share: Array = np.where(driven, self.max_torque_nm, LIMP_TORQUE_SHARE * self.max_torque_nm)
        return share

    def limited(self, speeds_rad_s: Array) -> Array:
        """Return (M,): 1 where such a velocity is the servo's greatest, else 0."""
        at_limit: Array = ((speeds_rad_s >= self._speed_up)
                           | (speeds_rad_s <= -self._speed_down)).astype(np.float64)
        return at_limit
