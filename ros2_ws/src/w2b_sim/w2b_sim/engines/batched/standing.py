"""
How many sweeps of the dry friction solve a body needs to stand still.

Gauss-Seidel that ends early leaves a little of each step's error in the joints, and a body on bent
legs sinks at a constant rate. More sweeps cost time, so each body gets the fewest with which it
stands still. Bodies in the `paper` world keep theirs: its viscous friction makes them creep.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable

#: A body that moves by less in `STAND_S` stands still.
STILL_M = 0.001
#: What is not counted: the body settles on its feet.
SETTLE_S = 1.0
STAND_S = 5.0
#: Numbers of sweeps to try, after the usual one.
LADDER = (20, 30, 45, 70, 100, 150, 220)

_found: dict[Hashable, tuple[int, float]] = {}


def enough_sweeps(key: Hashable, usual: int, creep_m: Callable[[int], float]
                  ) -> tuple[int, float]:
    """
    Return the fewest sweeps with which a body stands still, and how far it creeps then, m.

    A body that moves with any number of them does not stand, whatever the solve: it gets the usual
    ones.

    Parameters
    ----------
    key
        What the answer depends on: it is worked out once in a process.
    usual
        Where to begin.
    creep_m
        Returns how far the body moves with so many sweeps.

    """
    if key not in _found:
        for sweeps in (usual, *(more for more in LADDER if more > usual)):
            creep = creep_m(sweeps)
            if usual == sweeps:
                _found[key] = usual, creep
            if creep < STILL_M:
                _found[key] = sweeps, creep
                break
    return _found[key]
