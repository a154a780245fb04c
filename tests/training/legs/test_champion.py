"""From a robot's file to a controller that carries its body and walks, at reduced size."""

import json
import shutil
from pathlib import Path

import pytest
import yaml

from training.__main__ import main
from training.legs import gate
from w2b_core.controller import file as controller_file
from w2b_sim.talk import talk

ROOT = Path(__file__).resolve().parents[3]
ROBOTS = ROOT / 'examples' / 'robots'
#: Two generations: the first genomes, of the body's kinematics, do the walking.
STAGE = {'name': 'single', 'generations': 2, 'phases': [4], 'situations': 2, 'physics_steps': 10}


@pytest.fixture(scope='module')
def made(tmp_path_factory):
    """Return the folder, the command and its exit code for a sprawler."""
    folder = tmp_path_factory.mktemp('champion')
    for suffix in ('urdf', 'yaml'):
        shutil.copy(ROBOTS / f'spider12.{suffix}', folder)
    recipe = yaml.safe_load((ROOT / 'training' / 'recipes' / 'own_robot.yaml').read_text())
    recipe = {**recipe, 'stages': [STAGE], 'population': 8, 'examination': 4,
              'drop': {'walk_below_body_lengths_s': 0.05}}
    (folder / 'recipe.yaml').write_text(yaml.safe_dump(recipe))
    command = ['champions', str(folder / 'recipe.yaml'), '--body', str(folder / 'spider12.yaml'),
               '--out', str(folder / 'out'), '--seeds', '0-0', '--starts', '1']
    return folder, command, main(command)


def test_the_controller_carries_its_body_and_walks_in_both_engines(made):
    folder, _command, code = made
    assert code == 0
    for suffix in ('urdf', 'yaml'):
        (folder / f'spider12.{suffix}').unlink()
    path = folder / 'out' / 'champion.json'
    assert controller_file.load(path).carried is not None
    for engine in ('pybullet', 'mujoco'):
        walk = talk(str(path), ['march'], seconds=4, engine=engine)
        assert walk.outcome(0).along_m > 0.11, engine
    kept = json.loads((folder / 'out' / 'gate.json').read_text())
    assert kept['refused'] == []
    assert (folder / 'out' / 'champion.md').read_text().strip() == gate.table(kept['judged'])


def test_what_an_engine_does_not_see_is_said_and_does_not_ship(made, capsys, monkeypatch):
    folder, command, _code = made
    for suffix in ('urdf', 'yaml'):
        shutil.copy(ROBOTS / f'spider12.{suffix}', folder)
    judged = json.loads((folder / 'out' / 'gate.json').read_text())['judged']
    judged['mujoco']['forward']['body_lengths_per_s'] = 0.01
    monkeypatch.setattr(gate, 'seen', lambda *_args, **_options: judged)
    (folder / 'out' / 'gate.json').unlink()
    assert main(command) == 1
    said = capsys.readouterr().out
    assert 'refused: mujoco: forward at 0.01 body lengths/s, evolved' in said
    assert 'does not ship' in said
    assert not (folder / 'out' / 'champion.json').exists()
    assert not (folder / 'out' / 'champion.md').exists()
