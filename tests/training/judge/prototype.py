"""Legs of the prototype beside the checkout, as a controller: networks that are known to walk."""

import json
from pathlib import Path

import numpy as np
import pytest

from w2b_core import bodies
from w2b_core.behaviours import BEHAVIOURS
from w2b_core.controller.model import Controller, Motor
from w2b_core.hearing import Ear
from w2b_core.network import LeakyNetwork

ROOT = Path(__file__).resolve().parents[3]
FOLDER = ROOT.parent / 'shared' / 'prototype' / 'legs'
EAR = ROOT / 'training' / 'grounding' / 'ear.json'
#: The order of its commands.
COMMANDS = ('forward', 'backward', 'stop', 'left', 'right', 'sit')
#: The prototype felt the rate of turn in rad/s, and its pitch.
SENSES, SCALES = ('heading', 'steer', 'yaw_rate', 'gravity:x'), (1.0, 1.0, 4.0, 1.0)


def controller(name: str) -> Controller:
    """Return the controller; the test is skipped where the prototype is not to be had."""
    path = FOLDER / f'{name}.npz'
    if not path.is_file():
        pytest.skip(f'the prototype is not beside this checkout: {path.name}')
    body = bodies.get('physical_twin')
    ear = Ear.from_json(json.loads(EAR.read_text(encoding='utf-8')))
    order = [COMMANDS.index(behaviour) for behaviour in ear.behaviours]
    with np.load(path) as saved:
        network = LeakyNetwork(
            hidden=saved['W'], command=saved['C'][:, order], senses=saved['S'] * SCALES,
            hidden_leak=saved['A'], rest=saved['primed'], motor=saved['M'][0],
            motor_command=saved['B'][:, order], motor_senses=saved['T'] * SCALES,
            motor_leak=saved['L'])
    return Controller(
        body=body.name, network=network, sensors=SENSES,
        motors=tuple(Motor(joint.name, joint.lower_rad, joint.upper_rad, 1.0)
                     for joint in body.joints),
        period_s=0.05, words=(), behaviours=tuple(ear.behaviours),
        courses=tuple(BEHAVIOURS.get(name).course for name in ear.behaviours), ear=ear,
        vector_length=ear.vector_length)
