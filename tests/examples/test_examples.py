"""The examples run as their texts say, at reduced size, from another directory."""

import ast
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from w2b_core.controller import file as controller_file
from w2b_sim.talk import RefusedError, talk

EXAMPLES = Path(__file__).resolve().parents[2] / 'examples'


def run(folder, name, *arguments):
    done = subprocess.run([sys.executable, EXAMPLES / name, *arguments], cwd=folder, text=True,
                          capture_output=True, timeout=280, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def test_say_words(tmp_path):
    said = run(tmp_path, 'say_words.py', '--seconds', '1', 'forward', 'halt')
    assert said[0].startswith('forward: ')
    assert said[1].startswith('halt: ')
    assert "following 'stop'" in said[1], 'never heard in training'
    assert said[2].startswith('joint angles: 41 frames x 12 joints')
    assert (tmp_path / 'walk.png').read_bytes().startswith(b'\x89PNG')


def test_evolve_minimal(tmp_path):
    said = run(tmp_path, 'evolve_minimal.py', '--generations', '2', '--population', '2',
               '--engine', 'pybullet', '--out', 'small')
    assert said[0].startswith('fitness ')
    assert [line.partition(':')[0] for line in said[1:5]] == [
        'forward', 'backward', 'stop', 'halt']
    champion = controller_file.load(tmp_path / 'small' / 'champion.json')
    assert champion.body == 'minimal'


@pytest.mark.parametrize('path', sorted(EXAMPLES.glob('*.py')), ids=lambda path: path.name)
def test_each_example_is_its_own_manual_and_is_run_here(path):
    text = ast.get_docstring(ast.parse(path.read_text()))
    assert text is not None
    for part in ('Install:', 'Usage:', 'Output:', 'Run time:'):
        assert part in text
    assert f"'{path.name}'" in Path(__file__).read_text()


def test_a_talk_is_the_same_walk_each_time_and_each_phase_goes_on_where_the_last_ended():
    once, again = (talk('quadruped', ['forward', 'stop'], seconds=1) for _ in range(2))
    np.testing.assert_array_equal(once.recording.position_m, again.recording.position_m)
    np.testing.assert_array_equal(once.path_m(0)[-1], once.path_m(1)[0])
    assert once.path_m(0).shape == (21, 2)


def test_a_text_that_is_refused_moves_nothing():
    with pytest.raises(RefusedError, match=r"unknown word 'forwrad'.*did you mean 'forward'"):
        talk('quadruped', ['forward', 'forwrad'], seconds=1)


def test_no_time_is_refused():
    with pytest.raises(ValueError, match=r'talk: expected texts and at least 0\.1 s for each'):
        talk('quadruped', ['forward'], seconds=0.01)


@pytest.mark.parametrize('notebook', sorted(EXAMPLES.glob('*.ipynb')), ids=lambda path: path.stem)
def test_notebooks_run_from_top_to_bottom(notebook, tmp_path, monkeypatch):
    nbformat = pytest.importorskip('nbformat', reason='notebooks: requirements/dev.txt')
    nbclient = pytest.importorskip('nbclient', reason='notebooks: requirements/dev.txt')
    monkeypatch.setenv('IPYTHONDIR', str(tmp_path))
    found = nbformat.read(notebook, as_version=4)
    assert not any(cell.get('outputs') for cell in found.cells), 'committed without outputs'
    nbclient.NotebookClient(found, timeout=250,
                            resources={'metadata': {'path': str(tmp_path)}}).execute()
    assert any(cell.get('outputs') for cell in found.cells)
