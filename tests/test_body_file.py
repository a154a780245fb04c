"""A maker's file wherever a body's name is taken: evolved, judged and resumed, as a user would."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.training.landscape import VECTORS, Landscape
from training.evolution import run as evolution
from training.evolution.config import RunConfig
from w2b_core import bodies
from w2b_core.bodies import description
from w2b_core.controller import file as controller_file

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture
def robot(tmp_path):
    """Return the YAML of a robot of one's own."""
    for name in ('dog8.urdf', 'dog8.yaml'):
        shutil.copy(ROOT / 'examples' / 'robots' / name, tmp_path)
    return tmp_path / 'dog8.yaml'


def run(*arguments: str) -> 'subprocess.CompletedProcess[str]':
    return subprocess.run([sys.executable, '-m', 'training', *arguments], cwd=ROOT, text=True,
                          timeout=280, capture_output=True, check=False,
                          env={**os.environ, 'W2B_PLUGINS': ''})


def evolve(robot: Path, generations: int) -> 'subprocess.CompletedProcess[str]':
    return run('evolve', '--body', str(robot), '--out', str(robot.parent / 'run'), '--words',
               'forward=forward,stop=stop', '--engine', 'pybullet', '--population', '2',
               '--generations', str(generations), '--checkpoint-generations', '1')


def test_a_run_carries_its_body_goes_on_and_refuses_one_that_changed(robot):
    done = evolve(robot, 1)
    assert done.returncode == 0, done.stderr
    directory, before = robot.parent / 'run', bodies.get(str(robot))
    assert bodies.get(str(directory / 'body.json')) == before
    assert json.loads((directory / 'config.json').read_text())['body_sha256'] == (
        description.sha256(before))
    # More generations go on; the champion is judged where the maker's files are not.
    done = evolve(robot, 2)
    assert done.returncode == 0, done.stderr
    champion = directory / 'champion.json'
    assert controller_file.load(champion).described() == before
    robot.write_text(robot.read_text().replace('weigh_kg: 0.25', 'weigh_kg: 0.3'))
    changed = bodies.get(str(robot))
    done = evolve(robot, 3)
    assert done.returncode == 2
    for body in (before, changed):
        assert description.sha256(body) in done.stderr
    options = (str(champion), '--starts', '1', '--seconds', '1', '--json')
    done = run('judge', *options, '--body', str(robot))
    assert done.returncode == 2
    for body in (before, changed):
        assert description.sha256(body)[:12] in done.stderr
    robot.unlink()
    done = run('judge', *options)
    assert done.returncode == 0, done.stderr
    assert set(json.loads(done.stdout)['behaviours']) == {'forward', 'stop'}


def test_a_file_that_is_edited_under_way_changes_nothing(robot):
    before = bodies.get(str(robot))
    config = RunConfig(body=str(robot), seed=1, words=(('forward', 'forward'), ('stop', 'stop')),
                       generations=2, population=2)

    def edit(progress):
        robot.write_text(robot.read_text().replace('weigh_kg: 0.25', 'weigh_kg: 0.3'))

    evolution.run(config, robot.parent / 'run', edit, vectors=VECTORS, evaluator=Landscape())
    assert bodies.get(str(robot)) != before
    assert controller_file.load(robot.parent / 'run' / 'champion.json').described() == before


def test_a_file_with_an_error_is_one_line_and_nothing_is_written(robot):
    robot.write_text(robot.read_text().replace('lf_shank', 'left_foot'))
    done = evolve(robot, 1)
    assert done.returncode == 2
    (line,) = done.stderr.strip().splitlines()
    assert line.startswith(f'evolve: body: {robot}: feet.front_left')
    assert "'left_foot' is no link" in line
    assert not (robot.parent / 'run').exists()
