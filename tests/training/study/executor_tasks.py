"""Tasks that the tests of executors perform in workers; workers import this module by name."""

from __future__ import annotations

import os
import signal
from pathlib import Path

from tests.waiting import wait_until


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
    wait_until(path.exists, str(path), deadline_s)


def wait_for_attempt(folder: Path, name: str, deadline_s: float = 60.0) -> int:
    """Return the process that took a task up first, once one has."""
    return wait_until(lambda: attempts(folder, name), f'an attempt at {name}', deadline_s)[0]
