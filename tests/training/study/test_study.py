"""The study command on the real engine: killed, repeated, extended, refused, short of space."""

from __future__ import annotations

import json
import os
import resource
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from tests.training.study_files import (
    Inline,
    command,
    environment,
    main_command,
    plain,
    run_command,
    run_inline,
    seeds,
    write,
)
from tests.waiting import wait_until
from training.configuration import ConfigError
from training.study.config import parse_config
from training.study.directory import (
    StudyDirectory,
    StudyError,
    append_line,
    completions,
    journal,
    locked,
)
from training.study.progress import Display
from training.study.runner import run_study
from training.study.tasks import TaskResult


def champions(study: Path) -> dict[str, bytes]:
    return {path.parent.name: path.read_bytes() for path in study.glob('runs/*/champion.json')}


def stamps(study: Path) -> dict[str, int]:
    return {path.parent.name: path.stat().st_mtime_ns
            for path in study.glob('runs/*/summary.json')}


@pytest.fixture(scope='module')
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished study of two runs."""
    study = tmp_path_factory.mktemp('done') / 'study'
    report = run_inline(plain(), study)
    assert (len(report.evolved), len(report.rescored), report.in_store) == (2, 2, 2)
    assert report.errors == []
    return study


def test_every_run_says_where_it_comes_from(done: Path) -> None:
    paths = list(done.glob('runs/*/provenance.json'))
    assert len(paths) == 2
    for path in paths:
        value = json.loads(path.read_text())
        assert value['identity']['engine'] == 'batched'
        assert len(value['identity']['results_sha256']) == 64
        assert len(value['identity']['vocabulary_sha256']) == 64
        assert value['environment']['packages']['numpy']


def test_more_seeds_run_only_the_new_ones_and_other_settings_are_refused(done: Path) -> None:
    before = stamps(done)
    again = run_inline(plain(), done)
    assert (again.evolved, again.rescored, again.in_store) == ([], [], 2)
    more = run_inline(seeds(2), done)
    assert sorted(more.evolved) == ['paper-quadruped-control-0001',
                                    'paper-quadruped-experimental-0001']
    assert more.in_store == 4
    after = stamps(done)
    assert {name: after[name] for name in before} == before
    with pytest.raises(StudyError, match='population is 8 there, 9 here'):
        run_inline(seeds(2, population=9), done)
    assert stamps(done) == after


def test_more_generations_take_the_same_runs_further(tmp_path: Path) -> None:
    run_inline(plain(), tmp_path / 'grown')
    grown = run_inline(plain(generations=9), tmp_path / 'grown')
    assert (len(grown.evolved), len(grown.rescored), grown.in_store) == (2, 2, 2)
    run_inline(plain(generations=9), tmp_path / 'at_once')

    def networks(study: Path) -> dict[str, object]:
        return {name: json.loads(content)['network'] for name, content in champions(study).items()}

    assert networks(tmp_path / 'grown') == networks(tmp_path / 'at_once')
    with pytest.raises(StudyError, match='generations is 9 there, 6 here'):
        run_inline(plain(), tmp_path / 'grown')


def test_work_goes_seed_by_seed_and_each_champion_is_scored_at_once(tmp_path: Path) -> None:
    executor = Inline()
    with locked(tmp_path / '.lock', 'study'):
        complete: list[int] = []
        run_study(parse_config(seeds(3, generations=2, robustness={
            'perturbed_starts': 1, 'pybullet_starts': 0, 'lexicon': False})),
            StudyDirectory(tmp_path), executor, Display(), seed_done=complete.append)
    assert executor.performed == [
        (kind, f'paper-quadruped-{treatment}-{seed:04d}') for seed in range(3)
        for treatment in ('experimental', 'control') for kind in ('evolve', 'rescore')]
    assert complete == [1, 2, 3]


def test_a_stop_leaves_complete_seeds_of_all_cells(tmp_path: Path) -> None:
    """Two workers: of the runs that are done, none is of a later seed but for what is at hand."""
    experiment = {**plain()['experiments'][0], 'bodies': ['quadruped', 'spherical_1dof_blind'],
                  'seeds': 4}
    data = plain(generations=2, experiments=[experiment], robustness={
        'perturbed_starts': 1, 'pybullet_starts': 0, 'lexicon': False})
    runs = [run.run_id for run in parse_config(data).runs()]

    class TwoWorkers(Inline):
        workers = capacity = 2

        def finished(self, timeout_s: float) -> list[tuple[Any, TaskResult]]:
            over = super().finished(timeout_s)
            done = [run for run in runs if ('rescore', run) in self.performed]
            begun = {run for _kind, run in self.performed}
            assert begun <= set(runs[:len(done) + 2]), 'seeds first'
            return over

    with locked(tmp_path / '.lock', 'study'):
        report = run_study(parse_config(data), StudyDirectory(tmp_path), TwoWorkers(), Display())
    assert len(report.rescored) == len(runs) == 16


def test_a_worker_with_other_results_is_refused(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr('training.study.tasks.results_sha256', lambda *_arguments: 'f' * 64)
    report = run_inline(plain(), tmp_path)
    assert report.evolved == []
    assert all('returns other results for quadruped (ffffffffffff)' in error
               for error in report.errors)
    assert len(report.errors) == 2
    assert not list(tmp_path.glob('runs/*/checkpoint.npz'))


def test_bodies_can_be_added_to_a_study(tmp_path: Path) -> None:
    run_inline(plain(), tmp_path)
    experiment = {**plain()['experiments'][0], 'bodies': ['spherical_1dof_blind']}
    assert run_inline(plain(experiments=[experiment]), tmp_path).in_store == 4
    results = StudyDirectory(tmp_path).about()['identity']['results_sha256']
    assert set(results) == {'quadruped', 'spherical_1dof_blind'}
    assert run_inline(plain(), tmp_path).evolved == []


@pytest.mark.parametrize('what', ['results_sha256', 'vocabulary_sha256', 'objective'])
def test_a_run_of_another_program_or_vocabulary_is_refused(done: Path, what: str) -> None:
    path = sorted(done.glob('runs/*/provenance.json'))[0]
    kept = path.read_bytes()
    value = json.loads(kept)
    value['identity'][what] = 'other'
    path.write_text(json.dumps(value))
    try:
        with pytest.raises(StudyError, match=f"{what} is 'other' there"):
            run_inline(plain(), done)
    finally:
        path.write_bytes(kept)


def test_a_second_runner_is_refused(
        done: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = write(tmp_path / 'tiny.yaml', plain())
    with locked(done / '.lock', 'study'):
        assert main_command('study', file, '--out', done) == 2
    error = capsys.readouterr().err
    assert f'process {os.getpid()}' in error
    assert 'is working in it' in error
    assert error.count('\n') == 1


def _there_or_over(study: Path, name: str, process: subprocess.Popen[bytes]) -> bool:
    return bool(list(study.glob(f'runs/*/{name}'))) or process.poll() is not None


def test_killed_and_started_again_nothing_is_lost_or_done_twice(tmp_path: Path) -> None:
    data = seeds(2, generations=60)
    run_inline(data, tmp_path / 'whole')
    file, study = write(tmp_path / 'study.yaml', data), tmp_path / 'study'
    for awaited in ('journal.jsonl', 'summary.json'):
        process = subprocess.Popen(command('study', file, '--out', study, '--workers', '2'),
                                   env=environment(), stdout=subprocess.DEVNULL,
                                   stderr=subprocess.DEVNULL)
        try:
            wait_until(partial(_there_or_over, study, awaited, process), awaited)
        finally:
            process.kill()
            process.wait()
    last = run_command('study', file, '--out', study, '--workers', '2')
    assert last.returncode == 0, last.stderr
    assert '4 of 4 runs' in last.stdout
    assert champions(study) == champions(tmp_path / 'whole')
    runs = parse_config(data).runs()
    assert completions(StudyDirectory(study), runs) == {run.run_id: 1 for run in runs}
    started = [sum(event['event'] == 'started' for event in journal(path))
               for path in study.glob('runs/*/journal.jsonl')]
    assert max(started) > 1, 'the kills came too late to test anything'


def test_a_run_killed_before_its_journals_last_line_gets_it_from_the_next_start(
        tmp_path: Path) -> None:
    run_inline(plain(), tmp_path)
    [unsaid, _other] = sorted(tmp_path.glob('runs/*/journal.jsonl'))
    started, _completed = unsaid.read_text().splitlines(keepends=True)
    unsaid.write_text(started + '{"event": "comple')
    before = stamps(tmp_path), champions(tmp_path)
    again = run_inline(plain(), tmp_path)
    assert (again.errors, again.in_store) == ([], 2)
    runs = parse_config(plain()).runs()
    assert completions(StudyDirectory(tmp_path), runs) == {run.run_id: 1 for run in runs}
    assert [event['event'] for event in journal(unsaid)] == ['started', 'completed']
    assert (stamps(tmp_path), champions(tmp_path)) == before, 'nothing is evolved again'
    assert run_inline(plain(), tmp_path).evolved == []


def test_damaged_lines_of_a_journal_are_passed_over(tmp_path: Path) -> None:
    path = tmp_path / 'journal.jsonl'
    append_line(path, 'started')
    with path.open('ab') as file:
        file.write(b'[]\n3\n\xff\xfe\n{"event": "comple')
    append_line(path, 'completed')
    assert [event['event'] for event in journal(path)] == ['started', 'completed']
    assert journal(tmp_path / 'none') == []


def test_a_damaged_checkpoint_fails_that_run_only(tmp_path: Path) -> None:
    run_inline(plain(), tmp_path)
    bad = sorted((tmp_path / 'runs').iterdir())[0]
    (bad / 'summary.json').unlink()
    (bad / 'checkpoint.npz').write_bytes(b'not a checkpoint')
    report = run_inline(plain(), tmp_path)
    assert report.in_store == 1
    [error] = report.errors
    assert f'{bad / "checkpoint.npz"}: not a readable checkpoint' in error
    assert '\n' not in error
    (bad / 'checkpoint.npz').unlink()
    assert run_inline(plain(), tmp_path).in_store == 2


def test_a_damaged_summary_is_named_not_passed_over(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run_inline(plain(), tmp_path / 'study')
    file = write(tmp_path / 'study.yaml', plain())
    bad = sorted(tmp_path.glob('study/runs/*/summary.json'))[0]
    bad.write_text(bad.read_text()[:40])
    for arguments in (('study', file, '--out', tmp_path / 'study'),
                      ('report', tmp_path / 'study')):
        assert main_command(*arguments) == 2
        error = capsys.readouterr().err
        assert f'{bad}: damaged' in error
        assert error.count('\n') == 1


def _no_large_files() -> None:
    resource.setrlimit(resource.RLIMIT_FSIZE, (3000, 3000))


def test_no_space_stops_the_study_and_loses_nothing(tmp_path: Path) -> None:
    file, study = write(tmp_path / 'study.yaml', plain()), tmp_path / 'study'
    ended = run_command('study', file, '--out', study, '--workers', '1',
                        preexec_fn=_no_large_files)
    assert ended.returncode == 1
    assert 'no space left to write' in ended.stderr
    assert 'Traceback' not in ended.stderr
    assert not list(study.glob('runs/*/summary.json'))
    assert not list(study.glob('runs/*/.checkpoint*')), 'nothing half-written stays'
    assert run_inline(plain(), study).in_store == 2


@contextmanager
def small_disk(folder: Path, kilobytes: int) -> Iterator[Path]:
    folder.mkdir()
    mounted = subprocess.run(['mount', '-t', 'tmpfs', '-o', f'size={kilobytes}k', 'tmpfs', folder],
                             capture_output=True, check=False)
    if mounted.returncode:
        pytest.skip('a small file system can be mounted by root only')
    try:
        yield folder
    finally:
        subprocess.run(['umount', '--lazy', folder], check=True)


@pytest.mark.skipif(os.geteuid() != 0, reason='only root can mount a small file system')
def test_a_full_disk_stops_the_study_and_loses_nothing(tmp_path: Path) -> None:
    with small_disk(tmp_path / 'disk', 88) as disk:
        full = run_inline(plain(), disk / 'study')
        assert any('No space left on device' in error for error in full.errors)
        assert full.in_store is None
        for path in disk.glob('study/runs/*/*.json'):
            json.loads(path.read_text())
        subprocess.run(['mount', '-o', 'remount,size=64m', disk], check=True)
        again = run_inline(plain(), disk / 'study')
        assert (again.errors, again.in_store) == ([], 2)


@pytest.mark.parametrize(('arguments', 'data', 'message'), [
    (['--workers', '2', '--scheduler', 'tcp://127.0.0.1:9'], {}, 'contradict each other'),
    (['--workers', '0'], {}, '--workers: expected at least 1'),
    ([], {'vocabulary': '/nowhere/words.bin'}, '/nowhere/words.bin'),
    ([], {'experiments': [{'words': 'paper', 'bodies': ['snake'], 'treatments': ['control'],
                           'seeds': 1}]}, 'expected one of quadruped'),
])
def test_what_cannot_be_is_refused_in_one_line(
        tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str],
        data: dict[str, object], message: str) -> None:
    file = write(tmp_path / 'study.yaml', plain(**data))
    assert main_command('study', file, '--out', tmp_path / 'study', *arguments) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count('\n') == 1
    assert not list((tmp_path / 'study').glob('runs/*')), 'nothing was begun'


def test_a_study_ends_with_the_next_command_and_pybullet_is_silent(tmp_path: Path) -> None:
    file = write(tmp_path / 'tiny.yaml', plain(
        robustness={'perturbed_starts': 1, 'pybullet_starts': 1, 'lexicon': False}))
    study = tmp_path / 'my study'
    evolved = run_command('study', file, '--out', study, '--workers', '1', '--evolve-only')
    assert evolved.stdout.splitlines()[-1] == (
        f"next: python -m training robustness {file} --out '{study}'")
    whole = run_command('study', file, '--out', study, '--workers', '1')
    assert whole.returncode == 0, whole.stderr
    assert whole.stdout.splitlines()[-1] == f"next: python -m training report '{study}'"
    assert 'build time' not in whole.stdout + whole.stderr


def test_a_place_that_is_no_directory_is_refused(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = write(tmp_path / 'study.yaml', plain())
    assert main_command('study', file, '--out', file) == 2
    error = capsys.readouterr().err
    assert 'expected a directory for the study' in error
    assert 'choose another --out' in error


def test_a_word_outside_the_vocabulary_is_refused(tmp_path: Path) -> None:
    words = tmp_path / 'words.txt'
    rows = [f'{word} 1 2 3' for word in ('forward', 'backward', 'stop', 'cease', 'suspend')]
    words.write_text('\n'.join([f'{len(rows)} 3', *rows]) + '\n')
    with pytest.raises(ConfigError, match='halt'):
        run_inline(plain(vocabulary=str(words), robustness={'lexicon': False}), tmp_path / 'study')
    assert not list((tmp_path / 'study').glob('runs/*'))
