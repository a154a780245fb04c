"""What a leg's joints do together: its foot forward, or up, whatever their axes and signs are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from w2b_core.bodies.model import Body
from w2b_core.bodies.points import spheres
from w2b_core.bodies.robot_file.stance import origins_m
from w2b_core.network.symmetry import limbs_of

Array = NDArray[np.float64]
#: Where a foot goes, in the base's axes.
WAYS = {'swing': (1.0, 0.0, 0.0), 'lift': (0.0, 0.0, 1.0)}
#: Joints that do less of it than this share of the one that does most are left out.
LEAST_SHARE = 0.05


@dataclass(frozen=True)
class Limb:
    """The joints (J,) of a limb in motor order, and the share of each in a name of `WAYS`."""

    joints: tuple[int, ...]
    shares: dict[str, Array]

    def onto(self, joint: int | str) -> tuple[tuple[int, float], ...]:
        """Return the motors that an entry of a recipe goes to, each with its share."""
        if isinstance(joint, int):
            return ((self.joints[joint], 1.0),)
        return tuple((motor, float(share)) for motor, share in zip(
            self.joints, self.shares[joint], strict=True) if abs(share) >= LEAST_SHARE)


def drives(body: Body) -> tuple[Limb, ...]:
    """
    Return the limbs of a body, see `symmetry.limbs_of`.

    Shares are in halves of each joint's range, the greatest of a way is 1 or -1: of all that move
    the foot so at the rest pose, the smallest.
    """
    origins = origins_m(body)
    found = []
    for limb in limbs_of(body):
        joints = [body.joints[number] for number in limb]
        last = body.link(joints[-1].child)
        centre = origins[last.name] + np.asarray(last.centre_m)
        foot = min((centre + place - [0.0, 0.0, radius] for place, radius in spheres(last)),
                   key=lambda point: float(point[2]))
        jacobian = np.column_stack([
            np.cross(np.asarray(joint.axis) / np.linalg.norm(joint.axis),
                     foot - origins[joint.child]) * (joint.upper_rad - joint.lower_rad) / 2
            for joint in joints])
        shares = {}
        for name, way in WAYS.items():
            share = np.linalg.pinv(jacobian, rcond=1e-3) @ np.array(way)
            greatest = np.abs(share).max()
            shares[name] = share / greatest if greatest > 0 else share
        found.append(Limb(limb, shares))
    return tuple(found)
