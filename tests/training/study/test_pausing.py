"""A study that pauses: workers stop between generations, lose nothing, and go on."""

from __future__ import annotations

import subprocess
import threading
import time
from pathlib import Path

import pytest

from tests.training.study_files import (
    command,
    environment,
    main_command,
    plain,
    run_inline,
    seeds,
    write,
)
from tests.waiting import wait_until
from training.study import pausing
from training.study.commands.status import projection
from training.study.config import parse_config
from training.study.directory import StudyDirectory, in_use, locked
from training.study.provenance import utc_now


def cpu_s(process: subprocess.Popen[bytes]) -> float:
    import psutil

    family = [psutil.Process(process.pid), *psutil.Process(process.pid).children(recursive=True)]
    return sum(sum(one.cpu_times()[:2]) for one in family)


def test_a_study_pauses_and_goes_on_to_the_same_champions(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data = seeds(1, generations=1200)
    file, study = write(tmp_path / 'study.yaml', data), tmp_path / 'study'
    process = subprocess.Popen(command('study', file, '--out', study, '--workers', '2'),
                               env=environment(), stdout=subprocess.DEVNULL,
                               stderr=subprocess.DEVNULL)
    try:
        wait_until(lambda: len(list(study.glob('runs/*/progress.json'))) == 2
                   or process.poll() is not None, 'two runs under way')
        assert process.poll() is None
        assert main_command('study', 'pause', study) == 0
        assert 'paused' in capsys.readouterr().out
        assert len(list(study.glob('runs/*/waiting'))) == 2
        assert pausing.at_work(study) == []
        assert main_command('study', 'status', study) == 0
        assert 'runs, paused' in capsys.readouterr().out
        before, began = cpu_s(process), time.monotonic()
        wait_until(lambda: time.monotonic() - began > 2, 'two seconds')
        assert cpu_s(process) - before < 0.5, 'a paused study leaves the processors alone'
        assert not list(study.glob('runs/*/summary.json'))
        assert main_command('study', 'resume', study) == 0
        assert process.wait(240) == 0
    finally:
        process.kill()
        process.wait()
    run_inline(data, tmp_path / 'never_paused')
    for path in study.glob('runs/*/champion.json'):
        other = tmp_path / 'never_paused' / path.relative_to(study)
        assert path.read_bytes() == other.read_bytes()


def test_a_study_that_is_paused_before_it_starts_waits(tmp_path: Path) -> None:
    tmp_path.joinpath('runs').mkdir()
    pausing.pause(tmp_path, utc_now())
    done = threading.Event()

    def work() -> None:
        run_inline(plain(), tmp_path)
        done.set()

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    wait_until(lambda: bool(list(tmp_path.glob('runs/*/waiting'))), 'a worker at the switch')
    assert not done.is_set()
    assert not list(tmp_path.glob('runs/*/checkpoint.npz'))
    assert pausing.resume(tmp_path)
    assert done.wait(120)
    assert len(list(tmp_path.glob('runs/*/summary.json'))) == 2
    assert not list(tmp_path.glob('runs/*/waiting'))


def test_a_worker_that_does_not_stop_is_named(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run_inline(plain(), tmp_path)
    busy = sorted((tmp_path / 'runs').iterdir())[0]
    with locked(busy / 'claim', 'run'):
        assert main_command('study', 'pause', tmp_path, '--wait', '0.3') == 1
    error = capsys.readouterr().err
    assert busy.name in error
    assert error.count('\n') == 1
    assert main_command('study', 'resume', tmp_path) == 0
    assert main_command('study', 'resume', tmp_path) == 0
    assert 'was not paused' in capsys.readouterr().out


def test_a_wait_left_behind_by_a_killed_worker_is_cleared(tmp_path: Path) -> None:
    (tmp_path / pausing.WAITING).touch()
    pausing.Pause(tmp_path, tmp_path)
    assert not (tmp_path / pausing.WAITING).exists()


def test_looking_changes_nothing(tmp_path: Path) -> None:
    with locked(tmp_path / 'lock', 'it'):
        assert in_use(tmp_path / 'lock')
    assert not in_use(tmp_path / 'lock')
    assert not in_use(tmp_path / 'none')


@pytest.mark.parametrize('name', ['pause', 'resume', 'status'])
def test_where_there_is_no_study_commands_say_so(
        tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str) -> None:
    assert main_command('study', name, tmp_path) == 2
    assert 'no study here' in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_the_end_is_projected_from_the_last_runs(tmp_path: Path) -> None:
    import os

    study = StudyDirectory(tmp_path)
    runs = parse_config(seeds(10)).runs()
    for index, run in enumerate(runs[:5]):
        path = study.run_directory(run.run_id) / 'summary.json'
        path.parent.mkdir(parents=True)
        path.touch()
        os.utime(path, (1000.0 + 60 * index,) * 2)
    # Four runs in 240 s to the fifth's end and 60 s since then: 48 an hour, 15 are left.
    text = projection(study, runs, runs[:5], now=1300.0)
    assert 'rate of the last 5 runs: 48.0 an hour' in text
    assert '1970-01-01 00:40 UTC' in text
    assert 'not known' in projection(study, runs, runs[:1], now=1300.0)
