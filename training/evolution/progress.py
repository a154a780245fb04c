"""Progress bars: of a run (fitness, generations, evaluations a second), and of plain counting."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.progress import (
    Progress as Bar,
)

from training.evolution.run import Progress


@contextmanager
def progress_bar(generations: int, title: str) -> Iterator[Callable[[Progress], None]]:
    """Show a bar on standard error once a run moves; yields what to call with a Progress."""
    columns = (TextColumn('{task.description}'), BarColumn(), MofNCompleteColumn(),
               TextColumn('fitness {task.fields[fitness]:.3f}  {task.fields[rate]:,.0f} evals/s'),
               TimeElapsedColumn(), TimeRemainingColumn())
    bar = Bar(*columns, console=Console(stderr=True), refresh_per_second=4,
              speed_estimate_period=60.0)
    task = bar.add_task(title, total=generations, fitness=0.0, rate=0.0)
    shown = False

    def show(progress: Progress) -> None:
        nonlocal shown
        if not shown:
            bar.start()
            shown = True
        bar.update(task, completed=progress.generation, fitness=progress.best_fitness,
                   rate=progress.evaluations / max(progress.seconds, 1e-9))

    try:
        yield show
    finally:
        if shown:
            bar.stop()


@contextmanager
def counting(total: int, title: str) -> Iterator[Callable[[int], None]]:
    """Show a bar on standard error; yields what to call with how many more are done."""
    columns = (TextColumn('{task.description}'), BarColumn(), MofNCompleteColumn(),
               TimeElapsedColumn(), TimeRemainingColumn())
    with Bar(*columns, console=Console(stderr=True), refresh_per_second=4) as bar:
        task = bar.add_task(title, total=total)
        yield lambda done: bar.advance(task, done)
