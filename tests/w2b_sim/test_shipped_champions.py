"""The controllers that ship obey in PyBullet, also words that they never heard in training."""

import numpy as np
import pytest

from w2b_core import bodies
from w2b_core.controller import file as controller_file
from w2b_core.vocabulary import Vocabulary
from w2b_sim.engines.interface import Start
from w2b_sim.engines.pybullet_evaluator import PyBulletEvaluator
from w2b_sim.worlds import WORLDS

MOVES = ('forward', 'backward')
STOPS = ('stop', 'cease', 'suspend', 'halt')
STARTS = 10


def slightly_different_starts(count):
    rng = np.random.default_rng(20260)
    tilt = np.deg2rad(0.5)
    return [Start(rng.uniform(0, 0.002), rng.uniform(-tilt, tilt), rng.uniform(-tilt, tilt))
            for _ in range(count)]


QUADRUPEDS = [name for name in controller_file.shipped_names()
              if name.startswith('quadruped_')]


@pytest.mark.parametrize('name', QUADRUPEDS)
def test_a_robust_champion_obeys_from_slightly_different_starts(name):
    controller = controller_file.load(controller_file.shipped(name))
    assert 'halt' not in {trained.word for trained in controller.words}
    body = bodies.get(controller.body)
    vocabulary = Vocabulary.load()
    signals = np.array([vocabulary.vector(word) for word in MOVES + STOPS])
    network = controller.serial
    with PyBulletEvaluator(body, WORLDS[body.world], processes=2) as evaluator:
        final_m = evaluator.evaluate(network.batched(), signals,
                                     slightly_different_starts(STARTS)).final_position_m[0]
    assert np.median(final_m[0, :, 0]) >= 0.3
    assert np.median(final_m[1, :, 0]) <= -0.3
    distance_m = np.linalg.norm(final_m[2:, :, :2], axis=-1)
    assert (distance_m <= 0.1).all(), dict(zip(STOPS, distance_m.max(axis=1), strict=True))
