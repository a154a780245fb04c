"""A controller with an ear and legs: the shipped ear, legs drawn at random."""

import json
from importlib.resources import files

import numpy as np

from w2b_core import bodies
from w2b_core.behaviours import course_of
from w2b_core.controller import file as controller_file
from w2b_core.hearing import Ear
from w2b_core.network.leaky import BLOCKS, LEAST_LEAK, LeakyNetwork

SENSES = ('heading', 'steer', 'yaw_rate')


def ear() -> Ear:
    return Ear.from_json(json.loads((files('training') / 'grounding' / 'ear.json').read_text()))


def network(hidden: int, behaviours: int, senses: int, motors: int, seed: int = 1) -> LeakyNetwork:
    rng = np.random.default_rng(seed)
    sizes = {'H': hidden, 'K': behaviours, 'S': senses, 'M': motors}
    blocks = {}
    for block in BLOCKS:
        shape = tuple(sizes[axis] for axis in block.shape)
        low = LEAST_LEAK if 'leak' in block.name else -1.0
        blocks[block.name] = rng.uniform(low, 1.0, shape)
    return LeakyNetwork(**blocks)


def controller(senses: tuple[str, ...] = SENSES, seed: int = 1) -> controller_file.Controller:
    body, heard = bodies.get('physical_twin'), ear()
    return controller_file.Controller(
        body=body.name, network=network(14, len(heard.behaviours), len(senses),
                                        len(body.joints), seed),
        sensors=senses, period_s=0.05, words=(), record={'how': 'drawn at random'},
        motors=tuple(controller_file.Motor(joint.name, joint.lower_rad, joint.upper_rad, 1.0)
                     for joint in body.joints),
        behaviours=heard.behaviours, courses=tuple(map(course_of, heard.behaviours)), ear=heard)
