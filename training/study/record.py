"""
A study's finished runs in one compact file: what the report and a new scoring of champions need.

A record is a zip archive of four members. It holds no code and no pickle, and it is checked as a
whole before anything of it is used.

    manifest.json     format, the study's config and identity, the SHA-256 of the other members
    runs.parquet      one row a run: its small files, as they are, and the settings of its rescoring
    history.parquet   the fitness history of each run, thinned as the store has it
    rescored.parquet  the champion under perturbed starts, PyBullet, the lexicon

What it leaves out: checkpoints (a run of more generations starts again from the first) and the
generations of the history that the store leaves out too.
"""

from __future__ import annotations

import json
import zipfile
import zlib
from dataclasses import dataclass
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from training.evolution.checkpoint import write_atomically
from training.evolution.run import HISTORY
from training.study.rescoring import COLUMNS

FORMAT = {'format': 'w2b-study-record', 'version': 1}
MANIFEST = 'manifest.json'
#: Files of a run's directory that a record holds as they are.
FILES = ('config.json', 'summary.json', 'champion.json', 'provenance.json', 'journal.jsonl')

_TEXTS = ('condition', 'engine', 'word', 'word_class', 'role')
_MEASURED = ('final_x_m', 'final_y_m', 'final_z_m', 'path_m', 'largest_step_m')
SCHEMAS = {
    'runs': pa.schema([('run', pa.string()), *((name, pa.large_binary()) for name in FILES),
                       ('rescoring_settings', pa.string())]),
    'history': pa.schema([('run', pa.int32()), ('generation', pa.int32()),
                          *((name, pa.float64()) for name in HISTORY)]),
    'rescored': pa.schema([('run', pa.int32()), *(
        (name, pa.string() if name in _TEXTS else pa.int32() if name == 'start' else pa.float64())
        for name in COLUMNS)]),
}
#: Numbers that differ from row to row are split into their bytes, which are packed better so;
#: of single precision, half of these bytes are zero.
SPLIT = {'runs': (), 'history': ('best_fitness', 'median_fitness'), 'rescored': _MEASURED}
WHOLE = {'runs': FILES, 'history': (), 'rescored': ()}
#: A record of 1,400 runs takes 10 MB; one that says it unpacks to more than this is no record.
MOST_BYTES = 1_000_000_000


class RecordError(ValueError):
    """A record that cannot be used; one line with the file, the reason and what to do."""


@dataclass(frozen=True)
class RunRecord:
    """
    What a record holds of one run.

    Attributes
    ----------
    run_id
        Name of the run.
    files
        Name of `FILES` -> content.
    history
        `generation` and names of `HISTORY` -> a list, one entry a kept generation.
    rescoring_settings, rescored
        As rescored.json has them, None and empty for a champion that was not scored again yet.

    """

    run_id: str
    files: dict[str, bytes]
    history: dict[str, list[Any]]
    rescoring_settings: dict[str, Any] | None
    rescored: dict[str, list[Any]]


@dataclass(frozen=True)
class Record:
    """A study's `config` and `identity`, as its study.json has them, and its finished runs."""

    config: dict[str, Any]
    identity: dict[str, Any]
    runs: tuple[RunRecord, ...]


def write_record(path: Path, record: Record) -> int:
    """Write a record atomically; return its size in bytes. The same record gives the same bytes."""
    rows: dict[str, dict[str, list[Any]]] = {
        table: {name: [] for name in schema.names} for table, schema in SCHEMAS.items()}
    for index, run in enumerate(record.runs):
        own = rows['runs']
        own['run'].append(run.run_id)
        for name in FILES:
            own[name].append(run.files[name])
        own['rescoring_settings'].append(
            None if run.rescoring_settings is None
            else json.dumps(run.rescoring_settings, sort_keys=True))
        for table, columns in (('history', run.history), ('rescored', run.rescored)):
            count = len(next(iter(columns.values()), ()))
            rows[table]['run'] += [index] * count
            for name, values in columns.items():
                rows[table][name] += values
    members = {f'{table}.parquet': _parquet(table, columns) for table, columns in rows.items()}
    manifest = {**FORMAT, 'config': record.config, 'identity': record.identity,
                'runs': len(record.runs),
                'sha256': {name: sha256(data).hexdigest() for name, data in members.items()}}
    buffer = BytesIO()
    with zipfile.ZipFile(buffer, 'w', zipfile.ZIP_DEFLATED) as archive:
        for name, data in {MANIFEST: _json(manifest), **members}.items():
            # A fixed date: the file's bytes say what is in it, not when it was written.
            archive.writestr(zipfile.ZipInfo(name), data, zipfile.ZIP_DEFLATED
                             if name == MANIFEST else zipfile.ZIP_STORED)
    write_atomically(path, buffer.getvalue())
    return len(buffer.getvalue())


