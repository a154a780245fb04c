"""What swings and lifts a foot, found from a body, whatever its axes and signs are."""

from pathlib import Path

import numpy as np
import pytest

from training.legs.drives import drives
from training.legs.first import first_genomes
from training.legs.recipe import load_recipe
from w2b_core import bodies
from w2b_core.bodies.robot_file.directions import motions

ROOT = Path(__file__).resolve().parents[3]
ROBOTS = sorted((ROOT / 'examples' / 'robots').glob('*.yaml'))


@pytest.mark.parametrize('path', ROBOTS, ids=lambda path: path.stem)
@pytest.mark.parametrize(('way', 'axis'), [('swing', 0), ('lift', 2)])
def test_the_joints_together_move_the_foot_that_way(path, way, axis):
    body = bodies.get(str(path))
    alone = motions(body)
    for limb in drives(body):
        moved = sum(share * body.joints[motor].upper_rad * np.asarray(
            alone[body.joints[motor].name].way_m) for motor, share in limb.onto(way))
        assert moved[axis] > 0.5 * np.linalg.norm(moved)
        assert max(abs(share) for _motor, share in limb.onto(way)) == pytest.approx(1.0)


def test_a_joint_by_its_number_is_that_joint_alone():
    limb = drives(bodies.get('physical_twin'))[2]
    assert limb.onto(1) == ((limb.joints[1], 1.0),)


def test_a_first_genome_of_ones_own_robot_lifts_its_foot_with_all_its_joints():
    recipe = load_recipe(ROOT / 'training' / 'recipes' / 'own_robot.yaml', body=str(ROBOTS[0]))
    sharing = recipe.sharing()
    genomes = first_genomes(recipe, sharing, np.random.default_rng(0), 0.05)
    network = sharing.network(genomes)
    body = bodies.get(recipe.body)
    for number, limb in enumerate(drives(body)):
        lifting = sharing.hidden.of(number, 2)
        for motor, share in limb.onto('lift'):
            weights = network.motor[:, motor, lifting]
            assert (np.sign(weights) == np.sign(share)).all()
            assert (np.abs(weights) <= 0.8 * abs(share) + 1e-9).all()
