"""
The results of a study as four tidy Parquet tables: runs, outcomes, history, robustness.

The run directories are the record; the store is made from them, whole and again each time, so it
can always be deleted. `store_columns` documents the columns; the files carry the same text. Read it
with pandas (`pandas.read_parquet('store/outcomes.parquet')`), DuckDB, or `read_store`.
"""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Iterable
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from training.evolution.checkpoint import reason, write_atomically
from training.evolution.run import HISTORY
from training.study.config import RunSpec
from training.study.directory import StudyDirectory, StudyError, body_of, journal, read_json
from training.study.provenance import differences, run_identity
from training.study.store_columns import TABLES
from w2b_core import bodies

#: Key, in the files' metadata, of the hash of all results from which they were made.
MADE_FROM = b'w2b_made_from'

#: Columns that came later: a store without them is read all the same.
ADDED = ('results_sha256',)

Rows = dict[str, list[dict[str, Any]]]
Tables = dict[str, pd.DataFrame]


def build_store(study: StudyDirectory, *, history_points: int = 200) -> int:
    """
    Make the store anew from all finished runs of the study; return how many there are.

    Raises
    ------
    StudyError
        If a finished run is damaged, or of another provenance than the study: nothing is dropped
        silently, and nothing mixed in.

    """
    made = study.about()['identity']
    rows: Rows = {table: [] for table in TABLES}
    digest = sha256()
    count = 0
    for directory in study.run_directories():
        summary = study.summary(directory.name)
        if summary is None or summary.get('generations') != made['generations']:
            continue
        provenance = read_json(directory / 'provenance.json')
        differing = differences(provenance.get('identity', {}),
                                run_identity(made, body_of(directory.name)))
        if differing:
            raise StudyError(f'{directory}: was made otherwise than the study: '
                             f'{"; ".join(differing)}; move it away')
        try:
            _add_run(rows, parse_run_id(directory.name), directory, summary, provenance,
                     history_points)
        except (KeyError, TypeError, ValueError, IndexError, OSError, EOFError,
                zipfile.BadZipFile, zlib.error) as error:
            raise StudyError(f'{directory}: damaged ({reason(error)}); delete it and run the '
                             'study again to have that run made again') from None
        for name in ('summary.json', 'rescored.json'):
            if (directory / name).exists():
                digest.update((directory / name).read_bytes())
        count += 1
    study.store.mkdir(exist_ok=True)
    for table, table_rows in rows.items():
        _write(study.store / f'{table}.parquet', table, table_rows, digest.hexdigest())
    return count


def parse_run_id(run_id: str) -> RunSpec:
    """Return the run called `run_id` (ValueError if that is no run's name)."""
    word_set, body, treatment, seed = run_id.split('-')
    return RunSpec(word_set, body, treatment, int(seed))


def _add_run(rows: Rows, run: RunSpec, directory: Path, summary: dict[str, Any],
             provenance: dict[str, Any], history_points: int) -> None:
    key = {'run': run.run_id, 'word_set': run.word_set, 'body': run.body,
           'treatment': run.treatment, 'seed': run.seed}
    config, identity, place = summary['config'], provenance['identity'], provenance['environment']
    events = journal(directory / 'journal.jsonl')
    started, completed = ([event for event in events if event.get('event') == name]
                          for name in ('started', 'completed'))
    rows['runs'].append({
        **key, 'held_out': run.held_out, 'fitness': summary['fitness'],
        'generations': summary['generations'], 'population': config['population'],
        'evaluations': summary['evaluations'], 'objective': config['objective'],
        'engine': config['engine'], 'precision': config['precision'],
        'evolution_seed': config['seed'], 'body_length_m': bodies.get(run.body).length_m,
        'wall_s': summary['seconds']['total'], 'engine_s': summary['seconds']['engine'],
        'attempts': len(started),
        'cpu_s': completed[-1].get('cpu_s') if completed and len(started) == 1 else None,
        'program_version': place.get('program_version') or identity['program_version'],
        **{name: identity.get(name) for name in ('results_sha256', 'sources_sha256')},
        **{name: identity[name] for name in ('vocabulary', 'vocabulary_sha256')},
        'git_commit': place['git_commit'], 'host': place['host'],
        'champion': f'runs/{run.run_id}/champion.json'})
    for outcome in summary['outcomes']:
        x, y, z = outcome['final_position_m'][0]
        rows['outcomes'].append({
            **key, 'word': outcome['word'], 'behaviour': outcome['behaviour'],
            'role': 'trained' if outcome['trained'] else 'held_out',
            'final_x_m': x, 'final_y_m': y, 'final_z_m': z,
            'path_m': outcome['path_length_m'][0], 'largest_step_m': outcome['largest_step_m'][0],
            'displacement_m': float(np.hypot(x, y)), 'score': outcome['score']})
    history = read_history(directory / 'statistics.npz', history_points)
    rows['history'].extend({**key, **dict(zip(history, values, strict=True))}
                           for values in zip(*history.values(), strict=True))
    if (directory / 'rescored.json').exists():
        rescored = read_json(directory / 'rescored.json')
        columns = rescored['columns']
        if rescored['settings']['generations'] != summary['generations']:
            # The champion of a shorter run, which has since been taken further.
            columns = {}
        for values in zip(*columns.values(), strict=True):
            row = {**key, **dict(zip(columns, values, strict=True))}
            x, y = row['final_x_m'], row['final_y_m']
            row['displacement_m'] = None if x is None or y is None else float(np.hypot(x, y))
            rows['robustness'].append(row)


