"""The joints that servos turn: names, limits and park pose, from the description of the body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from w2b_core import bodies
from w2b_core.bodies.model import Body, Vector
from w2b_core.bodies.robot_file.directions import STEP_RAD, in_words, motions
from w2b_core.bodies.wiring import CHANNELS, Wiring

#: The body that the robot is built as unless another is named.
BODY = 'physical_twin'
MOST_JOINTS = CHANNELS


@dataclass(frozen=True)
class JointList:
    """
    The joints of one body, in the order of its motor neurons.

    Attributes
    ----------
    body
        Its name.
    names, lower_rad, upper_rad, park_rad: one for each joint
        Limits, and the pose that servos are energised at and parked in: the standing pose of the
        description, in which all joints are at 0, or as near as the limits allow.
    wiring
        Of each joint: the output of its servo, its direction and its pulses, from the body's file;
        outputs in the order of the joints where none says otherwise.
    way_m
        Where the end of a joint's leg goes as it turns by +10 degrees; empty: not known.

    """

    body: str
    names: tuple[str, ...]
    lower_rad: tuple[float, ...]
    upper_rad: tuple[float, ...]
    wiring: tuple[Wiring, ...] = ()
    way_m: tuple[Vector, ...] = ()

    def __post_init__(self) -> None:
        """Check that one board can drive them (ValueError)."""
        if not 0 < len(self.names) <= MOST_JOINTS:
            raise ValueError(f'body {self.body}: expected 1 to {MOST_JOINTS} joints, as many as a '
                             f'servo board has outputs, got {len(self.names)}')
        if not self.wiring:
            object.__setattr__(self, 'wiring', tuple(map(Wiring, range(len(self.names)))))

    @property
    def park_rad(self) -> tuple[float, ...]:
        """The park pose."""
        return tuple(min(max(0.0, low), high)
                     for low, high in zip(self.lower_rad, self.upper_rad, strict=True))

    def motion(self, joint: str, angle_rad: float) -> str:
        """Return in words where the end of a joint's leg goes as it turns by about 10 degrees."""
        if not self.way_m:
            return 'the way that is positive'
        return in_words(np.array(self.way_m[self.names.index(joint)]) * (angle_rad / STEP_RAD))

    def limits_rad(self, joint: str) -> tuple[float, float]:
        """Return the limits of a joint (ValueError if there is no such joint)."""
        number = self.names.index(joint)
        return self.lower_rad[number], self.upper_rad[number]


def of_body(body: Body, wiring: Sequence[Wiring] = ()) -> JointList:
    """Return the joints of a body (ValueError if one board cannot drive them)."""
    return JointList(body.name, tuple(joint.name for joint in body.joints),
                     tuple(joint.lower_rad for joint in body.joints),
                     tuple(joint.upper_rad for joint in body.joints), tuple(wiring),
                     tuple(motion.way for motion in motions(body).values()))


def named(body: str) -> JointList:
    """Return the joints of the body with this name, or in this file (ValueError if none is)."""
    described = bodies.get(body)
    if len(described.joints) > MOST_JOINTS:
        return of_body(described)  # refused there
    return of_body(described, tuple(bodies.wiring(body).values()))


TWIN = named(BODY)
JOINTS = TWIN.names
