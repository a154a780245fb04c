"""Version 2 of the controller file: an ear that hears words, and legs that it commands."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from w2b_core.controller.model import Controller, Motor
from w2b_core.courses import Course
from w2b_core.json_fields import Fields, JsonFileError, Text, expect
from w2b_core.network.leaky import BLOCKS, Block, LeakyNetwork


def dump(controller: Controller, network: LeakyNetwork) -> dict[str, Any]:
    """Return the fields that only this version has."""
    assert controller.ear is not None
    return {
        'behaviours': [{'name': name, 'along': course.along, 'turn': course.turn}
                       for name, course in zip(controller.behaviours, controller.courses,
                                               strict=True)],
        'network': {
            'kind': 'leaky', 'sensors': list(controller.sensors),
            'motors': [{'joint': motor.joint, 'lower_rad': motor.lower_rad,
                        'upper_rad': motor.upper_rad} for motor in controller.motors],
            **{block.name: getattr(network, block.name).tolist()
               for block in _blocks(controller.sensors)}},
        'ear': controller.ear.to_json(),
    }


def load(top: Fields) -> dict[str, Any]:
    """Take these fields out of `top`; return arguments of `Controller` (JsonFileError)."""
    behaviours = []
    for fields in top.list_of_fields('behaviours'):
        behaviours.append((fields.text('name'),
                           Course(fields.number('along'), fields.number('turn'))))
        fields.finish()
    network = top.fields('network')
    kind = network.text('kind')
    expect(kind == 'leaky', 'network.kind', "'leaky'", kind)
    sensors = network.texts('sensors')
    motors = tuple(_motor(fields) for fields in network.list_of_fields('motors'))
    blocks = {block.name: _block(network, block.name, len(block.shape))
              for block in _blocks(sensors)}
    if not sensors:
        blocks['senses'] = np.zeros((len(blocks['hidden']), 0))
        blocks['motor_senses'] = np.zeros((len(blocks['motor']), 0))
    try:
        net = LeakyNetwork(**blocks)
    except ValueError as error:
        raise JsonFileError(f'network.{error}') from None
    network.finish()
    from w2b_core.hearing.ear import Ear

    try:
        ear = Ear.from_json(top.free('ear'))
    except JsonFileError:
        raise
    except ValueError as error:
        raise JsonFileError(f'ear: {" ".join(str(error).split())}') from None
    return {'network': net, 'sensors': sensors, 'motors': motors, 'ear': ear,
            'behaviours': tuple(name for name, _course in behaviours),
            'courses': tuple(course for _name, course in behaviours),
            'vector_length': ear.vector_length}


def _blocks(sensors: Sequence[str]) -> tuple[Block, ...]:
    """Return the blocks that a file holds: without senses there are no synapses from them."""
    return tuple(block for block in BLOCKS if sensors or 'S' not in block.shape)


def _block(network: Fields, name: str, axes: int) -> np.ndarray[Any, np.dtype[np.float64]]:
    return np.array(network.matrix(name) if axes == 2 else network.numbers(name))


def _motor(fields: Fields) -> Motor:
    motor = Motor(fields.text('joint'), fields.number('lower_rad'), fields.number('upper_rad'),
                  1.0)
    fields.finish()
    expect(motor.lower_rad < motor.upper_rad, f'{motor.joint}.upper_rad',
           f'more than lower_rad, {motor.lower_rad!r}', Text(str(motor.upper_rad)))
    return motor
