"""Ear and legs put together as a controller file that the brain can read."""

import json
from pathlib import Path

import numpy as np
import pytest

from training.legs.assemble import AssemblyError, assemble, load_legs, main
from training.legs.recipe import load_recipe
from w2b_core import bodies
from w2b_core.behaviours import DEFAULT_BEHAVIOURS
from w2b_core.controller import file as controller_file
from w2b_core.hearing.ear import Ear
from w2b_core.network.leaky import BLOCKS

ROOT = Path(__file__).resolve().parents[3]
RECIPE = load_recipe(ROOT / 'training' / 'recipes' / 'twin.yaml')


@pytest.fixture(scope='module')
def ear(tmp_path_factory):
    from training.__main__ import main as training

    path = tmp_path_factory.mktemp('ear') / 'ear.json'
    assert training(['ear', '--out', str(path)]) == 0
    return path


@pytest.fixture
def legs(tmp_path):
    sharing = RECIPE.sharing()
    network = sharing.network(np.random.default_rng(0).normal(scale=0.3, size=sharing.size))
    np.savez(tmp_path / 'champion.npz', genome=np.zeros(sharing.size),
             **{block.name: getattr(network, block.name) for block in BLOCKS})
    record = {'body': RECIPE.body, 'behaviours': list(RECIPE.behaviours),
              'senses': list(RECIPE.senses), 'recipe': 'twin', 'seed': 3}
    (tmp_path / 'champion.json').write_text(json.dumps(record), encoding='utf-8')
    return tmp_path


def arguments(legs, ear, out):
    from argparse import Namespace

    return Namespace(legs=legs, ear=ear, out=out)


def test_the_file_holds_the_network_to_the_bit_with_senses_and_record(legs, ear, tmp_path):
    out = tmp_path / 'twin.json'
    assert main(arguments(legs, ear, out)) == 0
    controller = controller_file.load(out)
    network, _record = load_legs(legs)
    for block in BLOCKS:
        np.testing.assert_array_equal(getattr(controller.network, block.name),
                                      getattr(network, block.name))
    assert controller.body == 'physical_twin'
    assert controller.behaviours == DEFAULT_BEHAVIOURS
    assert controller.sensors == RECIPE.senses
    assert controller.record['legs']['seed'] == 3
    assert [motor.joint for motor in controller.motors] == [
        joint.name for joint in bodies.get('physical_twin').joints]
    assert out.stat().st_size < 200_000


def test_an_ear_for_other_behaviours_is_refused(legs, ear):
    record = json.loads((legs / 'champion.json').read_text(encoding='utf-8'))
    (legs / 'champion.json').write_text(json.dumps({**record, 'behaviours': ['stop', 'forward']}),
                                        encoding='utf-8')
    with pytest.raises(AssemblyError, match='--behaviours'):
        assemble(legs, Ear.from_json(json.loads(ear.read_text(encoding='utf-8'))))


def test_legs_that_are_not_finished_are_refused_with_what_to_do(tmp_path, ear, capsys):
    assert main(arguments(tmp_path, ear, tmp_path / 'twin.json')) == 1
    assert 'python -m training legs' in capsys.readouterr().err
    assert not (tmp_path / 'twin.json').exists()
