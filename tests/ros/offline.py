"""The offline evaluation that a ROS run in lockstep has to repeat."""

from __future__ import annotations

from functools import cache

import numpy as np

from w2b_core import bodies
from w2b_core.controller import file as controller_file
from w2b_core.network import Network
from w2b_core.vocabulary import Vocabulary
from w2b_sim.engines.pybullet_engine import PyBulletSimulation
from w2b_sim.rollout import rollout
from w2b_sim.worlds import WORLDS

STEPS = 500
CONTROLLER = controller_file.load(controller_file.resolve('quadruped_serial'))
BODY = bodies.get(CONTROLLER.body)
JOINTS = [joint.name for joint in BODY.joints]
FEET = [sensor.removeprefix('touch:') for sensor in BODY.sensors]


@cache
def offline_positions_m(text: str, steps: int = STEPS) -> np.ndarray:
    """Return the positions (steps, 3) of the shipped quadruped's base under a command."""
    return offline_positions_of(CONTROLLER.network, text, steps)


def offline_positions_of(network: Network, text: str, steps: int) -> np.ndarray:
    """Return the positions (steps, 3) of the quadruped's base, moved by a network."""
    simulation = PyBulletSimulation(BODY, WORLDS[BODY.world])
    try:
        return rollout(simulation, BODY, network, Vocabulary.load().phrase(text).signal,
                       steps).position_m
    finally:
        simulation.close()


def assert_repeats(system, first_stamp_ns: int, text: str, steps: int = STEPS) -> None:
    """Assert that what the client saw since a stamp is the offline evaluation to 1e-9 m."""
    period_ns = round(CONTROLLER.period_s * 1e9)
    stamps = [first_stamp_ns + number * period_ns for number in range(steps)]
    system.wait(lambda: stamps[-1] in system.positions_m, f'frame {steps}')
    seen = np.array([system.positions_m[stamp] for stamp in stamps])
    assert np.abs(seen - offline_positions_m(text, steps)).max() < 1e-9
