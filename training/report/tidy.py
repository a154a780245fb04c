"""
The study's results as one tidy Parquet table, small enough to be committed.

One row an outcome: a run's champion under a word, as evolved or elsewhere (`condition`). Lengths
are rounded to a tenth of a millimetre, which is what keeps the table small; `training/study/store`
has them in full, and fitness histories too.
"""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from training.evolution.checkpoint import write_atomically
from training.study.store import Tables
from training.study.store_columns import TABLES

LARGEST_BYTES = 5_000_000
DECIMALS = 4
LENGTHS = ('final_x_m', 'displacement_m', 'path_m', 'largest_step_m')
COLUMNS = ('run', 'word_set', 'body', 'treatment', 'seed', 'held_out', 'body_length_m', 'fitness',
           'condition', 'engine', 'word', 'word_class', 'role', 'start', *LENGTHS)


def tidy(store: Tables) -> pd.DataFrame:
    """Return one row an outcome, columns `COLUMNS`; condition `evolved` for those of training."""
    runs = store['runs']
    about = runs[['run', 'held_out', 'body_length_m', 'fitness']]
    evolved = store['outcomes'].rename(columns={'behaviour': 'word_class'}).assign(
        condition='evolved', start=0).merge(runs[['run', 'engine']], on='run')
    rows = pd.concat([evolved, store['robustness']], ignore_index=True).merge(about, on='run')
    rows = rows.sort_values(['run', 'condition', 'word', 'start'], kind='stable',
                            ignore_index=True)[list(COLUMNS)]
    for name in LENGTHS:
        rows[name] = rows[name].astype(float).round(DECIMALS).astype('float32')
    return rows


def write_tidy(store: Tables, path: Path) -> None:
    """
    Write the table, units and meanings in its metadata.

    Raises
    ------
    ValueError
        If it is larger than `LARGEST_BYTES`; nothing is written then.

    """
    meanings = {column.name: {'unit': column.unit, 'meaning': column.meaning}
                for name in ('runs', 'outcomes', 'robustness') for column in TABLES[name]}
    table = pa.Table.from_pandas(tidy(store), preserve_index=False).replace_schema_metadata({})
    table = table.cast(pa.schema([field.with_metadata(meanings[field.name])
                                  for field in table.schema]))
    buffer = BytesIO()
    pq.write_table(table, buffer, compression='zstd', compression_level=19)
    if buffer.tell() > LARGEST_BYTES:
        raise ValueError(f'{path}: expected at most {LARGEST_BYTES:,} bytes, the table of '
                         f'{len(table):,} outcomes has {buffer.tell():,}; the record (study '
                         'export) is smaller')
    write_atomically(path, buffer.getvalue())
