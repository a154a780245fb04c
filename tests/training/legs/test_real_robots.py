"""Real descriptions, in the folder that W2B_ROBOT_DESCRIPTIONS names, walk from the first."""

import os
import shutil
from pathlib import Path

import numpy as np
import pytest

from training.legs.champion import OWN_ROBOT
from training.legs.first import first_genomes
from training.legs.recipe import load_recipe
from training.legs.task import Task
from w2b_sim.own_robot.command import main as robot

FOLDER = os.environ.get('W2B_ROBOT_DESCRIPTIONS', '')
ROBOTS = {'mini_pupper_2': 'mini_pupper_2.urdf', 'spot_mini': 'spot.urdf',
          'bittle_esp32': 'bittle_esp32.urdf'}


@pytest.mark.parametrize('name', ROBOTS)
def test_the_best_first_genome_walks_both_ways_and_turns(name, tmp_path):
    urdf = Path(FOLDER) / name / ROBOTS[name]
    if not FOLDER or not urdf.exists():
        pytest.skip(f'W2B_ROBOT_DESCRIPTIONS names no folder with {name}/{urdf.name}')
    shutil.copy(urdf, tmp_path)
    path = tmp_path / urdf.name
    assert robot(['init', str(path), '--approximate', '--meshes', str(urdf.parent)]) == 0
    recipe = load_recipe(OWN_ROBOT, body=str(path.with_suffix('.yaml')))
    task, rng = Task(recipe), np.random.default_rng(0)
    genomes = first_genomes(recipe, task.sharing, rng, task.world.control_period_s)
    earned = task.run(genomes, task.examination((4.0,), 1, rng), 10)
    best = np.argmax(earned.fitness)
    along = {name: earned.phases[name][0].going_m_s[best].mean() / task.scores.length_m
             for name in ('forward', 'backward')}
    assert along['forward'] > 0.1
    assert along['backward'] < -0.1
    turned = {name: np.degrees(earned.phases[name][0].turning_rad_s[best].mean())
              for name in ('left', 'right')}
    assert turned['left'] > 2.0
    assert turned['right'] < -2.0
