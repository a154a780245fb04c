"""
A study on disk: who may work in it, which runs are done, and that all runs are of one provenance.

    study.json                    configuration and identity (see `provenance`)
    runs/RUN/config.json, checkpoint.npz, statistics.npz, summary.json, champion.json
                                  of `evolution.run`
    runs/RUN/provenance.json      identity and environment in which the run was made
    runs/RUN/journal.jsonl        one line an attempt and one for its completion
    runs/RUN/rescored.json        the champion under perturbed starts, PyBullet, the lexicon
    store/*.parquet               the results, tidy (see `store`)

A run is done when its summary is there: that file is written last, and atomically.
"""

from __future__ import annotations

import fcntl
import json
import os
import socket
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from training.evolution.checkpoint import write_json
from training.study.config import RunSpec
from training.study.provenance import differences, run_identity, utc_now

FORMAT = {'format': 'w2b-study', 'version': 1}


class StudyError(Exception):
    """A study that cannot go on; one line that says why and what to do."""


class StudyDirectory:
    """Paths and states of a study's files."""

    def __init__(self, path: Path) -> None:
        self.path = Path(path)
        self.study_file = self.path / 'study.json'
        self.store = self.path / 'store'
        self.runs = self.path / 'runs'

    def run_directory(self, run_id: str) -> Path:
        """Return the directory of a run."""
        return self.runs / run_id

    def run_directories(self) -> list[Path]:
        """Return the directories of all runs, finished or not, by name."""
        return sorted(self.runs.glob('*-*-*-*'))

    def summary(self, run_id: str) -> dict[str, Any] | None:
        """Return a finished run's summary, None if the run is not over (StudyError if damaged)."""
        path = self.run_directory(run_id) / 'summary.json'
        if not path.exists():
            return None
        summary = read_json(path)
        seconds = summary.get('seconds')
        if not (isinstance(summary.get('generations'), int) and isinstance(seconds, dict)
                and isinstance(seconds.get('total'), int | float)):
            # Taken for a run of another length, it would be left out of the results in silence.
            raise StudyError(f'{path}: damaged (no generations or seconds in it); '
                             f'{_remedy(path)}')
        return summary

    def about(self) -> dict[str, Any]:
        """Return the study's `config` and `identity` (StudyError if there is none, or damaged)."""
        if not self.study_file.exists():
            raise StudyError(f'{self.path}: no study here; run `python -m training study` first')
        about = read_json(self.study_file)
        for field in ('config', 'identity'):
            if not isinstance(about.get(field), dict):
                raise StudyError(f'{self.study_file}: damaged (no {field} in it); '
                                 f'{_remedy(self.study_file)}')
        return about

    def done(self, run: RunSpec, generations: int) -> bool:
        """Return whether the run has been taken to `generations`."""
        summary = self.summary(run.run_id)
        return summary is not None and summary.get('generations') == generations

    def noted(self, run: RunSpec, generations: int) -> bool:
        """Return whether the run's journal says that it was completed with `generations`."""
        return any(event.get('event') == 'completed' and event.get('generations') == generations
                   for event in journal(self.run_directory(run.run_id) / 'journal.jsonl'))

    def adopt(self, config: dict[str, Any], identity: dict[str, Any]) -> None:
        """
        Take the study up: check `identity` against every run there is, then note `config`.

        Results of bodies that only earlier runs have stay in the study's identity.

        Raises
        ------
        StudyError
            If the study or a run in it was made with other results, another vocabulary or
            configuration. `generations` may rise: such runs are taken further, all of them.

        """
        results = dict(identity['results_sha256'])
        for file in [self.study_file, *sorted(self.runs.glob('*/provenance.json'))]:
            if not file.exists():
                continue
            found = read_json(file).get('identity')
            if not isinstance(found, dict):
                raise StudyError(f'{file}: damaged (no identity in it); delete it if you are sure '
                                 'where this came from, or use another --out')
            asked = identity
            if file != self.study_file:
                body = body_of(file.parent.name)
                if isinstance(found.get('results_sha256'), str):
                    results.setdefault(body, found['results_sha256'])
                asked = run_identity({**identity, 'results_sha256': results}, body)
            elif isinstance(found.get('results_sha256'), dict):
                results = {**found['results_sha256'], **results}
            differing = differences(may_grow(found, asked), asked)
            if differing:
                raise StudyError(
                    f'{file.parent}: was made otherwise: {"; ".join(differing)}. Use another '
                    '--out, or the program and configuration that made it')
        write_json(self.study_file, {**FORMAT, 'config': config,
                                     'identity': {**identity, 'results_sha256': results}})


