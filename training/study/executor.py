"""
Where tasks are performed: in local processes, or on the workers of a Dask cluster.

An executor takes tasks (any picklable object and a top-level function) and hands back what came of
them as they finish. A worker process that dies is replaced and its task given out again; a task on
which workers keep dying is given up with an error, so that one bad task cannot hold up a study.
What a task did before its worker died is the task's own business: see `tasks`.
"""

from __future__ import annotations

import logging
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.connection import wait as wait_for_any
from typing import Any, Protocol

#: A task whose worker died this often is given up.
DEATHS = 3
#: Read by the numerical libraries when they are imported: a worker computes on one thread.
ONE_THREAD = ('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS', 'MKL_NUM_THREADS', 'NUMBA_NUM_THREADS')

Perform = Callable[[Any], Any]


class ExecutorError(Exception):
    """The executor cannot work; one line that says why and what to do."""


class WorkerLostError(Exception):
    """Workers kept dying on one task."""


class Executor(Protocol):
    """Performs tasks elsewhere."""

    @property
    def workers(self) -> int:
        """How many tasks are performed at once, now."""

    @property
    def capacity(self) -> int:
        """How many tasks should be in its hands, so that no worker waits."""

    def submit(self, task: Any) -> None:
        """Take a task."""

    def finished(self, timeout_s: float) -> Iterable[tuple[Any, Any]]:
        """
        Return (task, result) of tasks that are over, waiting for the first up to `timeout_s`.

        The result is an exception if performing the task raised one.
        """

    def close(self, *, cancel: bool = False) -> None:
        """Let go of the workers; with `cancel`, at once."""


class LocalExecutor:
    """
    Spawned processes of this machine, one thread each.

    Parameters
    ----------
    perform
        Called with each task in a worker.
    workers
        Processes; default: one a core that this process may use.

    """

    def __init__(self, perform: Perform, workers: int | None = None) -> None:
        self._perform = perform
        self.workers = workers or len(os.sched_getaffinity(0))
        self._tasks: dict[Future[Any], Any] = {}
        self._deaths: dict[int, int] = {}
        self._pool = self._start()

    def _start(self) -> ProcessPoolExecutor:
        for name in ONE_THREAD:
            os.environ.setdefault(name, '1')
        return ProcessPoolExecutor(self.workers, multiprocessing.get_context('spawn'),
                                   initializer=_start_worker)

    @property
    def capacity(self) -> int:
        """One task a worker: whoever was at work when a worker died is then known."""
        return self.workers

    def submit(self, task: Any) -> None:
        """Take a task."""
        try:
            future = self._pool.submit(self._perform, task)
        except BrokenProcessPool:
            self._restart()
            future = self._pool.submit(self._perform, task)
        self._tasks[future] = task

    def _restart(self) -> None:
        self._pool.shutdown(wait=False, cancel_futures=True)
        self._pool = self._start()

    def finished(self, timeout_s: float) -> list[tuple[Any, Any]]:
        """Return (task, result or exception) of tasks that are over."""
        done, _ = wait(self._tasks, timeout=timeout_s, return_when=FIRST_COMPLETED)
        over: list[tuple[Any, Any]] = []
        again: list[Any] = []
        for future in done:
            task = self._tasks.pop(future)
            error = future.exception()
            if not isinstance(error, BrokenProcessPool):
                self._deaths.pop(id(task), None)
                over.append((task, error if error is not None else future.result()))
                continue
            deaths = self._deaths[id(task)] = self._deaths.get(id(task), 0) + 1
            if deaths >= DEATHS:
                over.append((task, WorkerLostError(
                    f'its worker process died {deaths} times (killed, or out of memory?)')))
            else:
                again.append(task)
        if again:
            # The pool breaks as a whole: the rest of its tasks come back by their own futures.
            self._restart()
            for task in again:
                self.submit(task)
        return over

    def close(self, *, cancel: bool = False) -> None:
        """Let go of the workers; with `cancel`, at once (they are safe to kill)."""
        processes = list((self._pool._processes or {}).values())
        self._pool.shutdown(wait=not cancel, cancel_futures=True)
        if cancel:
            for process in processes:
                process.terminate()


def _start_worker() -> None:
    """Leave Ctrl-C to the parent, and end this worker when the parent is gone, even by SIGKILL."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is None:
        return

    def watch() -> None:
        wait_for_any([parent.sentinel])
        os._exit(1)

    threading.Thread(target=watch, daemon=True, name='parent watch').start()


class DaskExecutor:
    """
    The workers of a running Dask cluster, which must see the study's directory and this program.

    Parameters
    ----------
    perform
        Called with each task in a worker.
    address
        The scheduler's, such as `tcp://10.0.0.1:8786`, or a scheduler file's path.

    """

    def __init__(self, perform: Perform, address: str, *, timeout_s: float = 20.0) -> None:
        from distributed import Client

        # Its traces of a lost connection would bury the one line that says what to do.
        logging.getLogger('distributed').setLevel(logging.CRITICAL)
        where = {'scheduler_file': address} if address.endswith('.json') else {'address': address}
        if 'scheduler_file' in where and not os.path.isfile(address):
            # Dask would wait for the file, for ever and without a word.
            raise ExecutorError(f'--scheduler {address}: no such file; `dask scheduler '
                                f'--scheduler-file {address}` writes it when it is up')
        try:
            self._client = Client(**where, timeout=timeout_s)
        except (OSError, ValueError, TimeoutError) as error:
            raise ExecutorError(
                f'--scheduler {address}: no Dask scheduler answers there ({error}); start one with '
                '`dask scheduler` and give the address that it prints') from None
        self._perform = perform
        self._tasks: dict[Any, Any] = {}

    @property
    def workers(self) -> int:
        """Threads of all workers that are there now."""
        return sum(self._client.nthreads().values())

    @property
    def capacity(self) -> int:
        """Twice the workers: one to do and one at hand; a few while none has come yet."""
        return max(2 * self.workers, 4)

    def submit(self, task: Any) -> None:
        """Take a task; Dask gives it to another worker if its worker is lost."""
        # Not pure: a task's result is files, which a cached answer would not make again.
        future = self._client.submit(self._perform, task, pure=False)
        self._tasks[future] = task

    def finished(self, timeout_s: float) -> list[tuple[Any, Any]]:
        """Return (task, result or exception) of tasks that are over."""
        import distributed
        from distributed.client import FuturesCancelledError

        if not self._tasks:
            return []
        try:
            done = distributed.wait(list(self._tasks), timeout=timeout_s,
                                    return_when='FIRST_COMPLETED').done
        except TimeoutError:
            return []
        except FuturesCancelledError:
            raise ExecutorError('the Dask scheduler is gone; start one and give the same command '
                                'again: what is done stays done') from None
        over = []
        for future in done:
            task = self._tasks.pop(future)
            error = future.exception() if future.status != 'finished' else None
            if isinstance(error, distributed.scheduler.KilledWorker):
                error = WorkerLostError('its worker was lost too often (killed, or out of memory?)')
            over.append((task, error if error is not None else future.result()))
        return over

    def close(self, *, cancel: bool = False) -> None:
        """Let go of the cluster; with `cancel`, take back what has not begun."""
        if cancel:
            self._client.cancel(list(self._tasks))
        self._client.close()
