"""A study on a real Dask cluster of several processes, of which one is killed at its work."""

from __future__ import annotations

import subprocess
from pathlib import Path

import psutil

from tests.training.study_files import command, environment, run_inline, seeds, write
from tests.waiting import wait_until
from training.study.config import parse_config
from training.study.directory import StudyDirectory, completions, journal


def first_at_work(study: Path, process: subprocess.Popen[str], deadline_s: float = 120.0) -> int:
    """Return the process of the worker that began the first run."""
    def begun() -> list[int]:
        return [int(event['process']) for path in study.glob('runs/*/journal.jsonl')
                for event in journal(path)]

    wait_until(lambda: begun() or process.poll() is not None, 'a run that is begun', deadline_s)
    assert process.poll() is None, f'the study ended too early: {process.communicate()}'
    return begun()[0]


def test_every_run_completes_exactly_once_though_a_worker_is_killed(tmp_path: Path) -> None:
    from distributed import LocalCluster

    data = seeds(2, generations=200)
    file, study = write(tmp_path / 'study.yaml', data), tmp_path / 'study'
    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None,
                      silence_logs=50) as cluster:
        process = subprocess.Popen(
            command('study', file, '--out', study, '--scheduler', cluster.scheduler_address),
            env=environment(), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        try:
            victim = first_at_work(study, process)
            psutil.Process(victim).kill()
            output, errors = process.communicate(timeout=240)
        finally:
            process.kill()
            process.wait()
    assert process.returncode == 0, errors
    assert '4 of 4 runs' in output
    runs = parse_config(data).runs()
    assert completions(StudyDirectory(study), runs) == {run.run_id: 1 for run in runs}
    events = [event for run in runs
              for event in journal(study / 'runs' / run.run_id / 'journal.jsonl')]
    assert victim not in {event['process'] for event in events if event['event'] == 'completed'}
    assert sum(event['event'] == 'started' for event in events) > len(runs), (
        'the worker was killed too late to test anything')
    run_inline(data, tmp_path / 'alone')
    for run in runs:
        assert ((study / 'runs' / run.run_id / 'champion.json').read_bytes()
                == (tmp_path / 'alone' / 'runs' / run.run_id / 'champion.json').read_bytes())
