"""The store: tidy, documented, complete, and never half-made."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.training.study_files import plain, run_inline
from training.study.directory import StudyDirectory, StudyError
from training.study.lexicon import load_lexicon
from training.study.store import build_store, read_store, thinned
from training.study.store_columns import TABLES, as_markdown
from w2b_core.controller import file as controller_file

DOCS = Path(__file__).resolve().parents[3] / 'docs' / 'study'


@pytest.fixture(scope='module')
def study(tmp_path_factory: pytest.TempPathFactory) -> StudyDirectory:
    folder = tmp_path_factory.mktemp('store') / 'study'
    run_inline(plain(), folder)
    return StudyDirectory(folder)


def test_tables_hold_what_the_columns_say(study: StudyDirectory) -> None:
    tables = read_store(study)
    assert {name: list(table.columns) for name, table in tables.items()} == {
        name: [column.name for column in columns] for name, columns in TABLES.items()}
    runs, outcomes = tables['runs'], tables['outcomes']
    assert len(runs) == 2
    assert (runs.cpu_s > 0).all()
    assert (runs.attempts == 1).all()
    assert sorted(runs.treatment) == ['control', 'experimental']
    assert len(outcomes) == 2 * 6
    assert outcomes[outcomes.role == 'held_out'].set_index('run').word.to_dict() == (
        runs.set_index('run').held_out.to_dict())
    assert not outcomes.isna().any().any()
    assert np.allclose(outcomes.displacement_m, np.hypot(outcomes.final_x_m, outcomes.final_y_m))
    assert (outcomes.path_m >= outcomes.displacement_m - 1e-6).all()


def test_fitness_is_the_sum_of_the_trained_scores(study: StudyDirectory) -> None:
    tables = read_store(study)
    trained = tables['outcomes'][tables['outcomes'].role == 'trained']
    sums = trained.groupby('run').score.sum()
    assert np.allclose(tables['runs'].set_index('run').fitness, sums, atol=1e-6)
    last = tables['history'].sort_values('generation').groupby('run').best_fitness.last()
    assert np.allclose(tables['runs'].set_index('run').fitness, last)


def test_robustness_holds_every_trial(study: StudyDirectory) -> None:
    rows = read_store(study)['robustness']
    words = sum(map(len, load_lexicon().values()))
    assert rows.groupby(['run', 'condition']).size().to_dict() == {
        (f'paper-quadruped-{treatment}-0000', condition): count
        for treatment in ('control', 'experimental')
        for condition, count in (('perturbed', 6 * 2), ('lexicon', words))}
    assert set(rows.word_class) == {'forward', 'backward', 'stop', 'unrelated'}


def test_champions_are_controller_files(study: StudyDirectory) -> None:
    for run in read_store(study)['runs'].itertuples():
        controller = controller_file.load(study.path / run.champion)
        assert controller.body == run.body
        assert controller.record['fitness'] == pytest.approx(run.fitness)


def test_other_tools_read_it_and_find_the_units_in_it(study: StudyDirectory) -> None:
    outcomes = pd.read_parquet(study.store / 'outcomes.parquet')
    assert len(outcomes) == 12
    field = pq.read_schema(study.store / 'outcomes.parquet').field('path_m')
    assert field.metadata[b'unit'] == b'm'
    assert field.metadata[b'meaning']


def test_the_documented_columns_are_the_stores() -> None:
    assert as_markdown().strip() in (DOCS / 'store.md').read_text(encoding='utf-8')


def test_a_damaged_table_is_named_and_made_anew(study: StudyDirectory) -> None:
    before = read_store(study)
    path = study.store / 'outcomes.parquet'
    kept = path.read_bytes()
    for damage in (kept[:200], b'', kept[:-1000] + b'x' * 1000):
        path.write_bytes(damage)
        with pytest.raises(StudyError, match=r'outcomes\.parquet: damaged or missing') as refused:
            read_store(study)
        assert '\n' not in str(refused.value)
    assert build_store(study, history_points=4) == 2
    assert path.read_bytes() == kept, 'the same runs give the same bytes'
    pd.testing.assert_frame_equal(read_store(study)['outcomes'], before['outcomes'])


def test_tables_of_different_makings_are_not_mixed(study: StudyDirectory) -> None:
    path = study.store / 'runs.parquet'
    kept = path.read_bytes()
    table = pq.read_table(path)
    pq.write_table(table.replace_schema_metadata({b'w2b_made_from': b'else'}), path)
    try:
        with pytest.raises(StudyError, match='not made together'):
            read_store(study)
    finally:
        path.write_bytes(kept)


@pytest.mark.parametrize(('file', 'content'), [
    ('statistics.npz', b'text'), ('statistics.npz', b''), ('statistics.npz', b'PK\x03\x04'),
    ('provenance.json', b'{"settings": '), ('rescored.json', b'{"settings": '),
    ('rescored.json', b'{}'), ('summary.json', b'{}'), ('summary.json', b'{"generations": 6}')])
def test_a_damaged_run_is_named(study: StudyDirectory, file: str, content: bytes) -> None:
    path = sorted(study.runs.iterdir())[0] / file
    kept = path.read_bytes()
    path.write_bytes(content)
    try:
        with pytest.raises(StudyError, match=path.parent.name) as refused:
            build_store(study)
        assert 'damaged' in str(refused.value)
    finally:
        path.write_bytes(kept)


def test_a_run_of_another_identity_is_not_mixed_in(study: StudyDirectory) -> None:
    path = sorted(study.runs.iterdir())[0] / 'provenance.json'
    kept = path.read_bytes()
    value = json.loads(kept)
    value['identity']['engine'] = 'pybullet'
    path.write_text(json.dumps(value))
    try:
        with pytest.raises(StudyError, match='made otherwise than the study: engine'):
            build_store(study)
    finally:
        path.write_bytes(kept)


def test_unfinished_runs_are_left_out(study: StudyDirectory, tmp_path: Path) -> None:
    summary = sorted(study.runs.iterdir())[0] / 'summary.json'
    kept = summary.read_bytes()
    summary.unlink()
    try:
        assert build_store(study) == 1
        assert len(read_store(study)['runs']) == 1
    finally:
        summary.write_bytes(kept)
    assert build_store(study, history_points=4) == 2


@settings(deadline=None)
@given(st.integers(1, 7000), st.integers(2, 400))
def test_history_is_thinned_to_the_points_asked_for(generations: int, points: int) -> None:
    kept = thinned(generations, points)
    assert kept == sorted(set(kept))
    assert len(kept) <= points
    assert kept[0] == 0
    assert kept[-1] == generations - 1 or points < 4


def test_the_whole_study_stays_below_two_gigabytes(study: StudyDirectory) -> None:
    [run, _] = sorted(study.runs.iterdir())
    fixed = sum(path.stat().st_size for path in run.iterdir()
                if path.name not in ('checkpoint.npz', 'statistics.npz'))
    # Per generation 5 numbers of 8 bytes in the checkpoint and at most as many in the statistics;
    # 50 to 100 genomes of 90 numbers in the checkpoint.
    each = fixed + 6000 * 5 * 8 * 2 + 100 * 93 * 8
    store = sum(path.stat().st_size for path in study.store.iterdir()) / 2
    history = 200 * (5 * 8 + 50)
    assert 1400 * (each + store + history) < 2e9
