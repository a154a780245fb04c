"""
The study's loop: give out what is not done yet, take back what is, show how far it is.

The runner holds the study's lock; workers hold each run's claim. It keeps nothing in memory that
the directories do not say, so it may be killed at any moment and started again.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field
from itertools import chain
from pathlib import Path
from typing import Any

from training.evolution.treatments import WORD_SETS
from training.evolution.vectors import vectors
from training.study.config import RunSpec, StudyConfig
from training.study.directory import StudyDirectory, StudyError
from training.study.executor import Executor
from training.study.fields import ConfigError
from training.study.lexicon import load_lexicon
from training.study.progress import Display, Running
from training.study.provenance import identity
from training.study.store import build_store
from training.study.tasks import Task, TaskResult, rescored, run_config


@dataclass
class Report:
    """
    What a call of `run_study` did: run names, and errors in one line each.

    `in_store` counts the finished runs in the store; None if it was not made, for want of space.
    """

    evolved: list[str] = field(default_factory=list)
    rescored: list[str] = field(default_factory=list)
    errors: list[str] = field(default_factory=list)
    in_store: int | None = None


def prepare(config: StudyConfig, study: StudyDirectory) -> dict[str, Any]:
    """
    Check that every run of `config` can be, and that `study` is its; return the identity.

    Raises
    ------
    ConfigError
        If a word is not in the vocabulary, or a run's configuration is refused.
    StudyError
        If the directory holds runs of another provenance.

    """
    try:
        for run in {(run.word_set, run.body, run.treatment): run for run in config.runs()}.values():
            run_config(config, run)
        for word_set in {run.word_set for run in config.runs()}:
            vectors(config.vocabulary, (word for word, _ in chain(*WORD_SETS[word_set])))
        if config.robustness.lexicon:
            vectors(config.vocabulary, chain.from_iterable(load_lexicon().values()))
        return identity(config)
    except (ValueError, OSError, LookupError) as error:
        raise ConfigError(' '.join(str(error).split())) from None


def tasks_of(config: StudyConfig, study: StudyDirectory, made: dict[str, Any],
             kind: str) -> list[Task]:
    """Return the tasks of a kind, `evolve` or `rescore`, that are not done yet."""
    tasks = []
    arms: Counter[tuple[str, str, str]] = Counter()
    most = config.robustness.pybullet_champions
    for run in config.runs():
        arm = (run.word_set, run.body, run.treatment)
        arms[arm] += 1
        task = Task(kind, str(study.path), config, made, run,  # type: ignore[arg-type]
                    in_pybullet=most is None or arms[arm] <= most)
        evolved = study.done(run, config.generations)
        if kind == 'evolve' and not evolved:
            tasks.append(task)
        if kind == 'rescore' and evolved and not rescored(task, study.run_directory(run.run_id)):
            tasks.append(task)
    return tasks


def run_study(config: StudyConfig, study: StudyDirectory, executor: Executor, display: Display,
              kinds: Sequence[str] = ('evolve', 'rescore')) -> Report:
    """
    Do all that is left of a study, then make its store.

    The caller holds the study's lock. Runs that fail do not stop the others: their errors are in
    the report.
    """
    made = prepare(config, study)
    study.runs.mkdir(parents=True, exist_ok=True)
    study.adopt(json.loads(json.dumps(asdict(config))), made)
    report = Report()
    for kind in kinds:
        tasks = tasks_of(config, study, made, kind)
        display.begin(kind, config, tasks, finished_seconds(study, config.runs()))
        if not _work(tasks, study, executor, display, report):
            return report
    report.in_store = build_store(study, history_points=config.history_points)
    return report


def _work(tasks: list[Task], study: StudyDirectory, executor: Executor, display: Display,
          report: Report) -> bool:
    """Perform `tasks`; return False if a fatal error ended it early."""
    waiting = list(reversed(tasks))
    inside: dict[str, Task] = {}
    fatal = False
    while inside or (waiting and not fatal):
        while waiting and not fatal and len(inside) < executor.capacity:
            task = waiting.pop()
            executor.submit(task)
            inside[task.run.run_id] = task
        for task, result in executor.finished(0.5):
            inside.pop(task.run.run_id)
            if not isinstance(result, TaskResult):
                result = TaskResult(f'{task.run.run_id}: {type(result).__name__}: {result}')
            fatal = fatal or result.fatal
            if result.error is not None:
                report.errors.append(result.error)
            else:
                (report.evolved if task.kind == 'evolve' else report.rescored).append(
                    task.run.run_id)
            display.finished(task, result)
        display.show(executor.workers, _running(study, inside.values()))
    return not fatal


def _running(study: StudyDirectory, tasks: Iterable[Task]) -> list[Running]:
    """Return how far the runs in workers' hands are, by the files that the workers leave."""
    running = []
    for task in tasks:
        path = study.run_directory(task.run.run_id) / 'progress.json'
        try:
            state = json.loads(path.read_text(encoding='utf-8'))
            running.append(Running(task, int(state['generation']), float(state['fitness'])))
        except (OSError, ValueError, KeyError, TypeError):
            running.append(Running(task, 0, None))
    return running


def finished_seconds(study: StudyDirectory, runs: Iterable[RunSpec]) -> dict[str, list[float]]:
    """Return arm -> wall seconds a generation of its finished runs: what an estimate rests on."""
    seconds: dict[str, list[float]] = {}
    for run in runs:
        try:
            summary = study.summary(run.run_id)
        except StudyError:
            continue
        if summary is not None:
            seconds.setdefault(arm(run), []).append(
                summary['seconds']['total'] / summary['generations'])
    return seconds


def arm(run: RunSpec) -> str:
    """Return what decides how long a run takes: its words and its body."""
    return f'{run.word_set}-{run.body}'


def default_directory(config: StudyConfig) -> Path:
    """Return where a study goes if no directory is given."""
    return Path('out') / 'studies' / config.name
