"""Tasks that the tests of executors perform in workers; workers import this module by name."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path


def perform(task: tuple[str, str, str]) -> str:
    """Do `task`: (folder, name, what to do); every attempt leaves a line in the folder."""
    folder, name, action = task
    with open(Path(folder) / f'{name}.attempts', 'a') as file:
        file.write(f'{os.getpid()}\n')
    if action == 'die':
        os.kill(os.getpid(), signal.SIGKILL)
    if action == 'die once' and len(attempts(folder, name)) == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    if action == 'fail':
        raise ValueError(f'{name} cannot be done')
    if action == 'wait':
        wait_for(Path(folder) / 'go')
    return f'{name} done'


def attempts(folder: str | Path, name: str) -> list[int]:
    """Return the processes that took up a task."""
    path = Path(folder) / f'{name}.attempts'
    return [int(line) for line in path.read_text().split()] if path.exists() else []


def wait_for(path: Path, deadline_s: float = 60.0) -> None:
    """Return when `path` exists."""
    end = time.monotonic() + deadline_s
    while not path.exists():
        assert time.monotonic() < end, f'{path} never came'
        time.sleep(0.02)


def wait_for_attempt(folder: Path, name: str, deadline_s: float = 60.0) -> int:
    """Return the process that took a task up first, once one has."""
    end = time.monotonic() + deadline_s
    while not attempts(folder, name):
        assert time.monotonic() < end, f'nobody took up {name}'
        time.sleep(0.02)
    return attempts(folder, name)[0]
