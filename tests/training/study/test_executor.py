"""Executors: tasks come back once each, whatever happens to the workers."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from tests.training.study.executor_tasks import attempts, perform, wait_for, wait_for_attempt
from tests.waiting import wait_until
from training.study.executor import (
    DaskExecutor,
    Executor,
    ExecutorError,
    LocalExecutor,
    WorkerLostError,
)

ROOT = Path(__file__).resolve().parents[3]


def until_done(executor: Executor, count: int, deadline_s: float = 90.0) -> dict[str, object]:
    """Return name -> result of `count` tasks."""
    end = time.monotonic() + deadline_s
    results: dict[str, object] = {}
    while len(results) < count:
        assert time.monotonic() < end, f'only {results} came back'
        for task, result in executor.finished(0.2):
            assert task[1] not in results, 'a task came back twice'
            results[task[1]] = result
    return results


def is_over(process: psutil.Process) -> bool:
    """Return whether a process is gone, or a zombie that nobody has reaped yet: not at work."""
    try:
        return not process.is_running() or process.status() == psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return True


@pytest.fixture
def local() -> Iterator[LocalExecutor]:
    executor = LocalExecutor(perform, 2)
    yield executor
    executor.close(cancel=True)


def test_local_tasks_come_back_once_each_though_workers_die(
        local: LocalExecutor, tmp_path: Path) -> None:
    folder = str(tmp_path)
    tasks = [(folder, 'a', 'work'), (folder, 'b', 'die once'), (folder, 'c', 'fail'),
             (folder, 'd', 'work')]
    for task in tasks:
        local.submit(task)
    results = until_done(local, len(tasks))
    assert results['a'] == 'a done'
    assert results['b'] == 'b done'
    assert results['d'] == 'd done'
    assert isinstance(results['c'], ValueError)
    assert len(attempts(folder, 'b')) >= 2
    assert list(local.finished(0.0)) == []


def test_local_gives_up_a_task_that_kills_its_workers(
        local: LocalExecutor, tmp_path: Path) -> None:
    local.submit((str(tmp_path), 'bad', 'die'))
    assert isinstance(until_done(local, 1)['bad'], WorkerLostError)
    assert len(attempts(tmp_path, 'bad')) == 3
    local.submit((str(tmp_path), 'good', 'work'))
    assert until_done(local, 1)['good'] == 'good done'


def test_local_workers_compute_on_one_thread(local: LocalExecutor) -> None:
    assert local.workers == local.capacity == 2
    assert os.environ['OMP_NUM_THREADS'] == '1'


def test_local_workers_end_when_their_parent_is_killed(tmp_path: Path) -> None:
    program = (
        'from tests.training.study.executor_tasks import perform\n'
        'from training.study.executor import LocalExecutor\n'
        'if __name__ == "__main__":\n'
        '    executor = LocalExecutor(perform, 1)\n'
        f'    executor.submit(({str(tmp_path)!r}, "long", "wait"))\n'
        '    executor.finished(600)\n')
    script = tmp_path / 'parent.py'
    script.write_text(program)
    parent = subprocess.Popen([sys.executable, str(script)], env={
        **os.environ, 'PYTHONPATH': os.pathsep.join([str(ROOT), *sys.path])})
    try:
        worker = psutil.Process(wait_for_attempt(tmp_path, 'long'))
    finally:
        parent.kill()
        parent.wait()
    wait_until(lambda: is_over(worker), "the end of its killed parent's worker", 30)


def test_no_scheduler_is_a_clear_error() -> None:
    with pytest.raises(ExecutorError, match='no Dask scheduler answers'):
        DaskExecutor(perform, 'tcp://127.0.0.1:9', timeout_s=1.0)


def test_a_missing_scheduler_file_is_a_clear_error_and_not_waited_for(tmp_path: Path) -> None:
    with pytest.raises(ExecutorError, match='no such file; `dask scheduler --scheduler-file'):
        DaskExecutor(perform, str(tmp_path / 'scheduler.json'))


def test_dask_finishes_every_task_though_a_worker_process_is_killed(tmp_path: Path) -> None:
    from distributed import LocalCluster

    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None,
                      silence_logs=50) as cluster:
        executor = DaskExecutor(perform, cluster.scheduler_address)
        assert executor.workers == 2
        names = ['first', 'second', 'third', 'fourth']
        for name in names:
            executor.submit((str(tmp_path), name, 'wait'))
        victim = wait_for_attempt(tmp_path, 'first')
        psutil.Process(victim).kill()
        (tmp_path / 'go').touch()
        results = until_done(executor, len(names))
        assert results == {name: f'{name} done' for name in names}
        assert victim not in attempts(tmp_path, 'first')[1:]
        assert len(attempts(tmp_path, 'first')) >= 2
        executor.close()


def test_a_scheduler_that_dies_is_a_clear_error(tmp_path: Path) -> None:
    started = subprocess.Popen(
        [sys.executable, '-m', 'distributed.cli.dask_scheduler', '--port', '0', '--no-dashboard',
         '--host', '127.0.0.1', '--scheduler-file', str(tmp_path / 'scheduler.json')],
        stderr=subprocess.DEVNULL)
    try:
        wait_for(tmp_path / 'scheduler.json')
        executor = DaskExecutor(perform, str(tmp_path / 'scheduler.json'))
        assert executor.workers == 0
        assert executor.capacity > 0
        executor.submit((str(tmp_path), 'a', 'work'))
        assert executor.finished(0.1) == []
    finally:
        started.kill()
        started.wait()
    with pytest.raises(ExecutorError, match='the Dask scheduler is gone'):
        until_done(executor, 1)
    executor.close(cancel=True)
