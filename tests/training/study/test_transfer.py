"""Runs carried from one study to another: whole, once, and only where they belong."""

from __future__ import annotations

import json
import shutil
import zipfile
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.training.study_files import main_command, plain, run_inline, seeds
from training.study.directory import StudyDirectory, StudyError, locked
from training.study.record import (
    MANIFEST,
    Record,
    RecordError,
    RunRecord,
    read_record,
    write_record,
)
from training.study.store import build_store, read_store, thinned
from training.study.transfer import export_study, import_record

GENERATIONS = 12


def data(first_seed: int = 0, count: int = 1, **changes: Any) -> dict[str, Any]:
    experiment = {**plain()['experiments'][0], 'seeds': count, 'first_seed': first_seed}
    return plain(**{'generations': GENERATIONS, 'experiments': [experiment], **changes})


@pytest.fixture(scope='module')
def ours(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished study of the seeds 0 and 1: four runs."""
    study = tmp_path_factory.mktemp('ours') / 'study'
    assert run_inline(data(count=2), study).in_store == 4
    return study


@pytest.fixture(scope='module')
def record(ours: Path) -> Path:
    path = ours.parent / 'ours.zip'
    runs, size = export_study(StudyDirectory(ours), path)
    assert (runs, size) == (4, path.stat().st_size)
    return path


@pytest.fixture(scope='module')
def theirs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Somebody else's record: seed 7 of the same study."""
    folder = tmp_path_factory.mktemp('theirs')
    run_inline(data(first_seed=7), folder / 'study')
    export_study(StudyDirectory(folder / 'study'), folder / 'theirs.zip')
    return folder / 'theirs.zip'


def files(study: Path) -> dict[str, bytes]:
    return {str(path.relative_to(study)): path.read_bytes()
            for path in sorted(study.rglob('*')) if path.is_file() and path.name != '.lock'}


def copy(ours: Path, tmp_path: Path) -> StudyDirectory:
    return StudyDirectory(Path(shutil.copytree(ours, tmp_path / 'copy')))


def tables(study: StudyDirectory) -> dict[str, bytes]:
    build_store(study, history_points=4)
    return {path.name: path.read_bytes() for path in study.store.iterdir()}


def test_an_import_is_the_same_study_and_gives_the_same_record(
        ours: Path, record: Path, tmp_path: Path) -> None:
    study = StudyDirectory(tmp_path / 'study')
    assert len(import_record(record, study)) == 4
    for name in ('summary.json', 'champion.json', 'rescored.json', 'provenance.json',
                 'config.json', 'journal.jsonl'):
        for path in ours.glob(f'runs/*/{name}'):
            assert (study.path / path.relative_to(ours)).read_bytes() == path.read_bytes()
    assert tables(study) == tables(StudyDirectory(ours)), 'the report is made from these'
    export_study(study, tmp_path / 'again.zip')
    assert (tmp_path / 'again.zip').read_bytes() == record.read_bytes()


def test_no_imported_run_is_done_again(record: Path, tmp_path: Path) -> None:
    import_record(record, StudyDirectory(tmp_path))
    report = run_inline(data(count=3), tmp_path)
    assert sorted(report.evolved) == sorted(report.rescored) == [
        'paper-quadruped-control-0002', 'paper-quadruped-experimental-0002']
    assert report.in_store == 6


def test_others_add_seeds(ours: Path, theirs: Path, tmp_path: Path) -> None:
    study = copy(ours, tmp_path)
    before = files(study.path)
    assert import_record(theirs, study) == ['paper-quadruped-control-0007',
                                            'paper-quadruped-experimental-0007']
    after = files(study.path)
    assert {name: after[name] for name in before} == before
    assert build_store(study) == 6
    assert sorted(set(read_store(study)['runs'].seed)) == [0, 1, 7]


def test_an_imported_champion_can_be_scored_again(record: Path, tmp_path: Path) -> None:
    import_record(record, StudyDirectory(tmp_path))
    changed = data(count=2, robustness={'perturbed_starts': 1, 'pybullet_starts': 0})
    report = run_inline(changed, tmp_path)
    assert (report.evolved, len(report.rescored)) == ([], 4)


def refused(path: Path, study: StudyDirectory, match: str, **options: bool) -> None:
    before = files(study.path)
    with pytest.raises((StudyError, RecordError), match=match) as error:
        import_record(path, study, **options)
    assert '\n' not in str(error.value)
    assert files(study.path) == before, 'nothing is mixed in'


def test_a_record_imported_twice_is_refused(record: Path, theirs: Path, tmp_path: Path) -> None:
    study = StudyDirectory(tmp_path)
    import_record(record, study)
    refused(record, study, '4 of its 4 runs are in .* already')
    assert import_record(record, study, new_only=True) == []
    import_record(theirs, study)
    refused(theirs, study, '2 of its 2 runs are in .* already')


def test_new_only_refuses_a_run_that_is_not_the_same(
        ours: Path, record: Path, tmp_path: Path) -> None:
    study = copy(ours, tmp_path)
    path = sorted(study.runs.glob('*/champion.json'))[1]
    value = json.loads(path.read_text())
    value['network']['motor_weights'][0][0] += 1e-9
    path.write_text(json.dumps(value))
    refused(record, study, f'its run {path.parent.name} is not the same', new_only=True)


@pytest.mark.parametrize(('changes', 'match'), [
    ({'generations': GENERATIONS + 1}, 'generations is 12 there, 13 here'),
    ({'population': 9}, 'population is 8 there, 9 here'),
    ({'objective': 'paper'}, "objective is 'program' there, 'paper' here"),
    ({'robustness': {'perturbed_starts': 1, 'pybullet_starts': 0}}, 'robustness is'),
])
def test_a_record_of_another_configuration_is_refused(
        theirs: Path, tmp_path: Path, changes: dict[str, Any], match: str) -> None:
    run_inline(data(**changes), tmp_path)
    refused(theirs, StudyDirectory(tmp_path), match)


def rewritten(path: Path, target: Path, change: Callable[[dict[str, Any]], None]) -> Path:
    """Write a record anew with another manifest."""
    with zipfile.ZipFile(path) as archive, zipfile.ZipFile(target, 'w') as out:
        for name in archive.namelist():
            content = archive.read(name)
            if name == MANIFEST:
                manifest = json.loads(content)
                change(manifest)
                content = json.dumps(manifest).encode()
            out.writestr(name, content)
    return target


def test_a_record_of_other_results_is_refused(ours: Path, theirs: Path, tmp_path: Path) -> None:
    study = copy(ours, tmp_path)

    def other(manifest: dict[str, Any]) -> None:
        manifest['identity']['results_sha256']['quadruped'] = 'f' * 64

    # Also where it is the runs' provenance, not the manifest, that tells.
    refused(rewritten(theirs, tmp_path / 'other.zip', other), study, 'results_sha256 is')
    about = json.loads(study.study_file.read_text())
    about['identity']['results_sha256']['quadruped'] = 'e' * 64
    study.study_file.write_text(json.dumps(about))
    refused(theirs, study, 'is of another study than .*results_sha256 is')


def test_half_a_record_and_a_damaged_one_are_refused(
        ours: Path, theirs: Path, tmp_path: Path) -> None:
    study, whole, path = copy(ours, tmp_path), theirs.read_bytes(), tmp_path / 'bad.zip'
    for content in (whole[:len(whole) // 2], b'', b'text', whole[:-1]):
        path.write_bytes(content)
        refused(path, study, 'damaged or cut short')
    for place in range(200, len(whole), len(whole) // 25):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 0x10]) + whole[place + 1:])
        # A bit in what zip keeps twice, such as a date, may change nothing.
        try:
            read_record(path)
        except RecordError:
            refused(path, study, 'damaged or cut short')
        else:
            assert read_record(path) == read_record(theirs)
    refused(tmp_path / 'none.zip', study, 'no such file')
    with zipfile.ZipFile(path, 'w') as archive:
        archive.writestr('a.txt', 'a')
    refused(path, study, 'no record of a study')
    refused(rewritten(theirs, path, lambda manifest: manifest.update(version=2)), study,
            'version 2 of the format, expected 1')
    refused(rewritten(theirs, path, lambda manifest: manifest.update(runs=3)), study,
            '3 runs expected, 2 there')


@pytest.mark.parametrize(('part', 'match'), [
    ('rescored', 'half a rescoring'), ('history', 'damaged|half a fitness history')])
def test_a_run_with_a_part_missing_is_refused(
        ours: Path, theirs: Path, tmp_path: Path, part: str, match: str) -> None:
    import io

    import pyarrow.parquet as pq

    with zipfile.ZipFile(theirs) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    name = f'{part}.parquet'
    table = pq.read_table(io.BytesIO(members[name]))
    buffer = io.BytesIO()
    pq.write_table(table.filter(pq.ParquetFile(io.BytesIO(members[name])).read()['run'].to_numpy()
                                == 0), buffer)
    members[name] = buffer.getvalue()
    manifest = json.loads(members[MANIFEST])
    manifest['sha256'][name] = sha256(members[name]).hexdigest()
    members[MANIFEST] = json.dumps(manifest).encode()
    with zipfile.ZipFile(tmp_path / 'half.zip', 'w') as archive:
        for member, content in members.items():
            archive.writestr(member, content)
    refused(tmp_path / 'half.zip', copy(ours, tmp_path), match)


def test_two_at_once_are_refused(ours: Path, theirs: Path, tmp_path: Path) -> None:
    study = copy(ours, tmp_path)
    with locked(study.path / '.lock', 'study'):
        refused(theirs, study, 'is working in it')
    assert len(import_record(theirs, study)) == 2


def test_a_run_under_way_is_given_up_only_if_nobody_works_at_it(
        ours: Path, theirs: Path, tmp_path: Path) -> None:
    study = copy(ours, tmp_path)
    under_way = study.run_directory('paper-quadruped-control-0007')
    under_way.mkdir()
    (under_way / 'checkpoint.npz').write_bytes(b'half a run')
    with locked(under_way / 'claim', 'run'), pytest.raises(StudyError, match='is working in it'):
        import_record(theirs, study)
    assert (under_way / 'checkpoint.npz').read_bytes() == b'half a run'
    assert import_record(theirs, study, new_only=True)[0] == under_way.name
    assert not (under_way / 'checkpoint.npz').exists()
    assert build_store(study) == 6


def test_the_commands_say_what_they_did_and_what_is_next(
        ours: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, target = tmp_path / 'mine.zip', tmp_path / 'my study'
    assert main_command('study', 'export', ours, file) == 0
    assert '4 runs, 0.' in capsys.readouterr().out
    assert main_command('study', 'import', file, target) == 0
    assert capsys.readouterr().out.endswith(f"next: python -m training report '{target}'\n")
    assert main_command('study', 'import', file, target) == 2
    error = capsys.readouterr().err
    assert 'already' in error
    assert error.count('\n') == 1
    assert main_command('study', 'export', tmp_path / 'nothing', file) == 2
    assert 'no study here' in capsys.readouterr().err
    assert main_command('study', 'status', target) == 0
    assert '2 of 2 seeds complete' in capsys.readouterr().out


def test_a_study_exports_itself_after_every_second_seed(tmp_path: Path) -> None:
    from tests.training.study_files import run_command, write

    file, study = write(tmp_path / 'study.yaml', seeds(3)), tmp_path / 'study'
    ended = run_command('study', file, '--out', study, '--workers', '1', '--export-every', '2')
    assert ended.returncode == 0, ended.stderr
    assert '2 seeds complete; 4 runs exported' in ended.stderr
    assert {run.run_id[-4:] for run in read_record(study / 'record.zip').runs} == {'0000', '0001'}


def test_the_whole_study_of_the_paper_takes_less_than_ten_megabytes(
        record: Path, tmp_path: Path) -> None:
    """By what 28 more runs add, of the paper's length, with numbers as good as random."""
    rng = np.random.default_rng(0)
    one = read_record(record).runs[0]
    assert len(one.rescored['word']) > 200, 'the lexicon is part of it'
    kept = len(thinned(6000, 200))

    def single(count: int) -> list[float]:
        return rng.normal(size=count).astype(np.float32).astype(float).tolist()

    def made(index: int) -> RunRecord:
        champion = json.loads(one.files['champion.json'])
        for name in ('hidden_weights', 'motor_weights'):
            champion['network'][name] = rng.normal(size=np.shape(
                champion['network'][name])).tolist()
        summary = json.loads(one.files['summary.json'])
        for outcome in summary['outcomes']:
            outcome['final_position_m'] = [single(3)]
            outcome['path_length_m'], outcome['largest_step_m'] = single(1), single(1)
            outcome['score'] = single(1)[0]
        count = len(one.rescored['word'])
        # Heights lie close together; of the fitness history five words' scores are the sum.
        measured = {name: (single(count) if name != 'final_z_m' else (
            0.3 + 0.01 * rng.random(count)).astype(np.float32).astype(float).tolist())
            for name in ('final_x_m', 'final_y_m', 'final_z_m', 'path_m', 'largest_step_m')}
        history = {'generation': [number + 1 for number in thinned(6000, 200)],
                   **{name: [sum(single(5)) for _ in range(kept)]
                      for name in ('best_fitness', 'median_fitness')},
                   **{name: rng.integers(40, 400, kept).astype(float).tolist()
                      for name in ('best_age', 'survivors', 'evaluations')}}
        return RunRecord(f'paper-quadruped-control-{index:04d}', {
            **one.files, 'champion.json': json.dumps(champion, indent=1).encode(),
            'summary.json': json.dumps(summary, indent=1).encode()}, history,
            one.rescoring_settings, {**one.rescored, **measured})

    runs = tuple(made(index) for index in range(56))
    few, many = (write_record(tmp_path / 'record.zip', Record(
        read_record(record).config, read_record(record).identity, runs[:count]))
        for count in (28, 56))
    assert few + (many - few) / 28 * (1400 - 28) < 10e6