def read_history(path: Path, points: int) -> dict[str, list[Any]]:
    """
    Return the fitness history in a run's statistics, thinned to `points`.

    Returns
    -------
        `generation` and the names of `evolution.run.HISTORY` -> one entry a kept generation. A run
        that was imported holds only those that were kept when it was exported.

    """
    with np.load(path, allow_pickle=False) as file:
        history = {name: file[name] for name in HISTORY}
        there = (file['generation'] if 'generation' in file.files
                 else np.arange(1, len(history[HISTORY[0]]) + 1))
    chosen = np.isin(there, np.array(thinned(int(there[-1]), points)) + 1)
    return {'generation': there[chosen].tolist(),
            **{name: values[chosen].tolist() for name, values in history.items()}}


def thinned(generations: int, points: int) -> list[int]:
    """
    Return indices of the generations that the store keeps, at most `points`.

    Half of them evenly spaced, half geometrically: fitness rises fastest at first.
    """
    half = max(points // 2, 1)
    chosen = np.concatenate([np.linspace(1, generations, half),
                             np.geomspace(1, generations, half)]).round().astype(int)
    return sorted({int(generation) - 1 for generation in chosen})


def schema(table: str, made_from: str = '') -> pa.Schema:
    """Return the Arrow schema of a table, with each column's unit and meaning in its metadata."""
    return pa.schema(
        [pa.field(column.name, getattr(pa, column.type)(),
                  metadata={'unit': column.unit, 'meaning': column.meaning})
         for column in TABLES[table]], metadata={MADE_FROM: made_from.encode()})


def _write(path: Path, table: str, rows: Iterable[dict[str, Any]], made_from: str) -> None:
    buffer = BytesIO()
    pq.write_table(pa.Table.from_pylist(list(rows), schema=schema(table, made_from)), buffer,
                   compression='zstd')
    write_atomically(path, buffer.getvalue())


def read_store(study: StudyDirectory) -> Tables:
    """
    Return the store's tables; columns that a store of before does not have are empty.

    Raises
    ------
    StudyError
        If a table is missing, damaged, or made from other results than the rest of them.

    """
    tables: Tables = {}
    made_from: set[bytes] = set()
    for table in TABLES:
        path = study.store / f'{table}.parquet'
        try:
            arrow = pq.read_table(path)
            for column in TABLES[table]:
                if column.name in ADDED and column.name not in arrow.schema.names:
                    arrow = arrow.append_column(column.name, pa.nulls(
                        len(arrow), getattr(pa, column.type)()))
            names = [column.name for column in TABLES[table]]
            if sorted(arrow.schema.names) != sorted(names):
                raise ValueError(f'its columns are {", ".join(arrow.schema.names)}')
            arrow = arrow.select(names)
        except (OSError, ValueError, pa.ArrowException) as error:
            raise StudyError(f'{path}: damaged or missing ({" ".join(str(error).split())}); '
                             'run the study command again: it makes the store anew') from None
        made_from.add((arrow.schema.metadata or {}).get(MADE_FROM, b''))
        tables[table] = arrow.to_pandas()
    if len(made_from) > 1:
        raise StudyError(f'{study.store}: its tables were not made together; run the study command '
                         'again: it makes the store anew')
    return tables
