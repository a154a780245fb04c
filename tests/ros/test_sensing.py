"""A controller that feels its feet: what it senses over ROS is what it senses offline."""

from dataclasses import replace

import numpy as np
import pytest

from tests.ros.offline import BODY, CONTROLLER, offline_positions_of
from w2b_core.controller import file as controller_file
from w2b_core.network import Network

STEPS = 300


@pytest.fixture(scope='module')
def sensing():
    """The default controller with touch synapses drawn at random, and what they change."""
    network = CONTROLLER.network
    hidden = network.hidden_weights.copy()
    hidden[:, network.hidden_count + 1:] = np.random.default_rng(4).normal(
        size=(network.hidden_count, network.sensor_count))
    feeling = Network(hidden, network.motor_weights, network.motor_time_constants)
    hidden = hidden.copy()
    hidden[:, network.hidden_count + 1:] = 0.0
    numb = Network(hidden, network.motor_weights, network.motor_time_constants)
    felt = offline_positions_of(feeling, 'forward', STEPS)
    # Else the comparison below could not tell a contact that came late or not at all.
    assert np.abs(felt - offline_positions_of(numb, 'forward', STEPS)).max() > 0.01
    return replace(CONTROLLER, network=feeling, record={'note': 'random touch synapses'}), felt


def test_a_run_in_lockstep_repeats_the_offline_evaluation(system, sensing, tmp_path):
    controller, felt = sensing
    path = tmp_path / 'sensing.json'
    controller_file.save(controller, path)
    system.start('sim', body=BODY.name, paused=True)
    system.start('brain', controller=path)
    system.wait_for_brain()
    first = system.reset()
    assert system.tell('forward')[0] == 0
    system.pause(False)
    stamps = [first + number * 50_000_000 for number in range(STEPS)]
    system.wait(lambda: stamps[-1] in system.positions_m, f'frame {STEPS}')
    seen = np.array([system.positions_m[stamp] for stamp in stamps])
    assert np.abs(seen - felt).max() < 1e-9
