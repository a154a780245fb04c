"""
How far a study is: `python -m training study status DIR`.

Complete seeds, runs of each cell, runs under way, and whether it runs or is paused. The rate is
that of the last runs to finish, whatever else the machine did meanwhile; the end follows from it.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path

from rich.console import Console
from rich.table import Table

from training.configuration import ConfigError
from training.study import pausing
from training.study.config import RunSpec, parse_config
from training.study.directory import StudyDirectory, StudyError, in_use

#: The rate is taken over so many runs, and the time since the first of them.
LAST_RUNS = 28


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument('study', type=Path, metavar='DIR', help='a study')


def main(args: argparse.Namespace) -> int:
    """Run the command; return the exit code: 0, or 2 for an error."""
    study = StudyDirectory(args.study)
    try:
        about = study.about()
        config = parse_config(about['config'])
        runs = config.runs()
        done = [run for run in runs if study.done(run, config.generations)]
    except (StudyError, ConfigError, OSError) as error:
        print(f'study status: {" ".join(str(error).split())}', file=sys.stderr)
        return 2
    again = {run.run_id for run in done
             if (study.run_directory(run.run_id) / 'rescored.json').exists()}
    _print(Console(), study, runs, done, again)
    return 0


def _print(console: Console, study: StudyDirectory, runs: Sequence[RunSpec],
           done: Sequence[RunSpec], again: set[str]) -> None:
    state = 'is not running'
    if in_use(study.path / '.lock'):
        state = 'runs'
    if pausing.is_paused(study.path):
        state += ', paused'
    unfinished = {run.seed for run in runs if run.run_id not in again}
    seeds = {run.seed for run in runs}
    table = Table('words', 'body', 'treatment', 'evolved', 'scored again')
    arms = [(run.word_set, run.body, run.treatment) for run in runs]
    totals, evolved, scored = (Counter(arms), Counter(
        (run.word_set, run.body, run.treatment) for run in done), Counter(
        (run.word_set, run.body, run.treatment) for run in done if run.run_id in again))
    for arm in dict.fromkeys(arms):
        table.add_row(*arm, f'{evolved[arm]} of {totals[arm]}', str(scored[arm]))
    console.print(table)
    console.print(f'{study.path} {state}: {len(done)} of {len(runs)} runs evolved, {len(again)} '
                  f'champions scored again; {len(seeds - unfinished)} of {len(seeds)} seeds '
                  'complete', highlight=False, soft_wrap=True)
    for directory in pausing.held(study.path):
        console.print(f'under way: {directory.name}{_generation(directory)}', highlight=False)
    console.print(projection(study, runs, done), highlight=False, soft_wrap=True)


def _generation(directory: Path) -> str:
    try:
        return f', {(directory / "progress.json").read_text(encoding="utf-8")}'
    except OSError:
        return ''


def projection(study: StudyDirectory, runs: Sequence[RunSpec], done: Sequence[RunSpec],
               now: float | None = None) -> str:
    """Return the rate of the last runs and when the study is over at that rate, in a sentence."""
    if len(done) == len(runs):
        return 'all runs are evolved'
    now = datetime.now(UTC).timestamp() if now is None else now
    ends = sorted((study.run_directory(run.run_id) / 'summary.json').stat().st_mtime
                  for run in done)[-LAST_RUNS:]
    if len(ends) < 2:
        return 'rate: not known before two runs are over'
    rate = (len(ends) - 1) / max(now - ends[0], 1e-9)
    end = datetime.fromtimestamp(now, UTC) + timedelta(seconds=(len(runs) - len(done)) / rate)
    return (f'rate of the last {len(ends)} runs: {rate * 3600:.1f} an hour; at that rate the rest '
            f'ends about {end:%Y-%m-%d %H:%M} UTC')
