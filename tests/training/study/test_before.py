"""A study made before runs were identified by results (`study_of_before`, made at ec0d16a)."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from tests.training.study_files import main_command, plain, run_inline
from training.study.directory import StudyDirectory, StudyError
from training.study.store import read_store
from training.study.transfer import export_study, import_record

BEFORE = Path(__file__).parent / 'study_of_before'


@pytest.fixture
def study(tmp_path: Path) -> StudyDirectory:
    return StudyDirectory(Path(shutil.copytree(BEFORE, tmp_path / 'study')))


def test_its_store_is_read(study: StudyDirectory) -> None:
    store = read_store(study)
    assert len(store['runs']) == 4
    assert store['runs'].results_sha256.isna().all()
    assert {len(value) for value in store['runs'].sources_sha256} == {64}


def test_its_report_is_written(study: StudyDirectory, tmp_path: Path) -> None:
    assert main_command('report', study.path, '--publish', tmp_path / 'docs') == 0
    page = (study.path / 'report' / 'report.html').read_text(encoding='utf-8')
    sources = study.about()['identity']['sources_sha256']
    assert 'hash of the sources that decide a run' in page
    assert sources in page
    assert '4 evolutionary runs' in (tmp_path / 'docs' / 'summary.md').read_text(encoding='utf-8')


def test_it_is_not_gone_on_with(study: StudyDirectory) -> None:
    experiment = {**plain()['experiments'][0], 'seeds': 3}
    before = {path: path.read_bytes() for path in study.path.rglob('*') if path.is_file()}
    with pytest.raises(StudyError, match=r'was made otherwise: .*sources_sha256 is'):
        run_inline(plain(experiments=[experiment], robustness={
            'perturbed_starts': 2, 'pybullet_starts': 1, 'lexicon': False}), study.path)
    assert {path: path.read_bytes() for path in before} == before


def test_its_runs_can_be_carried(study: StudyDirectory, tmp_path: Path) -> None:
    export_study(study, tmp_path / 'record.zip')
    assert len(import_record(tmp_path / 'record.zip', StudyDirectory(tmp_path / 'other'))) == 4
    run_inline(plain(), tmp_path / 'new')
    with pytest.raises(StudyError, match='is of another study'):
        import_record(tmp_path / 'record.zip', StudyDirectory(tmp_path / 'new'))


def test_the_same_run_has_the_same_champion_now(study: StudyDirectory, tmp_path: Path) -> None:
    run_inline(plain(), tmp_path / 'now')
    for path in (tmp_path / 'now').glob('runs/*/champion.json'):
        before = study.path / path.relative_to(tmp_path / 'now')
        assert json.loads(path.read_text())['network'] == json.loads(
            before.read_text())['network']
