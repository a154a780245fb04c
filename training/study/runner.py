"""
The study's loop: give out what is not done yet, take back what is, show how far it is.

Work goes seed by seed, over all cells (word set, body, treatment), and each champion is scored
again right after its evolution: wherever a study is stopped, all cells have the same seeds but for
those in workers' hands. The runner holds the study's lock; workers hold each run's claim. It keeps
nothing in memory that the directories do not say, so it may be killed and started again.
"""

from __future__ import annotations

import json
from collections import Counter, deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, field
from itertools import chain
from pathlib import Path
from typing import Any

from training.configuration import ConfigError
from training.evolution.treatments import WORD_SETS
from training.evolution.vectors import vectors
from training.study.config import RunSpec, StudyConfig
from training.study.directory import StudyDirectory, StudyError
from training.study.executor import Executor
from training.study.lexicon import load_lexicon
from training.study.progress import Display, Running
from training.study.provenance import identity, run_identity
from training.study.store import build_store
from training.study.tasks import Task, TaskKind, TaskResult, rescored, run_config

#: What is done for a run, in order.
KINDS: tuple[TaskKind, TaskKind] = ('evolve', 'rescore')


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
             kinds: Sequence[str]) -> list[Task]:
    """
    Return the tasks of some `kinds` that are not done yet, in the order in which to do them.

    A run's rescoring follows its evolution; seeds follow each other.
    """
    tasks = []
    arms: Counter[tuple[str, str, str]] = Counter()
    most = config.robustness.pybullet_champions
    for run in config.runs():
        arm = (run.word_set, run.body, run.treatment)
        arms[arm] += 1
        evolve, rescore = (Task(kind, str(study.path), config, run_identity(made, run.body), run,
                                in_pybullet=most is None or arms[arm] <= most)
                           for kind in KINDS)
        evolved = study.done(run, config.generations)
        # A run that was killed between its summary and its journal's line lacks the line: whoever
        # holds its claim writes it, and evolves nothing.
        if 'evolve' in kinds and not (evolved and study.noted(run, config.generations)):
            tasks.append(evolve)
        if 'rescore' in kinds and (evolved or 'evolve' in kinds) and not (
                evolved and rescored(rescore, study.run_directory(run.run_id))):
            tasks.append(rescore)
    return tasks


def run_study(config: StudyConfig, study: StudyDirectory, executor: Executor, display: Display,
              kinds: Sequence[str] = KINDS,
              seed_done: Callable[[int], None] | None = None) -> Report:
    """
    Do all that is left of a study, then make its store.

    The caller holds the study's lock. Runs that fail do not stop the others: their errors are in
    the report. `seed_done` is called with the number of complete seeds each time one more is.
    """
    made = prepare(config, study)
    study.runs.mkdir(parents=True, exist_ok=True)
    study.adopt(json.loads(json.dumps(asdict(config))), made)
    report = Report()
    tasks = tasks_of(config, study, made, kinds)
    display.begin(kinds, config, tasks, finished_seconds(study, config.runs()))
    if _Work(tasks, study, executor, display, report, Seeds(config, tasks, seed_done)).finished():
        report.in_store = build_store(study, history_points=config.history_points)
    return report


class Seeds:
    """
    How many seeds are complete: every run of the study that has the seed is done.

    Parameters
    ----------
    config, tasks
        The study, and what is left of it.
    done
        Called with the number of complete seeds each time it grows.

    """

    def __init__(self, config: StudyConfig, tasks: Iterable[Task],
                 done: Callable[[int], None] | None = None) -> None:
        self._left = Counter(task.run.seed for task in tasks)
        self._done = done
        self.complete = len({run.seed for run in config.runs()} - set(self._left))

    def finished(self, task: Task) -> None:
        """Take note of a task that succeeded."""
        self._left[task.run.seed] -= 1
        if self._left[task.run.seed] == 0:
            self.complete += 1
            if self._done is not None:
                self._done(self.complete)


class _Work:
    """Tasks in an executor's hands, and those that wait for their turn."""

    def __init__(self, tasks: Sequence[Task], study: StudyDirectory, executor: Executor,
                 display: Display, report: Report, seeds: Seeds) -> None:
        self.study, self.executor, self.display = study, executor, display
        self.report, self.seeds = report, seeds
        #: Each run's tasks, in order: the second is given out when the first succeeded.
        self.waiting: deque[list[Task]] = deque()
        for task in tasks:
            if self.waiting and self.waiting[-1][0].run == task.run:
                self.waiting[-1].append(task)
            else:
                self.waiting.append([task])
        self.inside: dict[str, list[Task]] = {}

    def finished(self) -> bool:
        """Perform the tasks; return False if a fatal error ended it early."""
        fatal = False
        while self.inside or (self.waiting and not fatal):
            while self.waiting and not fatal and len(self.inside) < self.executor.capacity:
                tasks = self.waiting.popleft()
                self.inside[tasks[0].run.run_id] = tasks
                self.executor.submit(tasks[0])
            for task, result in self.executor.finished(0.5):
                if not isinstance(result, TaskResult):
                    result = TaskResult(f'{task.run.run_id}: {type(result).__name__}: {result}')
                fatal = fatal or result.fatal
                self._over(task, result)
            self.display.show(self.executor.workers, _running(
                self.study, (tasks[0] for tasks in self.inside.values())))
        return not fatal

    def _over(self, task: Task, result: TaskResult) -> None:
        _this, *rest = self.inside.pop(task.run.run_id)
        if result.error is not None:
            self.report.errors.append(result.error)
            rest = []
        else:
            (self.report.evolved if task.kind == 'evolve' else self.report.rescored).append(
                task.run.run_id)
            self.seeds.finished(task)
        if rest:
            # Before any other run: a stop leaves whole runs.
            self.waiting.appendleft(rest)
        self.display.finished(task, result, last=not rest)


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