def body_of(run_id: str) -> str:
    """Return the body in a run's name, '' if that is no run's name."""
    parts = run_id.split('-')
    return parts[1] if len(parts) == 4 else ''


def may_grow(found: dict[str, Any], asked: dict[str, Any]) -> dict[str, Any]:
    """Return `found` with the asked `generations` if those are more: a run can be taken further."""
    here, there = asked.get('generations'), found.get('generations')
    if isinstance(here, int) and isinstance(there, int) and here > there:
        return {**found, 'generations': here}
    return found


@contextmanager
def locked(path: Path, what: str, wait_s: float = 0.0) -> Iterator[None]:
    """
    Hold the lock file `path`; the kernel lets go of it when this process ends, however it ends.

    Parameters
    ----------
    path
        Made if missing, never deleted.
    what
        What the lock guards, for the message.
    wait_s
        How long to wait for another holder.

    Raises
    ------
    StudyError
        If another process holds it until then.

    """
    with open(path, 'a+') as file:
        deadline = time.monotonic() + wait_s
        while True:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError:
                if time.monotonic() >= deadline:
                    file.seek(0)
                    holder = file.read().strip() or 'another process'
                    raise StudyError(f'{what}: {holder} is working in it; wait for it or stop it '
                                     'first') from None
                time.sleep(0.1)
        file.truncate(0)
        file.write(f'process {os.getpid()} on {socket.gethostname()}')
        file.flush()
        yield


def in_use(path: Path) -> bool:
    """Return whether a process holds the lock file `path`."""
    try:
        with open(path, 'rb') as file:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except FileNotFoundError:
        return False
    return False


def read_json(path: Path) -> dict[str, Any]:
    """Return the JSON object in `path` (StudyError if it is damaged)."""
    try:
        value = json.loads(path.read_text(encoding='utf-8'))
    except (OSError, ValueError, RecursionError) as error:
        raise StudyError(f'{path}: damaged ({error}); {_remedy(path)}') from None
    if not isinstance(value, dict):
        raise StudyError(f'{path}: damaged (expected a JSON object); {_remedy(path)}')
    return value


def _remedy(path: Path) -> str:
    if path.name == 'study.json':
        return ('delete it and run the study again, which writes it anew: every run has its own '
                'provenance')
    return f'delete {path.parent} and run the study again to have that run made again'


def append_line(path: Path, event: str, **values: Any) -> None:
    """Append an event to a journal; a line torn by a kill is passed over by `journal`."""
    line = json.dumps({'event': event, 'utc': utc_now(), 'host': socket.gethostname(),
                       'process': os.getpid(), **values}, sort_keys=True)
    with open(path, 'ab+') as file:
        if file.seek(0, os.SEEK_END) and (file.seek(-1, os.SEEK_END), file.read(1))[1] != b'\n':
            line = '\n' + line
        file.write(line.encode() + b'\n')


def journal(path: Path) -> list[dict[str, Any]]:
    """Return the events of a journal."""
    events = []
    text = path.read_text(encoding='utf-8', errors='replace') if path.exists() else ''
    for line in text.splitlines():
        try:
            event = json.loads(line)
        except (ValueError, RecursionError):
            continue
        if isinstance(event, dict):
            events.append(event)
    return events


def completions(study: StudyDirectory, runs: Sequence[RunSpec]) -> dict[str, int]:
    """Return how many times each run was completed, by its journal: 0 or 1, never more."""
    return {run.run_id: sum(event.get('event') == 'completed' for event in
                            journal(study.run_directory(run.run_id) / 'journal.jsonl'))
            for run in runs}
