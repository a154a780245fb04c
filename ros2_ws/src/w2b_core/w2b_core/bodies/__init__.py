"""The registered bodies, by name. `get(name)` builds one; `names()` lists them."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from w2b_core.bodies.minimal import minimal
from w2b_core.bodies.model import Body
from w2b_core.bodies.physical_twin import physical_twin
from w2b_core.bodies.quadruped import quadruped
from w2b_core.bodies.spherical import WIRINGS, spherical
from w2b_core.registry import Registry

#: Add your own with `BODIES.add(name, function)` in a plugin; the function returns the `Body`.
BODIES: Registry[Callable[[], Body]] = Registry('body')
BODIES.add('quadruped', quadruped)
BODIES.add('quadruped_blind', partial(quadruped, name='quadruped_blind', touch=False))
BODIES.add('minimal', minimal)
for _dof in (1, 2):
    for _wiring in WIRINGS:
        BODIES.add(f'spherical_{_dof}dof_{_wiring}', partial(spherical, _dof, _wiring))
BODIES.add('physical_twin', physical_twin)


def names() -> tuple[str, ...]:
    """Return the names of all registered bodies."""
    return BODIES.names()


def get(name: str) -> Body:
    """Return the body called `name`; ValueError, with the names there are, if there is none."""
    return BODIES.get(name)()
