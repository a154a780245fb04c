"""First genomes of any robot: they stand as the body stands, swing about it, and walk."""

from pathlib import Path

import numpy as np
import pytest

from training.legs.first import first_genomes
from training.legs.recipe import RecipeError, load_recipe
from training.legs.task import Task
from w2b_core import bodies
from w2b_core.network.leaky import step
from w2b_core.network.symmetry import limbs_of

ROOT = Path(__file__).resolve().parents[3]
OWN_ROBOT = ROOT / 'training' / 'recipes' / 'own_robot.yaml'
ROBOTS = sorted((ROOT / 'examples' / 'robots').glob('*.yaml'))


def networks(body):
    recipe = load_recipe(OWN_ROBOT, body=body)
    sharing = recipe.sharing()
    genomes = first_genomes(recipe, sharing, np.random.default_rng(0), 0.05)
    return recipe, sharing, sharing.network(genomes)


def motors(recipe, network, behaviour, frames=120):
    """Return the motors (frames, genomes, motors) under a behaviour, from the first step on."""
    drive = network.drive(np.eye(len(recipe.behaviours))[recipe.behaviours.index(behaviour)])
    state, found = network.initial_state(), []
    for _ in range(frames):
        state = step(network, state, drive, np.zeros(len(recipe.senses)))
        found.append(state.motors)
    return np.array(found)


@pytest.mark.parametrize('path', ROBOTS, ids=lambda path: path.stem)
def test_every_behaviour_but_sit_is_about_the_stance_and_stop_stays_there(path):
    recipe, _sharing, network = networks(str(path))
    for behaviour in recipe.first.stance:
        # The first three seconds begin the swing, the others are whole swings but for one.
        mean = motors(recipe, network, behaviour)[60:].mean(0)
        assert np.abs(mean).max() < 0.15, behaviour
    still = motors(recipe, network, 'stop')
    assert np.abs(still).max() < 0.15, 'from the first frame on'
    assert np.abs(motors(recipe, network, 'sit')[60:].mean(0)).max() > 0.5


def test_a_limb_that_mirrors_another_follows_it_whatever_the_recipe_says_of_it():
    recipe, sharing, network = networks('physical_twin')
    assert [mirror.name for mirror in recipe.mirrors()] == ['left_right', 'fore_aft']
    forward, backward = (recipe.behaviours.index(name) for name in ('forward', 'backward'))
    limbs = limbs_of(bodies.get('physical_twin'))
    image = next(mirror for mirror in recipe.mirrors() if mirror.name == 'fore_aft').limbs[0]
    assert image != 0
    assert len(limbs) == 4
    first, other = sharing.hidden.of(0, 0), sharing.hidden.of(image, 0)
    for swings, silent, neuron in ((forward, backward, first), (backward, forward, other)):
        assert (network.command[:, neuron, swings] < 1.0).all()
        assert (network.command[:, neuron, silent] == 2.5).all()


@pytest.mark.parametrize('symmetry', ['found', ()])
@pytest.mark.parametrize('path', ROBOTS, ids=lambda path: path.stem)
def test_the_best_first_genome_walks_both_ways_and_turns_both_ways(path, symmetry):
    network = {'symmetry': symmetry, 'begins': 'stop'}
    recipe = load_recipe(OWN_ROBOT, body=str(path), network=network)
    task, rng = Task(recipe), np.random.default_rng(0)
    genomes = first_genomes(recipe, task.sharing, rng, task.world.control_period_s)
    earned = task.run(genomes, task.examination((4.0,), 1, rng), 10)
    best = np.argmax(earned.fitness)

    def did(behaviour):
        return earned.phases[behaviour][0]
    speed = {name: did(name).going_m_s[best].mean() / task.scores.length_m
             for name in ('forward', 'backward')}
    assert speed['forward'] > 0.15
    assert speed['backward'] < -0.15
    assert np.degrees(did('left').turning_rad_s[best].mean()) > 2.0
    assert np.degrees(did('right').turning_rad_s[best].mean()) < -2.0


def test_a_stance_under_something_that_is_no_behaviour_is_refused(tmp_path):
    path = tmp_path / 'recipe.yaml'
    path.write_text(OWN_ROBOT.read_text().replace('stance: [stop,', 'stance: [sleep,'))
    with pytest.raises(RecipeError, match=r'first\.stance: expected some of .*, got sleep'):
        load_recipe(path, body='physical_twin')
