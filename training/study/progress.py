"""How far a study is, and when it will be over: live on a terminal, a line a minute elsewhere."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from statistics import mean
from typing import TYPE_CHECKING

from rich.console import Console, Group
from rich.live import Live
from rich.markup import escape
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from training.study.config import StudyConfig
    from training.study.tasks import Task, TaskResult

WORDS: dict[tuple[str, ...], str] = {
    ('evolve',): 'evolutionary runs',
    ('rescore',): 'champions scored again'}
BOTH = 'runs evolved and scored again'
#: Between two lines where the output is no terminal.
QUIET_S = 60.0


@dataclass(frozen=True)
class Running:
    """A task in a worker's hands; `generation` 0 and no fitness before it says more."""

    task: Task
    generation: int
    fitness: float | None


class Estimate:
    """
    Seconds that are left, from what is over: `costs` maps an arm to the seconds of each unit.

    The unit is a generation of a run, or a champion that is scored again. Units of one body and
    word set are taken to cost the same; an arm of which nothing is known yet, the others' mean.
    """

    def __init__(self, costs: dict[str, list[float]]) -> None:
        self.costs = {arm: list(values) for arm, values in costs.items()}

    def add(self, arm: str, seconds: float) -> None:
        """Take note of what a unit cost."""
        self.costs.setdefault(arm, []).append(seconds)

    def seconds(self, left: dict[str, float], workers: int) -> float | None:
        """Return the wall time for `left` (arm -> units), None if nothing is known yet."""
        known = {arm: mean(values) for arm, values in self.costs.items() if values}
        if not known or workers < 1:
            return None
        otherwise = mean(known.values())
        return sum(count * known.get(arm, otherwise) for arm, count in left.items()) / workers


class Display:
    """
    Shows a study's progress on `console`.

    Use as a context manager; `begin`, `finished` and `show` may be called without one, and then
    print nothing.
    """

    def __init__(self, console: Console | None = None) -> None:
        self.console = console or Console(stderr=True)
        self._live: Live | None = None
        self._said = float('-inf')
        self._what = BOTH
        self._total = 0
        self._open = False
        #: Run -> its tasks that are not over.
        self._tasks: dict[str, list[Task]] = {}
        self._began: dict[str, tuple[float, int]] = {}
        self._errors = 0
        self._evolution = Estimate({})
        self._rescoring = Estimate({})

    def __enter__(self) -> Display:
        self._open = True
        if self.console.is_terminal:
            self._live = Live(console=self.console, refresh_per_second=4, transient=True)
            self._live.start()
        return self

    def __exit__(self, *_exception: object) -> None:
        self._open = False
        if self._live is not None:
            self._live.stop()
            self._live = None

    def begin(self, kinds: Sequence[str], config: StudyConfig, tasks: Sequence[Task],
              costs: dict[str, list[float]]) -> None:
        """Start with `tasks`; `costs`: arm -> seconds a generation of the runs that are over."""
        self._what, self._total = WORDS.get(tuple(kinds), BOTH), len(config.runs())
        self._tasks = {}
        for task in tasks:
            self._tasks.setdefault(task.run.run_id, []).append(task)
        self._evolution, self._rescoring = Estimate(costs), Estimate({})
        self._began, self._said = {}, float('-inf')

    def finished(self, task: Task, result: TaskResult, *, last: bool = True) -> None:
        """Take note of a task that is over, `last` if no other of its run will follow."""
        if last:
            self._tasks.pop(task.run.run_id, None)
        else:
            self._tasks[task.run.run_id] = self._tasks[task.run.run_id][1:]
        if result.error is not None:
            self._errors += 1
            self.console.print(f'[red]failed:[/] {escape(result.error)}', highlight=False,
                               soft_wrap=True)
        elif result.seconds > 0:
            # A run that was taken up again counts from there: too low, but only once.
            if task.kind == 'evolve':
                self._evolution.add(_arm(task), result.seconds / task.config.generations)
            else:
                self._rescoring.add(_arm(task), result.seconds)

    def show(self, workers: int, running: Sequence[Running]) -> None:
        """Refresh what is shown."""
        if not self._open:
            return
        now = time.monotonic()
        left = self._seconds_left(now, workers, running)
        if self._live is not None:
            self._live.update(self._picture(workers, running, left))
        elif now - self._said >= QUIET_S:
            self._said = now
            self.console.print(self._line(workers, running, left), highlight=False, markup=False,
                               soft_wrap=True)

    def _seconds_left(self, now: float, workers: int, running: Sequence[Running]) -> float | None:
        left: dict[str, float] = {}
        champions: dict[str, float] = {}
        for task in (task for tasks in self._tasks.values() for task in tasks):
            counts, amount = ((left, task.config.generations) if task.kind == 'evolve'
                              else (champions, 1))
            counts[_arm(task)] = counts.get(_arm(task), 0.0) + amount
        early = Estimate(self._evolution.costs)
        for run in running:
            if run.task.kind != 'evolve' or not run.generation:
                continue
            left[_arm(run.task)] = left.get(_arm(run.task), 0.0) - run.generation
            since, first = self._began.setdefault(run.task.run.run_id, (now, run.generation))
            if run.generation > first and _arm(run.task) not in self._evolution.costs:
                early.add(_arm(run.task), (now - since) / (run.generation - first))
        evolution = early.seconds(left, workers)
        rescoring = self._rescoring.seconds(champions, workers)
        if left:
            # Scoring a champion again takes a small share of the time: unknown, it is left out.
            return None if evolution is None else evolution + (rescoring or 0.0)
        return rescoring

    def _line(self, workers: int, running: Sequence[Running], left: float | None) -> str:
        done = self._total - len(self._tasks)
        text = (f'{self._what}: {done} of {self._total} done, {workers} workers, '
                f'{_time_left(left)}')
        shown = ', '.join(f'{run.task.run.run_id} at {run.generation}' for run in running[:4]
                          if run.generation)
        return text + (f'; {shown}' if shown else '')

    def _picture(self, workers: int, running: Sequence[Running], left: float | None) -> Group:
        done = self._total - len(self._tasks)
        grid = Table.grid(padding=(0, 1))
        grid.add_row(Text(self._what, style='bold'),
                     ProgressBar(max(self._total, 1), done, width=40),
                     f'{done} of {self._total}',
                     Text(_time_left(left) + (f', {self._errors} failed' if self._errors else '')))
        for run in running[:max(workers, 4)]:
            total = run.task.config.generations
            grid.add_row(Text('  ' + run.task.run.run_id, style='dim'),
                         ProgressBar(total, run.generation, width=40),
                         f'{run.generation} of {total}' if run.task.kind == 'evolve' else '',
                         '' if run.fitness is None else f'fitness {run.fitness:.3f}')
        return Group(grid)


def _arm(task: Task) -> str:
    return f'{task.run.word_set}-{task.run.body}'


def _time_left(seconds: float | None) -> str:
    if seconds is None:
        return 'end not known yet'
    end = datetime.now() + timedelta(seconds=seconds)
    return f'{timedelta(seconds=round(seconds))} left, until about {end:%a %H:%M}'
