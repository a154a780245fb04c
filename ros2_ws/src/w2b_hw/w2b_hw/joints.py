"""The robot's twelve joints, in the order of its motors, and how far they may turn."""

from __future__ import annotations

from math import radians

#: The body whose controllers walk this robot.
BODY = 'physical_twin'
LEGS = ('front_left', 'back_left', 'back_right', 'front_right')
#: Hips turn about the vertical; knees and ankles pitch, positive lifts.
JOINTS = tuple(f'{leg}_{part}' for part in ('hip', 'knee', 'ankle') for leg in LEGS)
#: Limits to either side of zero, by the joint's part.
LIMIT_RAD = {'hip': radians(30), 'knee': radians(45), 'ankle': radians(45)}


def limit_rad(joint: str) -> float:
    """Return how far the joint may turn to either side (KeyError if there is no such joint)."""
    return LIMIT_RAD[joint.rpartition('_')[2]]
