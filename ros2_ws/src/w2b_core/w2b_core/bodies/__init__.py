"""
The registered bodies, by name. `get(name)` builds one; `names()` lists them.

Wherever a body's name is taken, so is a file: a maker's YAML (see `robot_file`), a body as JSON
(see `description`), or a controller file that carries its body.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial
from pathlib import Path

from w2b_core.bodies.minimal import minimal
from w2b_core.bodies.model import Body
from w2b_core.bodies.physical_twin import physical_twin
from w2b_core.bodies.quadruped import quadruped
from w2b_core.bodies.spherical import WIRINGS, spherical
from w2b_core.bodies.wiring import Wiring
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
#: Names of the bodies that come with the program.
BUILT_IN = BODIES.built_in()

#: Endings of files that describe a body.
SUFFIXES = ('.yaml', '.yml', '.json')


def names() -> tuple[str, ...]:
    """Return the names of all registered bodies."""
    return BODIES.names()


def is_file(name: str) -> bool:
    """Return whether a body's name is meant as a file."""
    return name.endswith(SUFFIXES) or os.sep in name


def get(name: str) -> Body:
    """
    Return the body called `name`, or described by the file `name`.

    Raises
    ------
    ValueError
        If there is none of this name (the message has those there are), or the file cannot be
        used: one line with the file, the part and the remedy.

    """
    if not is_file(name):
        return BODIES.get(name)()
    path = Path(name).expanduser()
    if path.suffix == '.json':
        from w2b_core.bodies import description

        return description.load(path)
    body, _wiring = _robot(path)
    return body


def check(name: str) -> Body:
    """Return what `get` does; ValueError that names the field `body` otherwise."""
    if not is_file(name) and name not in BODIES:
        raise ValueError(f'body: expected one of {", ".join(names())}, or a file such as '
                         f'my_robot.yaml, got {name!r}')
    return get(name)


def to_carry(body: Body) -> Body | None:
    """Return what a controller file must carry of a body: None of one that every program has."""
    return None if body.name in BUILT_IN and BODIES.get(body.name)() == body else body


def wiring(name: str) -> dict[str, Wiring]:
    """
    Return how each joint of a body is wired, joint -> servo, in the order of the joints.

    A body whose file says nothing has its servos on the board's outputs in that order. ValueError
    as of `get`.
    """
    if is_file(name):
        path = Path(name).expanduser()
        says = path.suffix != '.json'
    else:
        path = Path(__file__).with_name(f'{name}.yaml')
        says = path.is_file()
    body, given = _robot(path) if says else (get(name), {})
    joints = [joint.name for joint in body.joints]
    if not given:
        return {joint: Wiring(channel) for channel, joint in enumerate(joints)}
    if set(given) != set(joints):
        wrong = sorted(set(given) ^ set(joints))
        raise ValueError(f'{path}: servos: expected each joint of {body.name} once, '
                         f'missing or unknown: {", ".join(wrong)}')
    return {joint: given[joint] for joint in joints}


def _robot(path: Path) -> tuple[Body, dict[str, Wiring]]:
    from w2b_core.bodies import robot_file

    robot = robot_file.read(path)
    return robot.body or get(robot.settings.body), robot.wiring
