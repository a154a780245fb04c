"""A user's own file adds one of each kind; evolution, judge and node take them."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.w2b_core.legs_controller import controller
from w2b_core.controller import file as controller_file

ROOT = Path(__file__).resolve().parents[1]
PLUGIN = """
from dataclasses import replace

from w2b_core.behaviours import BEHAVIOURS, Behaviour
from w2b_core.bodies import BODIES
from w2b_core.bodies.minimal import minimal
from training.evolution.afpo import Afpo
from training.evolution.optimisers import OPTIMISERS, Kind
from w2b_core.senses import SENSES, Sense
from w2b_sim.engines.registry import ENGINES, Engine


def small():
    return replace(minimal(), name='small_walker', description='a body of my own')


BODIES.add('small_walker', small)
BEHAVIOURS.add('aside', Behaviour(
    'go to the left of where the body faces', True, lambda motion: motion.away_m,
    lambda motion, bounds: motion.away_m >= bounds.move_m,
    lambda outcome: outcome.final_position_m[..., 1]))
SENSES.add('bottom_up', Sense(
    'bottom_up', 'imu/data', 'orientation', '', -1.0, 1.0, '', 'whether it lies on its back',
    lambda source, readings, reference: readings.gravity[2]))


class Drawn(Afpo):
    '''Random search: every genome is drawn anew, the best are kept.'''

    def __init__(self, *args, newcomers, **options):
        super().__init__(*args, newcomers=newcomers, **options, mutation=(
            lambda rng, genomes, layout: newcomers(rng, len(genomes), layout)))


def drawn(layout, rng, *, capacity, mutation, newcomers):
    return Drawn(layout, rng, capacity=capacity, newcomers=newcomers)


OPTIMISERS.add('drawn', Kind('random search', drawn))
ENGINES.add('twice', Engine(
    'twice', 'PyBullet by another name', 'w2b_sim.engines.pybullet_engine:PyBulletSimulation',
    'w2b_sim.engines.evaluators:pybullet', 'pybullet', 'pybullet'))
