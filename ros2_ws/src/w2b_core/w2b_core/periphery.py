"""From what a robot senses to sensor neurons: the meaning of a body's sensor names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

KINDS = ('touch', 'position', 'motor')


def split(sensor: str) -> tuple[str, str]:
    """
    Return kind and source of a sensor's name, such as `touch:front_lower_leg`.

    `touch:LINK` reads 1 while the link touches the floor and else 0, `position:JOINT` the joint's
    angle in rad, `motor:JOINT` the value of the joint's motor neuron one step ago.

    Raises
    ------
    ValueError
        If the name is not of this form.

    """
    kind, colon, source = sensor.partition(':')
    if kind not in KINDS or not colon or not source:
        raise ValueError(f'sensor: expected touch:LINK, position:JOINT or motor:JOINT, '
                         f'got {sensor!r}')
    return kind, source


def read(sensors: Sequence[str], touching: Mapping[str, float], position_rad: Mapping[str, float],
         motors: Mapping[str, float]) -> NDArray[np.float64]:
    """
    Return the sensor neurons' values (S,), in the order of `sensors`.

    Raises
    ------
    KeyError
        If a link or joint that a sensor names was not measured.

    """
    measured = {'touch': touching, 'position': position_rad, 'motor': motors}
    return np.array([float(measured[kind][source]) for kind, source in map(split, sensors)])
