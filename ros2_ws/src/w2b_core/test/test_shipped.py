"""What ships works together: every controller hears words and gives targets within its joints."""

import numpy as np
import pytest

from w2b_core import bodies
from w2b_core.brain import Brain
from w2b_core.controller import file as controller_file
from w2b_core.sensor_frames import SensorFrame
from w2b_core.status import Level
from w2b_core.vocabulary import Vocabulary

FRAMES = 60


@pytest.fixture(scope='module')
def vocabulary():
    return Vocabulary.load()


def targets_rad(brain, frames, first=1):
    """Return the targets (frames, M) that answer frames of a body at rest with its feet down."""
    joints = {motor.joint: 0.0 for motor in brain.controller.motors}
    feet = {name.removeprefix('touch:'): True for name in brain.controller.sensors
            if name.startswith('touch:')}
    period_ns = round(brain.controller.period_s * 1e9)
    return np.array([brain.sense(SensorFrame(number * period_ns, joints, feet)).position_rad
                     for number in range(first, first + frames)])


@pytest.mark.parametrize('name', controller_file.shipped_names())
def test_a_word_moves_the_joints_within_their_limits_and_an_unknown_one_does_not(name, vocabulary):
    controller = controller_file.load(controller_file.shipped(name))
    assert {motor.joint for motor in controller.motors} <= {
        joint.name for joint in bodies.get(controller.body).joints}
    brain = Brain(controller, vocabulary, frame_timeout_s=0.5, clock=lambda: 0.0)
    assert brain.hear('qwxzv').level is Level.ERROR
    assert np.ptp(targets_rad(brain, FRAMES), axis=0).max() == 0.0
    assert brain.hear('forward').level is Level.OK
    walking = targets_rad(brain, FRAMES, 1 + FRAMES)
    assert np.ptp(walking, axis=0).max() > 0.1
    assert np.all(walking >= [motor.lower_rad for motor in controller.motors])
    assert np.all(walking <= [motor.upper_rad for motor in controller.motors])
