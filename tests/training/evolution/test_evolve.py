"""The command, as a process: real engine, real kills."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from tests.waiting import wait_until
from training.__main__ import COMMANDS, main
from training.evolution.evolve import parse_words

ROOT = Path(__file__).resolve().parents[3]
#: Two words, so that PyBullet gets through a generation in a second.
SMALL = ['--body', 'minimal', '--words', 'forward=forward,stop=stop', '--held-out', 'halt=stop',
         '--engine', 'pybullet', '--population', '2', '--seed', '5']


def command(*options):
    packages = [str(ROOT / 'ros2_ws' / 'src' / name) for name in (
        'w2b_core', 'w2b_sim')]
    environment = {**os.environ, 'PYTHONPATH': os.pathsep.join([str(ROOT), *packages])}
    return subprocess.Popen(
        [sys.executable, '-m', 'training', *options], env=environment, text=True, cwd=ROOT,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE)


def finish(process, deadline_s=240):
    out, errors = process.communicate(timeout=deadline_s)
    return process.returncode, out, errors


@pytest.fixture(scope='module')
def unbroken(tmp_path_factory):
    directory = tmp_path_factory.mktemp('unbroken')
    code, out, errors = finish(command('evolve', *SMALL, '--generations', '5', '--out',
                                       str(directory)))
    assert code == 0, errors
    return directory, out, errors


def test_a_run_ends_with_a_table_and_a_controller_file(unbroken):
    directory, out, _errors = unbroken
    assert 'champion: fitness' in out
    assert 'halt' in out
    champion = json.loads((directory / 'champion.json').read_text())
    assert champion['body'] == 'minimal'
    assert champion['record']['engine'] == 'pybullet'
    with np.load(directory / 'statistics.npz') as statistics:
        best = statistics['best_fitness']
    assert len(best) == 5
    assert best[-1] > best[0], 'fitness rises'


def written_ns(path):
    return path.stat().st_mtime_ns if path.exists() else 0


def newer_or_over(path, before_ns, process):
    return written_ns(path) > before_ns or process.poll() is not None


def test_killed_runs_on_two_processes_end_in_the_same_champion(unbroken, tmp_path):
    """SIGKILL after the first checkpoint, twice; then to the end, with another process count."""
    options = ('evolve', *SMALL, '--generations', '5', '--out', str(tmp_path),
               '--checkpoint-generations', '1', '--threads')
    checkpoint = tmp_path / 'checkpoint.npz'
    done = []
    for _ in range(2):
        before = written_ns(checkpoint)
        process = command(*options, '2')
        wait_until(partial(newer_or_over, checkpoint, before, process), 'a checkpoint')
        assert process.poll() is None, process.communicate()[1]
        process.send_signal(signal.SIGKILL)
        assert finish(process)[0] == -signal.SIGKILL
        with np.load(checkpoint) as state:
            done.append(int(state['counters'][0]))
    assert 0 < done[0] <= done[1] < 5, 'killed under way'
    code, _out, errors = finish(command(*options, '1'))
    assert code == 0, errors
    assert (tmp_path / 'champion.json').read_bytes() == (
        unbroken[0] / 'champion.json').read_bytes()


@pytest.mark.parametrize(('options', 'message'), [
    (['--body', 'snake'], "body: expected one of quadruped, .* got 'snake'"),
    (['--words', 'forward'], "expected WORD=BEHAVIOUR,..., got 'forward'"),
    (['--words', 'forward=fly'], "got 'fly'"),
    (['--words', 'forward=forward', '--word-set', 'paper'], 'exclude each other'),
    (['--held-out', 'halt=stop'], '--held-out needs --words'),
    (['--generations', '0'], 'generations: expected an integer >= 1, got 0'),
    (['--threads', '0'], 'threads: expected at least 1, got 0'),
    (['--checkpoint-seconds', '0'], '--checkpoint-seconds: expected a number above 0, got 0'),
    (['--checkpoint-seconds', 'nan'], '--checkpoint-seconds: expected a number above 0, got nan'),
    (['--checkpoint-generations', '0'], '--checkpoint-generations: expected an integer >= 1'),
    (['--seed', '-1'], 'seed: expected an integer >= 0, got -1'),
    (['--generations', '1000000000000'], 'does not fit into memory'),
    (['--engine', 'pybullet', '--precision', 'float64'], 'always computes in double'),
    (['--words', 'fforward=forward,stop=stop'], 'fforward'),
    (['--vocabulary', '/nowhere.bin'], '/nowhere.bin'),
])
def test_bad_options_are_one_line_errors(options, message, tmp_path, capsys):
    code = main(['evolve', '--out', str(tmp_path / 'run'), *options])
    errors = capsys.readouterr().err
    assert code == 2
    assert errors.startswith('evolve: ')
    assert errors.count('\n') == 1
    assert re.search(message, errors), errors


@pytest.mark.skipif(os.geteuid() != 0, reason='only root can mount a small file system')
def test_a_full_disk_is_said_in_one_line_and_loses_nothing(tmp_path, capsys):
    disk = tmp_path / 'disk'
    disk.mkdir()
    if subprocess.run(['mount', '-t', 'tmpfs', '-o', 'size=32k', 'tmpfs', disk], check=False,
                      capture_output=True).returncode:
        pytest.skip('no small file system can be mounted here')
    options = ['evolve', '--body', 'spherical_1dof_blind', '--generations', '60', '--population',
               '20', '--checkpoint-generations', '5']
    try:
        assert main([*options, '--out', str(disk / 'run')]) == 2
        last = capsys.readouterr().err.splitlines()[-1]
        assert f'{disk / "run"}: cannot be written or read (No space left on device)' in last
        assert 'give the same command again' in last
        subprocess.run(['mount', '-o', 'remount,size=4m', disk], check=True)
        assert main([*options, '--out', str(disk / 'run')]) == 0
        champion = (disk / 'run' / 'champion.json').read_bytes()
    finally:
        subprocess.run(['umount', '--lazy', disk], check=True)
    assert main([*options, '--out', str(tmp_path / 'whole')]) == 0
    assert champion == (tmp_path / 'whole' / 'champion.json').read_bytes()


def test_contradicting_options_are_refused(unbroken, capsys):
    code = main(['evolve', *SMALL, '--generations', '5', '--out', str(unbroken[0]),
                 '--objective', 'paper'])
    assert code == 2
    assert "objective: it has 'program', asked 'paper'" in capsys.readouterr().err


def test_word_lists():
    assert parse_words('go=forward, back = backward') == (('go', 'forward'), ('back', 'backward'))
    for bad in ('', 'go', 'go=', '=forward', 'go=forward,,'):
        with pytest.raises(ValueError, match='expected WORD=BEHAVIOUR'):
            parse_words(bad)


def test_help_lists_every_command(capsys):
    with pytest.raises(SystemExit) as leaving:
        main(['--help'])
    assert leaving.value.code == 0
    out = capsys.readouterr().out
    for name in COMMANDS:
        assert name in out


def test_the_first_run_says_that_it_compiles_and_a_resumed_one_where_it_goes_on(
        tmp_path, monkeypatch, capsys):
    """In a process of its own: code is compiled once in a process."""
    monkeypatch.setenv('W2B_CACHE_DIR', str(tmp_path / 'cache'))
    options = ('evolve', '--body', 'spherical_1dof_blind', '--words', 'forward=forward,stop=stop',
               '--population', '4', '--out', str(tmp_path / 'run'), '--generations')
    began = time.monotonic()
    code, out, errors = finish(command(*options, '3'))
    took = time.monotonic() - began
    assert code == 0, errors
    first, *_rest, last = errors.splitlines()
    assert first.startswith('evolve: compiling the batched engine once')
    assert last.startswith('spherical_1dof_blind seed 0: generation 3 of 3, ')
    assert 'goes on' not in errors
    stated = float(re.search(r'evaluations in ([0-9.]+) s', ' '.join(out.split())).group(1))
    assert stated < took / 4, 'the time to compile is not in it'
    assert main([*options, '5']) == 0
    assert 'evolve: goes on from generation 3 of 5\n' in capsys.readouterr().err


def test_a_missing_module_is_said_with_what_helps(monkeypatch, capsys):
    monkeypatch.setattr('importlib.import_module', missing)
    assert main(['evolve', '--out', 'nowhere']) == 2
    errors = capsys.readouterr().err
    assert errors.count('\n') == 1
    assert 'the module w2b_core is missing' in errors
    assert 'in a checkout run `make setup` and `. .venv/bin/activate` first' in errors


def missing(_module):
    raise ModuleNotFoundError(name='w2b_core')
