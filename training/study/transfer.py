"""
Finished runs out of a study into a record, and a record's runs into a study.

Export reads only what is finished, beside a study that runs. Import checks everything first: the
record as a whole, that it has the study's identity and settings, every run's files, and that none
of its runs is there. Then runs are moved into place, each whole; a kill leaves whole runs.
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import asdict
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from training.evolution.checkpoint import write_json
from training.evolution.run import HISTORY, load_result
from training.study.config import StudyConfig, parse_config
from training.study.directory import (
    FORMAT,
    StudyDirectory,
    StudyError,
    body_of,
    locked,
    read_json,
)
from training.study.provenance import differences, run_identity
from training.study.record import FILES, Record, RecordError, RunRecord, read_record, write_record
from training.study.rescoring import COLUMNS
from training.study.store import parse_run_id, read_history
from training.study.tasks import run_config

#: Where an import makes run directories ready.
STAGING = '.import'


def export_study(study: StudyDirectory, path: Path) -> tuple[int, int]:
    """
    Write the finished runs of a study as a record; return how many there are, and its bytes.

    Raises
    ------
    StudyError
        If there is no study, or no finished run, or one is damaged.

    """
    about = study.about()
    config = parse_config(about['config'])
    runs = []
    for directory in study.run_directories():
        summary = study.summary(directory.name)
        if summary is None or summary.get('generations') != about['identity']['generations']:
            continue
        runs.append(_read_run(directory, config.history_points))
    if not runs:
        raise StudyError(f'{study.path}: no run is finished yet; there is nothing to export')
    runs.sort(key=lambda run: (parse_run_id(run.run_id).seed, run.run_id))
    record = Record(about['config'], about['identity'], tuple(runs))
    _check_runs(record, config, str(study.path))
    return len(runs), write_record(path, record)


def _read_run(directory: Path, history_points: int) -> RunRecord:
    try:
        files = {name: (directory / name).read_bytes() for name in FILES}
        history = read_history(directory / 'statistics.npz', history_points)
    except (OSError, ValueError, KeyError) as error:
        raise StudyError(f'{directory}: damaged ({" ".join(str(error).split())}); delete it and '
                         'run the study again to have that run made again') from None
    path = directory / 'rescored.json'
    if not path.exists():
        return RunRecord(directory.name, files, history, None, {})
    found = read_json(path)
    settings, columns = found.get('settings'), found.get('columns')
    if not isinstance(settings, dict) or not isinstance(columns, dict) or set(columns) != set(
            COLUMNS):
        raise StudyError(f'{path}: damaged; delete it and run the study again to have the champion '
                         'scored again')
    return RunRecord(directory.name, files, history, settings,
                     {name: columns[name] for name in COLUMNS})


def import_record(path: Path, study: StudyDirectory, *, new_only: bool = False) -> list[str]:
    """
    Take the runs of a record up into a study, which is made if it is not there.

    Parameters
    ----------
    path
        Of the record.
    study
        Where they go.
    new_only
        Leave out runs that are there already, if they are the same; without, they are refused.

    Returns
    -------
        The names of the runs that were taken up.

    Raises
    ------
    RecordError
        If the record is damaged, or its runs are not what it says they are.
    StudyError
        If it does not belong to the study, has runs that are there, or the study is in use.

    """
    record = read_record(path)
    try:
        config = parse_config(record.config)
    except ValueError as error:
        raise RecordError(f'{path}: its configuration is none: {error}') from None
    _check_runs(record, config, str(path))
    study.path.mkdir(parents=True, exist_ok=True)
    with locked(study.path / '.lock', str(study.path)):
        staging = study.path / STAGING
        shutil.rmtree(staging, ignore_errors=True)
        about = _belongs(record, config, path, study)
        runs = _new_runs(record, study, path, new_only)
        try:
            for run in runs:
                _stage(run, staging / run.run_id, path)
            # On the disk before they are moved: a run in its place is a whole one.
            os.sync()
            write_json(study.study_file, about)
            study.runs.mkdir(exist_ok=True)
            for run in runs:
                _move(staging / run.run_id, study.run_directory(run.run_id))
        finally:
            shutil.rmtree(staging, ignore_errors=True)
    return [run.run_id for run in runs]


def _check_runs(record: Record, config: StudyConfig, where: str) -> None:
    """Check that each run is one of the record's identity and configuration (RecordError)."""
    for run in record.runs:
        try:
            spec = parse_run_id(run.run_id)
            provenance, summary = (json.loads(run.files[name]) for name in (
                'provenance.json', 'summary.json'))
            wrong = differences(provenance['identity'],
                                run_identity(record.identity, body_of(run.run_id)))
            asked = json.loads(json.dumps(run_config(config, spec).to_json()))
            wrong += differences(summary['config'], asked)
            if summary['generations'] != record.identity['generations']:
                wrong.append(f'{summary["generations"]} generations in its summary')
            history = run.history['generation']
            if sorted(set(history)) != history or history[-1] != summary['generations']:
                wrong.append('half a fitness history')
            if (run.rescoring_settings is None) != (not run.rescored.get('word')):
                wrong.append('half a rescoring')
        except (KeyError, TypeError, ValueError, IndexError, RecursionError) as error:
            raise RecordError(f'{where}: run {run.run_id} is damaged ({type(error).__name__}: '
                              f'{" ".join(str(error).split())})') from None
        if wrong:
            raise RecordError(f'{where}: run {run.run_id} is not of the study that it stands in: '
                              f'{"; ".join(wrong)}')


