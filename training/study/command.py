"""
The whole study, or a part of it: `python -m training study CONFIG.yaml --out DIR`.

Evolves every run that CONFIG.yaml names (see training/configs), scores every champion again under
perturbed starts, in PyBullet and under a lexicon of unheard words, and makes the store of results.
May be killed at any moment and started again with the same command: nothing is lost and nothing is
done twice. More seeds in the file later only add runs; more generations take every run further.
`python -m training report DIR` then writes the report. Work goes seed by seed over all cells, so
that wherever it is stopped all cells have the same seeds.

`python -m training study status DIR` says how far it is; `study pause DIR` and `study resume DIR`
free the processors for a while; `study export DIR FILE` and `study import FILE DIR` carry finished
runs elsewhere.

By default runs go to local processes, one a core. `--scheduler ADDRESS` sends them to a Dask
cluster whose workers see DIR under the same path (docs/study/cluster.md).
"""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from training.configuration import ConfigError
from training.study.config import StudyConfig, load_config
from training.study.directory import StudyDirectory, StudyError, locked
from training.study.executor import DaskExecutor, Executor, ExecutorError, LocalExecutor
from training.study.progress import Display
from training.study.record import RecordError
from training.study.runner import Report, default_directory, run_study
from training.study.tasks import perform
from training.study.transfer import export_study

#: Where `--export-every` writes, in the study's directory.
RECORD = 'record.zip'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    add = parser.add_argument
    add('config', type=Path, metavar='CONFIG.yaml', help='what the study consists of')
    add('--out', type=Path, default=None, metavar='DIR',
        help='the study: made, or gone on with (default: out/studies/NAME)')
    add('--workers', type=int, default=None, metavar='N',
        help='local processes, one thread each (default: one a core)')
    add('--scheduler', default=None, metavar='ADDRESS',
        help="a Dask scheduler's address or file, instead of local processes")
    add('--export-every', type=int, default=None, metavar='N',
        help='write DIR/record.zip after every Nth complete seed (see: study export --help)')
    add('--evolve-only', action='store_true', help='leave the scoring of champions for later')


def main(args: argparse.Namespace) -> int:
    """Run the command; return the exit code: 0, 1 if runs failed, 2 for an error, 130."""
    kinds = ('evolve',) if args.evolve_only else ('evolve', 'rescore')
    return run_command(args, kinds)


def run_command(args: argparse.Namespace, kinds: Sequence[str]) -> int:
    """Do `kinds` of tasks of the study that `args` names; return the exit code."""
    try:
        if args.workers is not None and args.scheduler is not None:
            raise ConfigError('--workers and --scheduler contradict each other: how many workers a '
                              "cluster has is the cluster's; leave one of them out")
        if args.workers is not None and args.workers < 1:
            raise ConfigError(f'--workers: expected at least 1, got {args.workers}')
        if args.export_every is not None and args.export_every < 1:
            raise ConfigError(f'--export-every: expected at least 1, got {args.export_every}')
        config = load_config(args.config)
        study = StudyDirectory((args.out or default_directory(config)).absolute())
        report = _locked_run(config, study, args, kinds)
    except (ConfigError, StudyError, ExecutorError, OSError) as error:
        print(f'study: {" ".join(str(error).split())}', file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print('study: interrupted; the same command goes on from here', file=sys.stderr)
        return 130
    count = len(config.runs())
    stored = ('the store was not made' if report.in_store is None else
              f'{report.in_store} of {count} runs in {study.store}' if report.in_store <= count else
              f'{report.in_store} runs in {study.store}, more than the {count} configured')
    print(f'{len(report.evolved)} runs evolved and {len(report.rescored)} champions scored now; '
          f'{stored}')
    if report.errors:
        print(f'study: {len(report.errors)} tasks failed, the first: {report.errors[0]}',
              file=sys.stderr)
        return 1
    if report.in_store:
        print(f'next: {_next(args, study, kinds)}')
    return 0


def _next(args: argparse.Namespace, study: StudyDirectory, kinds: Sequence[str]) -> str:
    """Return the command that goes on from here."""
    place = shlex.quote(str(args.out or study.path))
    if 'rescore' in kinds:
        return f'python -m training report {place}'
    return f'python -m training robustness {shlex.quote(str(args.config))} --out {place}'


def _locked_run(config: StudyConfig, study: StudyDirectory, args: argparse.Namespace,
                kinds: Sequence[str]) -> Report:
    try:
        study.path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StudyError(f'{study.path}: expected a directory for the study, or a place to make '
                         f'one, got {error.strerror}; choose another --out') from None
    with locked(study.path / '.lock', str(study.path)):
        executor: Executor = (LocalExecutor(perform, args.workers) if args.scheduler is None
                              else DaskExecutor(perform, args.scheduler))
        finished = False
        try:
            with Display() as display:
                report = run_study(config, study, executor, display, kinds,
                                   _exporter(study, args.export_every, display))
            finished = True
        finally:
            executor.close(cancel=not finished)
    return report


def _exporter(study: StudyDirectory, every: int | None,
              display: Display) -> Callable[[int], None]:
    """Return what exports the study after every so many complete seeds; it never stops it."""
    def seed_done(complete: int) -> None:
        if every is None or complete % every:
            return
        try:
            runs, size = export_study(study, study.path / RECORD)
        except (StudyError, RecordError, OSError, ValueError) as error:
            text = f'export failed, the study goes on: {" ".join(str(error).split())}'
        else:
            text = f'{complete} seeds complete; {runs} runs exported, {size / 1e6:.2f} MB'
        display.console.print(text, highlight=False, markup=False, soft_wrap=True)

    return seed_done
