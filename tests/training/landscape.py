"""An evaluator with a closed form, to test what evolution does with outcomes, not the physics."""

import numpy as np

from w2b_sim.engines.interface import Evaluation

VECTORS = {word: np.random.default_rng(index).normal(size=12) for index, word in enumerate(
    ('forward', 'backward', 'stop', 'cease', 'suspend', 'halt'))}


class Landscape:
    """A robot that goes where the first motor's weights point, by the word's first element."""

    def __init__(self):
        self.batches = []

    def evaluate(self, network, signals, starts):
        """Return an outcome that depends smoothly on the weights, the word and the start."""
        motor = network.motor_weights.reshape(len(network.motor_weights), -1)
        self.batches.append((len(motor), len(signals), len(starts)))
        target = np.linspace(-1, 1, motor.shape[1])
        closeness = np.exp(-((motor - target) ** 2).mean(axis=1))
        lift = np.array([1 + 10 * start.height_m for start in starts])
        x = (closeness[:, None] * np.asarray(signals)[:, 0])[..., None] * lift
        position = np.stack([x, 0 * x, 0 * x + 0.1], axis=-1)
        return Evaluation(position, np.abs(x), np.full(x.shape, 0.01), np.zeros((*x.shape, 0)))
