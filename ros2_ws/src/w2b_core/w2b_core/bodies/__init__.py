"""The registered bodies, by name. `get(name)` builds one; `names()` lists them."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from w2b_core.bodies.minimal import minimal
from w2b_core.bodies.model import Body
from w2b_core.bodies.physical_twin import physical_twin
from w2b_core.bodies.quadruped import quadruped
from w2b_core.bodies.spherical import WIRINGS, spherical

_BODIES: dict[str, Callable[[], Body]] = {
    'quadruped': quadruped,
    'quadruped_blind': partial(quadruped, name='quadruped_blind', touch=False),
    'minimal': minimal,
    **{f'spherical_{dof}dof_{wiring}': partial(spherical, dof, wiring)
       for dof in (1, 2) for wiring in WIRINGS},
    'physical_twin': physical_twin,
}


def names() -> tuple[str, ...]:
    """Return the names of all registered bodies."""
    return tuple(_BODIES)


def get(name: str) -> Body:
    """Return the body called `name`; ValueError, with the names there are, if there is none."""
    if name not in _BODIES:
        raise ValueError(f'unknown body {name!r}: expected one of {", ".join(_BODIES)}')
    return _BODIES[name]()