def _belongs(record: Record, config: StudyConfig, path: Path,
             study: StudyDirectory) -> dict[str, Any]:
    """Return the study's new study.json, or refuse a record of another study (StudyError)."""
    if not study.study_file.exists():
        if study.run_directories():
            raise StudyError(f'{study.study_file}: missing beside runs; run the study command, '
                             'which writes it anew, or choose another directory')
        return {**FORMAT, 'config': record.config, 'identity': record.identity}
    about = study.about()
    wrong = differences(record.identity, about['identity'])
    for name in ('robustness', 'history_points'):
        there, here = asdict(config)[name], asdict(parse_config(about['config']))[name]
        if there != here:
            wrong.append(f'{name} is {there!r} there, {here!r} here')
    if wrong:
        raise StudyError(f'{path}: is of another study than {study.path}: {"; ".join(wrong)}; '
                         'nothing was imported. Give it a directory of its own')
    identity = about['identity']
    if isinstance(identity.get('results_sha256'), dict):
        identity = {**identity, 'results_sha256': {**record.identity['results_sha256'],
                                                   **identity['results_sha256']}}
    return {**about, 'identity': identity}


def _new_runs(record: Record, study: StudyDirectory, path: Path,
              new_only: bool) -> Sequence[RunRecord]:
    """Return the runs that are to be taken up (StudyError)."""
    there = [run for run in record.runs if study.summary(run.run_id) is not None]
    for run in there:
        if new_only and not _same(run, study.run_directory(run.run_id)):
            raise StudyError(f'{path}: its run {run.run_id} is not the same as the one in '
                             f'{study.path}; nothing was imported. One of the two was not made by '
                             'the program that it names')
    if there and not new_only:
        raise StudyError(
            f'{path}: {len(there)} of its {len(record.runs)} runs are in {study.path} already, '
            f'the first: {there[0].run_id}; nothing was imported. --new-only takes the others')
    names = {run.run_id for run in there}
    return [run for run in record.runs if run.run_id not in names]


def _same(run: RunRecord, directory: Path) -> bool:
    """Return whether a finished run has the champion, its outcomes and the fitness of another."""
    here = read_json(directory / 'summary.json')
    there = json.loads(run.files['summary.json'])
    return all(here.get(name) == there.get(name) for name in (
        'config', 'generations', 'fitness', 'age', 'outcomes', 'evaluations')) and (
        read_json(directory / 'champion.json').get('network')
        == json.loads(run.files['champion.json']).get('network'))


def _stage(run: RunRecord, directory: Path, path: Path) -> None:
    """Write a run's directory and read it back as the program does (RecordError)."""
    directory.mkdir(parents=True)
    for name, content in run.files.items():
        (directory / name).write_bytes(content)
    buffer = BytesIO()
    np.savez_compressed(buffer, **{  # type: ignore[arg-type]
        'generation': np.array(run.history['generation'], dtype=np.int64),
        **{name: np.array(run.history[name], dtype=np.float64) for name in HISTORY}})
    (directory / 'statistics.npz').write_bytes(buffer.getvalue())
    if run.rescoring_settings is not None:
        write_json(directory / 'rescored.json', {'settings': run.rescoring_settings,
                                                 'columns': run.rescored})
    try:
        load_result(directory)
    except ValueError as error:
        shown = str(error).replace(f'{directory}/', '')
        raise RecordError(f'{path}: run {run.run_id} is damaged ({shown}); nothing was '
                          'imported') from None


def _move(staged: Path, target: Path) -> None:
    """Put a run into its place; one that is under way there is given up, if nobody works at it."""
    with ExitStack() as stack:
        if target.exists():
            stack.enter_context(locked(target / 'claim', str(target)))
            shutil.rmtree(target)
        staged.rename(target)
