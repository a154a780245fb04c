"""
What a worker does for a study: evolve one run, or score its champion again.

Both are safe to kill and to give out twice: a claim (a file lock that dies with its process) lets
one worker at a time into a run's directory, and work that is done is not done again. Errors that a
user can act on come back as text, so that one run's trouble does not stop the others.
"""

from __future__ import annotations

import errno
import os
import socket
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any, Literal

from training.evolution.checkpoint import write_json
from training.evolution.config import RunConfig
from training.evolution.engines import make_evaluator
from training.evolution.run import Progress, load_result
from training.evolution.run import run as evolve
from training.evolution.vectors import vectors
from training.study.config import RunSpec, StudyConfig
from training.study.directory import (
    StudyDirectory,
    StudyError,
    append_line,
    locked,
    may_grow,
    read_json,
)
from training.study.lexicon import lexicon_sha256, load_lexicon
from training.study.pausing import Pause
from training.study.provenance import differences, environment
from training.study.rescoring import COLUMNS, rescore, trials
from training.study.results import results_sha256
from w2b_core import bodies
from w2b_sim.engines.interface import Evaluator
from w2b_sim.worlds import WORLDS

#: How long to wait for the previous holder of a run, such as a worker that was just lost.
CLAIM_WAIT_S = 60.0
NO_SPACE = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


TaskKind = Literal['evolve', 'rescore']


@dataclass(frozen=True)
class Task:
    """
    One piece of a study's work.

    `identity` is what the run's provenance must be; `in_pybullet` says whether rescoring includes
    PyBullet.
    """

    kind: TaskKind
    study: str
    config: StudyConfig
    identity: dict[str, Any]
    run: RunSpec
    in_pybullet: bool = True


@dataclass(frozen=True)
class TaskResult:
    """What came of a task: an `error` in one line, or none; `fatal` if it stops all tasks."""

    error: str | None = None
    fatal: bool = False
    seconds: float = 0.0


def perform(task: Task) -> TaskResult:
    """Do a task; nothing is raised."""
    began = time.monotonic()
    place = StudyDirectory(Path(task.study))
    directory = place.run_directory(task.run.run_id)
    try:
        directory.mkdir(parents=True, exist_ok=True)
        with locked(directory / 'claim', str(directory), CLAIM_WAIT_S):
            pause = Pause(place.path, directory)
            pause.wait()
            {'evolve': _evolve, 'rescore': _rescore}[task.kind](task, place, directory, pause)
    except OSError as error:
        if error.errno in NO_SPACE:
            return TaskResult(f'{directory}: no space left to write ({error.strerror}); free some '
                              'and start again: what is done stays done', True)
        return TaskResult(f'{directory}: {error}')
    except (ValueError, StudyError) as error:
        return TaskResult(' '.join(str(error).split()))
    except Exception as error:
        with suppress(OSError):
            (directory / 'error.txt').write_text(traceback.format_exc(), encoding='utf-8')
        return TaskResult(f'{directory}: unforeseen {type(error).__name__}: {error}; '
                          'the trace is in its error.txt')
    return TaskResult(seconds=time.monotonic() - began)


def run_config(config: StudyConfig, run: RunSpec) -> RunConfig:
    """Return the evolutionary run of `run` (ValueError if it cannot be)."""
    trained, held_out = run.words()
    return RunConfig(
        body=run.body, seed=run.evolution_seed, words=trained, held_out=held_out,
        generations=config.generations, population=config.population, treatment=run.treatment,
        objective=config.objective, engine=config.engine, precision=config.precision,
        vocabulary=config.vocabulary)


def _check_results(task: Task) -> None:
    """Refuse work where the engine returns other results than where the study was taken up."""
    config, body = task.config, task.run.body
    here = results_sha256(config.engine, config.precision, body, config.objective)
    asked = task.identity['results_sha256']
    if here != asked:
        raise StudyError(f'{task.run.run_id}: the engine of {socket.gethostname()} returns other '
                         f'results for {body} ({here[:12]}) than the study has ({asked[:12]}); use '
                         'the same program, packages and kind of processor for all workers')