def read_record(path: Path) -> Record:
    """
    Return the record in a file.

    Raises
    ------
    RecordError
        If the file is missing, damaged, cut short, or no record.

    """
    try:
        with zipfile.ZipFile(path) as archive:
            names = {info.filename for info in archive.infolist()}
            if sum(info.file_size for info in archive.infolist()) > MOST_BYTES:
                raise RecordError(f'{path}: expected less than {MOST_BYTES} bytes unpacked; this '
                                  'is no record of a study')
            if MANIFEST not in names:
                raise RecordError(f'{path}: no record of a study (no {MANIFEST} in it); make one '
                                  'with `python -m training study export DIR FILE`')
            manifest = json.loads(archive.read(MANIFEST))
            hashes = _checked(path, manifest)['sha256']
            data = {name: archive.read(name) for name in sorted(names - {MANIFEST})}
    except FileNotFoundError:
        raise RecordError(f'{path}: no such file') from None
    except (OSError, zipfile.BadZipFile, zlib.error, EOFError, ValueError, RecursionError,
            NotImplementedError) as error:
        if isinstance(error, RecordError):
            raise
        raise _damaged(path, error) from None
    found = {name: sha256(content).hexdigest() for name, content in data.items()}
    if found != hashes:
        wrong = sorted(name for name in found.keys() | hashes.keys()
                       if found.get(name) != hashes.get(name))
        raise _damaged(path, f'{wrong[0]} is not what {MANIFEST} says')
    try:
        tables = {table: _table(table, data[f'{table}.parquet']) for table in SCHEMAS}
        runs = _runs(tables)
    except (KeyError, IndexError, ValueError, TypeError, OSError, pa.ArrowException) as error:
        raise _damaged(path, error) from None
    if len(runs) != manifest['runs']:
        raise _damaged(path, f'{manifest["runs"]} runs expected, {len(runs)} there')
    return Record(manifest['config'], manifest['identity'], runs)


def _checked(path: Path, manifest: Any) -> dict[str, Any]:
    if not isinstance(manifest, dict) or manifest.get('format') != FORMAT['format']:
        raise RecordError(f'{path}: no record of a study; make one with `python -m training study '
                          'export DIR FILE`')
    if manifest.get('version') != FORMAT['version']:
        raise RecordError(f'{path}: version {manifest.get("version")!r} of the format, expected '
                          f'{FORMAT["version"]}; use the program that wrote it, or a newer one')
    for name, kind in (('config', dict), ('identity', dict), ('sha256', dict), ('runs', int)):
        if not isinstance(manifest.get(name), kind):
            raise _damaged(path, f'no {name} in {MANIFEST}')
    return manifest


def _damaged(path: Path, error: object) -> RecordError:
    why = f'{type(error).__name__}: {error}' if isinstance(error, Exception) else error
    return RecordError(f'{path}: damaged or cut short ({" ".join(str(why).split())}); nothing of '
                       'it was used. Export or copy it again')


def _parquet(table: str, columns: dict[str, list[Any]]) -> bytes:
    split, whole = SPLIT[table], WHOLE[table]
    buffer = BytesIO()
    pq.write_table(
        pa.Table.from_pydict(columns, schema=SCHEMAS[table]), buffer, compression='brotli',
        compression_level=9, use_byte_stream_split=list(split),
        use_dictionary=[name for name in columns if name not in (*split, *whole)],
        # Large pages: files of many runs look alike, and are packed together.
        data_page_size=1 << 24, write_statistics=False, store_schema=False)
    return buffer.getvalue()


def _table(table: str, data: bytes) -> dict[str, list[Any]]:
    arrow = pq.read_table(BytesIO(data))
    if arrow.schema.names != SCHEMAS[table].names:
        raise ValueError(f'{table}.parquet has the columns {", ".join(arrow.schema.names)}')
    columns: dict[str, list[Any]] = arrow.cast(SCHEMAS[table]).to_pydict()
    return columns


def _runs(tables: dict[str, dict[str, list[Any]]]) -> tuple[RunRecord, ...]:
    own = tables['runs']
    parts = {table: _by_run(tables[table], len(own['run'])) for table in ('history', 'rescored')}
    if len(set(own['run'])) != len(own['run']):
        raise ValueError('a run stands twice in it')
    return tuple(RunRecord(
        run_id, {name: own[name][index] for name in FILES}, parts['history'][index],
        None if own['rescoring_settings'][index] is None
        else json.loads(own['rescoring_settings'][index]), parts['rescored'][index])
        for index, run_id in enumerate(own['run']))


def _by_run(columns: dict[str, list[Any]], count: int) -> list[dict[str, list[Any]]]:
    names = [name for name in columns if name != 'run']
    parts: list[dict[str, list[Any]]] = [{name: [] for name in names} for _ in range(count)]
    for row, index in enumerate(columns['run']):
        if index < 0:
            raise IndexError(f'run {index}')
        for name in names:
            parts[index][name].append(columns[name][row])
    return parts


def _json(value: Any) -> bytes:
    return (json.dumps(value, indent=1, sort_keys=True) + '\n').encode()
