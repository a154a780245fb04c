"""Searches: the same seed, the same champion, stopped, killed or not; seeds that are dropped."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml

from tests.waiting import wait_until
from training.evolution.checkpoint import CheckpointError
from training.legs.examine import reason_to_drop
from training.legs.first import first_genomes
from training.legs.parts import Drop
from training.legs.recipe import load_recipe
from training.legs.run import NoChampionError, _choose
from training.legs.search import HISTORY, Search
from training.legs.task import Task

ROOT = Path(__file__).resolve().parents[3]
QUADRUPED, TWIN = (ROOT / 'training' / 'recipes' / f'{name}.yaml'
                   for name in ('quadruped', 'twin'))
STAGES = [{'name': 'first', 'generations': 4, 'phases': [1], 'situations': 1, 'physics_steps': 1,
           'keep': 1},
          {'name': 'second', 'generations': 3, 'phases': [1, 1], 'sequences': 2, 'situations': 1,
           'physics_steps': 1, 'sigma': 0.1}]


@pytest.fixture(scope='module')
def small(tmp_path_factory):
    """A recipe that takes a second, and of whose seeds one gets a millimetre forwards."""
    content = {**yaml.safe_load(QUADRUPED.read_text(encoding='utf-8')), 'stages': STAGES,
               'population': 6, 'seeds': 2, 'examination': 2, 'first': {'tries': 4, 'seconds': 1.0},
               'drop': {'walk_below_body_lengths_s': 0.0, 'fastest_joint_above_hz': 50.0},
               'seed': 3, 'aims': {'fallen_up': -2.0}}
    path = tmp_path_factory.mktemp('recipe') / 'small.yaml'
    path.write_text(yaml.safe_dump(content), encoding='utf-8')
    return path


@pytest.fixture(scope='module')
def task(small):
    return Task(load_recipe(small))


def test_a_search_that_was_stopped_goes_on_as_if_it_had_not(task, tmp_path):
    whole = Search(task.recipe, 0, None, task)
    assert whole.run(1)
    looks = iter([False, False, True])
    stopped = Search(task.recipe, 0, tmp_path, task)
    assert not stopped.run(1, stop=lambda: next(looks))
    assert stopped.generation == 2
    resumed = Search(task.recipe, 0, tmp_path, task)
    before = task.evaluations
    assert resumed.run(1)
    np.testing.assert_array_equal(resumed.genome, whole.genome)
    assert task.evaluations - before < 7 * 6 * 12, 'what was earned is not walked again'
    other = Search(task.recipe, 1, None, task)
    other.run(1)
    assert not np.array_equal(other.genome, whole.genome)


def test_a_history_of_another_recipe_or_damaged_is_refused(task, small, tmp_path):
    Search(task.recipe, 0, tmp_path, task).run(0)
    with pytest.raises(CheckpointError, match='another recipe or seed'):
        Search(task.recipe, 1, tmp_path, task)
    (tmp_path / HISTORY).write_bytes(b'nothing')
    with pytest.raises(CheckpointError, match='delete it'):
        Search(task.recipe, 0, tmp_path, task)


def test_the_command_survives_kill_9_and_gives_the_same_champion(small, tmp_path):
    command = [sys.executable, '-m', 'training', 'legs', str(small), '--workers', '1', '--out']
    environment = {**os.environ, 'PYTHONPATH': str(ROOT)}
    whole = subprocess.run([*command, str(tmp_path / 'whole')], capture_output=True, text=True,
                           env=environment, cwd=ROOT, timeout=250)
    assert whole.returncode == 0, whole.stderr
    process = subprocess.Popen([*command, str(tmp_path / 'killed')], env=environment, cwd=ROOT,
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    history = tmp_path / 'killed' / 'seeds' / '0' / HISTORY
    wait_until(lambda: history.exists() or process.poll() is not None, 'a history', 200)
    assert process.poll() is None
    children = [int(pid) for pid in Path(
        f'/proc/{process.pid}/task/{process.pid}/children').read_text().split()]
    assert children
    process.send_signal(signal.SIGKILL)
    process.wait(30)
    wait_until(lambda: not any(Path(f'/proc/{pid}').exists() for pid in children),
               f'the end of {children}, which outlive the command,')
    resumed = subprocess.run([*command, str(tmp_path / 'killed')], capture_output=True, text=True,
                             env=environment, cwd=ROOT, timeout=250)
    assert resumed.returncode == 0, resumed.stderr
    with np.load(tmp_path / 'whole' / 'champion.npz') as one, np.load(
            tmp_path / 'killed' / 'champion.npz') as two:
        assert set(one.files) == set(two.files)
        for name in one.files:
            np.testing.assert_array_equal(one[name], two[name])
    text = (tmp_path / 'whole' / 'champion.json').read_text(encoding='utf-8')
    assert 'NaN' not in text, 'an engine that cannot say a torque leaves it out'
    record = json.loads(text)
    assert record['seed'] in (0, 1)
    assert 'fitness' in whole.stdout
    other = subprocess.run([*command, str(tmp_path / 'whole'), '--seed', '9'], env=environment,
                           capture_output=True, text=True, cwd=ROOT, timeout=100)
    assert other.returncode == 1
    assert 'holds another run' in other.stderr


FIGURES = {'body_lengths_per_s': 1.4, 'fastest_joint_hz': 1.8}


@pytest.mark.parametrize(('figures', 'reason'), [
    (FIGURES, None), ({**FIGURES, 'body_lengths_per_s': 0.1}, 'stands'),
    ({**FIGURES, 'fastest_joint_hz': 7.5}, 'vibrates')])
def test_seeds_that_stand_or_vibrate_are_dropped(figures, reason):
    why = reason_to_drop({'behaviours': {'forward': figures}}, load_recipe(TWIN), Drop())
    assert why is None if reason is None else reason in why


def test_the_best_go_on_and_the_reasons_of_the_others_are_kept(tmp_path):
    recipe = load_recipe(TWIN)
    reports = {seed: {'fitness': fitness, 'behaviours': {'forward': {
        **FIGURES, 'fastest_joint_hz': hz}}}
        for seed, fitness, hz in ((0, 0.9, 8.0), (1, 0.3, 1.5), (2, 0.5, 1.5), (3, 0.4, 1.5))}
    path = tmp_path / 'stage.json'
    kept = _choose(recipe, 0, reports, path, lambda line: None)
    assert kept == [2, 3][:recipe.stages[0].keep]
    dropped = json.loads(path.read_text(encoding='utf-8'))['dropped']
    assert 'vibrates' in dropped['0']
    assert 'best' in dropped['1']
    with pytest.raises(NoChampionError, match='seed 0 vibrates'):
        _choose(recipe, 0, {0: reports[0]}, tmp_path / 'none.json', lambda line: None)


def test_the_twins_first_genomes_have_its_oscillator_and_its_entries():
    recipe = load_recipe(TWIN)
    sharing = recipe.sharing()
    genomes = first_genomes(recipe, sharing, np.random.default_rng(0), 0.05)
    network = sharing.network(genomes)
    turn = network.hidden[:, :2, :2]
    np.testing.assert_allclose(np.sqrt(np.linalg.det(turn)), recipe.first.gain)
    assert (network.hidden[:, :2, 2:] == 0).all()
    assert (network.command[:, :2] == 0).all()
    swing = sharing.hidden.of(0, 0)
    stop = recipe.behaviours.index('stop')
    assert (network.command[:, swing, stop] == 2.5).all()
    spread = np.ptp(network.motor[:, 0, swing])
    assert 0.3 < spread < 0.6


def test_sequences_leave_out_mirror_images():
    task = Task(load_recipe(TWIN))
    names = [[task.recipe.behaviours[number] for number in words]
             for words in task.sequences(1)]
    assert names == [['stop'], ['forward'], ['left'], ['sit']]
    pairs = {tuple(words) for words in task.sequences(2).tolist()}
    assert len(pairs) == 14
    assert all(first != second for first, second in pairs)