def _evolve(task: Task, place: StudyDirectory, directory: Path, pause: Pause) -> None:
    _own(directory, task.identity)
    log = directory / 'journal.jsonl'
    wanted, generations = task.run, task.config.generations
    cpu_s = None
    if not place.done(wanted, generations):
        _check_results(task)
        append_line(log, 'started', generations=generations)
        config = run_config(task.config, wanted)
        began = time.process_time()
        evolve(config, directory, _reporter(directory / 'progress.json', pause),
               vectors=vectors(task.config.vocabulary,
                               (word for word, _ in config.words + config.held_out)),
               evaluator=_evaluator(config.engine, config.body, config.precision),
               program={'results_sha256': task.identity['results_sha256']})
        cpu_s = round(time.process_time() - began, 3)
    if not place.noted(wanted, generations):
        append_line(log, 'completed', generations=generations, cpu_s=cpu_s)
    (directory / 'progress.json').unlink(missing_ok=True)


def _own(directory: Path, identity: dict[str, Any]) -> None:
    """Note where the run in `directory` comes from, or check that it comes from there."""
    path = directory / 'provenance.json'
    found: dict[str, Any] = {}
    if path.exists():
        found = read_json(path)
        differing = differences(may_grow(found.get('identity', {}), identity), identity)
        if differing:
            raise StudyError(f'{directory}: was made otherwise: {"; ".join(differing)}')
        if found['identity'] == identity:
            return
    write_json(path, {'environment': environment(), **found, 'identity': identity})


def rescoring_settings(task: Task) -> dict[str, Any]:
    """Return all that decides a champion's rescoring: what was done with others is done again."""
    return {'generations': task.config.generations, 'in_pybullet': task.in_pybullet,
            'robustness': asdict(task.config.robustness),
            'lexicon_sha256': lexicon_sha256(load_lexicon())}


def rescored(task: Task, directory: Path) -> bool:
    """Return whether the champion has been scored again, with these settings."""
    path = directory / 'rescored.json'
    return path.exists() and read_json(path).get('settings') == rescoring_settings(task)


def _rescore(task: Task, _place: StudyDirectory, directory: Path, pause: Pause) -> None:
    if rescored(task, directory):
        return
    _check_results(task)
    network = load_result(directory).network
    columns: dict[str, list[Any]] = {name: [] for name in COLUMNS}
    for trial in trials(task.config, task.run, load_lexicon(), in_pybullet=task.in_pybullet):
        pause.wait()
        heard = vectors(task.config.vocabulary, (word.word for word in trial.words))
        rows = rescore(network, task.run, trial, _evaluator(
            trial.engine, task.run.body, task.config.precision), heard)
        for name, values in rows.items():
            columns[name].extend(values)
    write_json(directory / 'rescored.json', {'settings': rescoring_settings(task),
                                             'columns': columns})


@cache
def _evaluator(engine: str, body: str, precision: str) -> Evaluator:
    """One evaluator a body and worker: making one compiles, or starts a physics server."""
    described = bodies.get(body)
    return make_evaluator(engine, described, WORLDS[described.world], precision=precision)


def _reporter(path: Path, pause: Pause) -> Callable[[Progress], None]:
    """
    Return a callback for the end of each generation.

    It leaves the run's progress in a file, at most once a second, and waits while the study is
    paused.
    """
    last = time.monotonic()

    def report(progress: Progress) -> None:
        nonlocal last
        pause.wait()
        now = time.monotonic()
        if now - last < 1.0:
            return
        last = now
        aside = path.with_name(f'.{path.name}.{os.getpid()}')
        # For show only: a full disk is met where it matters, at the next checkpoint.
        with suppress(OSError):
            aside.write_text(f'{{"generation": {progress.generation}, '
                             f'"fitness": {progress.best_fitness}}}', encoding='utf-8')
            os.replace(aside, path)

    return report
