"""Small studies on the real engine, for the tests of the runner, the store and the report."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import yaml

from training.__main__ import main
from training.study.config import StudyConfig, parse_config
from training.study.directory import StudyDirectory, locked
from training.study.progress import Display
from training.study.runner import Report, run_study
from training.study.tasks import TaskResult, perform

ROOT = Path(__file__).resolve().parents[2]


def plain(**changes: Any) -> dict[str, Any]:
    """Return a study of two short runs, as YAML would give it."""
    return {
        'name': 'tiny', 'generations': 6, 'population': 8, 'history_points': 4,
        'experiments': [{'words': 'paper', 'bodies': ['quadruped'],
                         'treatments': ['experimental', 'control'], 'seeds': 1}],
        'robustness': {'perturbed_starts': 2, 'pybullet_starts': 0}, **changes}


def seeds(count: int, **changes: Any) -> dict[str, Any]:
    """Return a study of `count` seeds, two runs each."""
    experiment = plain()['experiments'][0]
    return plain(experiments=[{**experiment, 'seeds': count}], **changes)


def config(**changes: Any) -> StudyConfig:
    """Return the checked study of `plain`."""
    return parse_config(plain(**changes))


def write(path: Path, data: dict[str, Any]) -> Path:
    """Write a configuration file."""
    path.write_text(yaml.safe_dump(data), encoding='utf-8')
    return path


class Inline:
    """An executor that performs tasks in this process, one when asked: no time for spawning."""

    workers = 1
    capacity = 1

    def __init__(self) -> None:
        self.tasks: list[Any] = []
        self.performed: list[tuple[str, str]] = []

    def submit(self, task: Any) -> None:
        """Take a task."""
        self.tasks.append(task)

    def finished(self, _timeout_s: float) -> list[tuple[Any, TaskResult]]:
        """Perform what was taken."""
        over = [(task, perform(task)) for task in self.tasks]
        self.performed += [(task.kind, task.run.run_id) for task in self.tasks]
        self.tasks.clear()
        return over

    def close(self, *, cancel: bool = False) -> None:
        """Nothing to let go of."""


def run_inline(data: dict[str, Any], directory: Path) -> Report:
    """Do all that is left of a study in this process."""
    directory.mkdir(parents=True, exist_ok=True)
    with locked(directory / '.lock', str(directory)):
        return run_study(parse_config(data), StudyDirectory(directory), Inline(), Display())


def main_command(*arguments: str | Path) -> int:
    """Return the exit code of `python -m training ...`, in this process."""
    return main([str(argument) for argument in arguments])


def environment() -> dict[str, str]:
    """Return the environment in which `python -m training` finds this program."""
    return {**os.environ, 'PYTHONPATH': os.pathsep.join([str(ROOT), *filter(None, sys.path)])}


def command(*arguments: str | Path) -> list[str]:
    """Return the command line of `python -m training ...`."""
    return [sys.executable, '-m', 'training', *map(str, arguments)]


def run_command(*arguments: str | Path, **options: Any) -> subprocess.CompletedProcess[str]:
    """Run `python -m training ...` to its end."""
    return subprocess.run(command(*arguments), env=environment(), capture_output=True, text=True,
                          timeout=240, check=False, **options)