"""
SMALL = ('--words', 'forward=forward,aside=aside,stop=stop', '--engine', 'twice',
         '--population', '2', '--generations', '2', '--seed', '5')


def run(*arguments: str, **environment: str) -> 'subprocess.CompletedProcess[str]':
    return subprocess.run([sys.executable, '-m', *arguments], cwd=ROOT, text=True, timeout=200,
                          capture_output=True, check=False,
                          env={**os.environ, 'W2B_PLUGINS': '', **environment})


@pytest.fixture
def plugin(tmp_path):
    path = tmp_path / 'mine.py'
    path.write_text(PLUGIN)
    return path


def evolve(tmp_path: Path, *options: str, body: str = 'small_walker',
           words: tuple[str, ...] = SMALL,
           **environment: str) -> 'subprocess.CompletedProcess[str]':
    return run('training', 'evolve', '--body', body, '--out', str(tmp_path / 'run'), *words,
               *options, **environment)


@pytest.mark.parametrize('way', ['option', 'environment'])
def test_a_body_and_a_behaviour_of_a_users_own_are_evolved(tmp_path, plugin, way):
    done = (evolve(tmp_path, '--plugin', str(plugin)) if way == 'option'
            else evolve(tmp_path, W2B_PLUGINS=str(plugin)))
    assert done.returncode == 0, done.stderr
    champion = controller_file.load(tmp_path / 'run' / 'champion.json')
    assert champion.body == 'small_walker'
    assert {word.behaviour for word in champion.words} == {'forward', 'aside', 'stop'}
    summary = json.loads((tmp_path / 'run' / 'summary.json').read_text())
    aside = next(word for word in summary['outcomes'] if word['behaviour'] == 'aside')
    assert aside['score'] == pytest.approx(aside['final_position_m'][0][1])


def test_an_optimiser_of_a_users_own_evolves(tmp_path, plugin):
    done = evolve(tmp_path, '--plugin', str(plugin), '--optimiser', 'drawn')
    assert done.returncode == 0, done.stderr
    summary = json.loads((tmp_path / 'run' / 'summary.json').read_text())
    assert summary['config']['optimiser'] == 'drawn'
    assert summary['evaluations'] > 0
    refused = evolve(tmp_path / 'other', '--optimiser', 'drawn', words=SMALL[:2])
    assert refused.returncode == 2
    assert "invalid choice: 'drawn' (choose from" in refused.stderr
    assert not (tmp_path / 'other').exists()


def test_what_was_evolved_is_judged_in_the_engine_of_a_users_own(tmp_path, plugin):
    assert evolve(tmp_path, '--plugin', str(plugin)).returncode == 0
    judged = run('training', 'judge', str(tmp_path / 'run' / 'champion.json'), '--plugin',
                 str(plugin), '--engine', 'twice', '--starts', '1', '--seconds', '1', '--json')
    assert judged.returncode == 0, judged.stderr
    assert set(json.loads(judged.stdout)['behaviours']) == {'forward', 'aside', 'stop'}


def test_a_controller_with_a_sense_of_a_users_own_is_read_where_the_plugin_is(plugin):
    text = controller_file.dumps(controller()).replace('"yaw_rate"', '"bottom_up"')
    with pytest.raises(controller_file.JsonFileError, match="got 'bottom_up'"):
        controller_file.loads(text)
    done = subprocess.run(
        [sys.executable, '-c', 'import sys; from w2b_core.controller import file; '
         'print(file.loads(sys.stdin.read()).sensors)'], input=text, text=True, check=True,
        capture_output=True, env={**os.environ, 'W2B_PLUGINS': str(plugin)})
    assert 'bottom_up' in done.stdout


def test_its_robot_description_is_printed(plugin):
    done = subprocess.run(
        [sys.executable, '-c', 'from w2b_sim.print_urdf import main; raise SystemExit(main())',
         'small_walker', '--plugin', str(plugin)], capture_output=True, text=True, check=True)
    assert 'name="small_walker"' in done.stdout


BAD = {
    'nothing there': (None, 'FileNotFoundError: expected a Python file, got nothing there'),
    'does not import': ('import no_such_module_at_all', "No module named 'no_such_module_at_all'"),
    'not Python': ('body = (', 'SyntaxError'),
    'a name twice': (PLUGIN + "\nBODIES.add('quadruped', small)\n",
                     "body 'quadruped': expected a new name"),
    'no name': (PLUGIN + "\nBODIES.add('my body', small)\n", "got 'my body'"),
    'no optimiser': (PLUGIN.replace('return Drawn(layout, rng, ', 'return dict('),
                     "optimiser 'drawn': expected an object with generation"),
    'not modelled': (PLUGIN.replace("own')", "own', sensors=('smell:x',))"),
                     'small_walker: the batched engine does not model'),
}


@pytest.mark.parametrize('what', BAD)
def test_a_bad_plugin_is_one_line_and_nothing_is_written(tmp_path, what):
    text, reason = BAD[what]
    path = tmp_path / 'bad.py'
    if text is not None:
        path.write_text(text)
    words = tuple(part for part in SMALL if part not in ('--engine', 'twice'))
    asked = ('--optimiser', 'drawn') if what == 'no optimiser' else ()
    done = evolve(tmp_path, '--plugin', str(path), *asked, words=words)
    assert done.returncode == 2
    lines = done.stderr.strip().splitlines()
    assert len(lines) == 1, done.stderr
    assert str(path) in lines[0]
    assert reason in lines[0]
    assert not (tmp_path / 'run').exists()


def test_an_unknown_body_is_refused_with_those_there_are(tmp_path, plugin):
    done = evolve(tmp_path, '--plugin', str(plugin), body='smal_walker')
    assert done.returncode == 2
    assert 'small_walker' in done.stderr
    assert not (tmp_path / 'run').exists()
