"""Version 1 of the controller file: the paper's network, primed with a word."""

from __future__ import annotations

from typing import Any

import numpy as np

from w2b_core.controller.model import Controller, Motor
from w2b_core.json_fields import Fields, JsonFileError, Text, expect
from w2b_core.network import Network


def dump(controller: Controller, network: Network) -> dict[str, Any]:
    """Return the fields that only this version has."""
    return {'network': {
        'input': 'serial', 'vector_length': controller.vector_length,
        'hidden_weights': network.hidden_weights.tolist(),
        'motor_weights': network.motor_weights.tolist(),
        'sensors': list(controller.sensors),
        'motors': [vars(motor) for motor in controller.motors]}}


def load(top: Fields) -> dict[str, Any]:
    """Take these fields out of `top`; return arguments of `Controller` (JsonFileError)."""
    network = top.fields('network')
    way_in = network.text('input')
    expect(way_in == 'serial', 'network.input', "'serial'", way_in)
    motors = tuple(_motor(fields) for fields in network.list_of_fields('motors'))
    hidden, motor = network.matrix('hidden_weights'), network.matrix('motor_weights')
    expect(len(motor) == len(motors), 'network.motor_weights',
           f'{len(motors)} rows, one for each of network.motors', Text(f'{len(motor)} rows'))
    try:
        net = Network(np.array(hidden), np.array(motor),
                      np.array([motor.time_constant for motor in motors]))
    except ValueError as error:
        raise JsonFileError(f'network.{error}') from None
    parts = {'network': net, 'sensors': network.texts('sensors'), 'motors': motors,
             'vector_length': network.integer('vector_length')}
    network.finish()
    return parts


def _motor(fields: Fields) -> Motor:
    motor = Motor(fields.text('joint'), fields.number('lower_rad'), fields.number('upper_rad'),
                  fields.number('time_constant'))
    fields.finish()
    return motor
