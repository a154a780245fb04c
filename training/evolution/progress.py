"""
Progress: of a run (fitness, generations, evaluations a second), and of plain counting.

On a terminal a bar; elsewhere (`nohup`, a batch system, `> log`) a plain line from time to time.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import timedelta
from time import monotonic

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    ProgressColumn,
    TextColumn,
    TimeRemainingColumn,
)
from rich.progress import (
    Progress as Bar,
)
from rich.table import Column

from training.evolution.loop import Progress

#: Between two lines where the output is no terminal.
QUIET_S = 10.0


@contextmanager
def progress_bar(generations: int, title: str) -> Iterator[Callable[[Progress], None]]:
    """Show on standard error how far a run is; yields what to call with a Progress."""
    console = Console(stderr=True)
    with (_bar_of_run(generations, title, console) if console.is_interactive
          else _lines_of_run(generations, title)) as show:
        yield show


@contextmanager
def counting(total: int, title: str) -> Iterator[Callable[[int], None]]:
    """Show progress on standard error; yields what to call with how many more are done."""
    console = Console(stderr=True)
    with (_bar_of_count(total, title, console) if console.is_interactive
          else _lines_of_count(total, title)) as advance:
        yield advance


def _columns(*texts: str) -> tuple[ProgressColumn, ...]:
    """Return the columns of a bar; the bar itself is what shrinks on a narrow terminal."""
    return (TextColumn('{task.description}'), BarColumn(),
            MofNCompleteColumn(table_column=Column(no_wrap=True)), *map(TextColumn, texts),
            TimeRemainingColumn(elapsed_when_finished=True, table_column=Column(no_wrap=True)))


@contextmanager
def _bar_of_run(generations: int, title: str, console: Console
                ) -> Iterator[Callable[[Progress], None]]:
    columns = _columns('fitness {task.fields[fitness]:.3f}', '{task.fields[rate]:,.0f} ev/s')
    bar = Bar(*columns, console=console, refresh_per_second=4, speed_estimate_period=60.0)
    task = bar.add_task(title, total=generations, fitness=0.0, rate=0.0)
    shown = False

    def show(progress: Progress) -> None:
        nonlocal shown
        if not shown:
            bar.start()
            shown = True
        bar.update(task, completed=progress.generation, fitness=progress.best_fitness,
                   rate=_rate(progress))

    try:
        yield show
    finally:
        if shown:
            bar.stop()


@contextmanager
def _bar_of_count(total: int, title: str, console: Console) -> Iterator[Callable[[int], None]]:
    with Bar(*_columns(), console=console, refresh_per_second=4) as bar:
        task = bar.add_task(title, total=total)
        yield lambda done: bar.advance(task, done)


@contextmanager
def _lines_of_run(generations: int, title: str) -> Iterator[Callable[[Progress], None]]:
    before: int | None = None

    def show(progress: Progress) -> None:
        nonlocal before
        if before is None:
            before = progress.generation - 1
        say(f'{title}: generation {progress.generation} of {generations}, '
            f'fitness {progress.best_fitness:.3f}, {_rate(progress):,.0f} evaluations/s, '
            + _left(progress.seconds, progress.generation - before,
                    generations - progress.generation))

    with _lines() as say:
        yield show


@contextmanager
def _lines_of_count(total: int, title: str) -> Iterator[Callable[[int], None]]:
    began, done = monotonic(), 0

    def advance(more: int) -> None:
        nonlocal done
        done += more
        say(f'{title}: {done} of {total}, {_left(monotonic() - began, done, total - done)}')

    with _lines() as say:
        yield advance


@contextmanager
def _lines() -> Iterator[Callable[[str], None]]:
    """Yield what prints a line at most every `QUIET_S`; the last line is printed at the end."""
    said, kept = monotonic(), ''

    def say(text: str) -> None:
        nonlocal said, kept
        kept = text
        if monotonic() - said >= QUIET_S:
            print(kept, file=sys.stderr, flush=True)
            said, kept = monotonic(), ''

    try:
        yield say
    finally:
        if kept:
            print(kept, file=sys.stderr, flush=True)


def _rate(progress: Progress) -> float:
    return progress.evaluations / max(progress.seconds, 1e-9)


def _left(seconds: float, done: int, todo: int) -> str:
    """Return the time that is left in words, from what was done in `seconds`."""
    return f'{timedelta(seconds=round(seconds * todo / max(done, 1)))} left'
