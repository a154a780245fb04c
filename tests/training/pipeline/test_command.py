"""What the champions command refuses before it computes anything."""

from pathlib import Path

import pytest

from training.__main__ import main
from training.pipeline.command import parse_seeds
from training.pipeline.recipe import shipped

ROBOT = Path(__file__).resolve().parents[3] / 'examples' / 'robots' / 'dog8.yaml'
SERIAL = shipped()['quadruped']


@pytest.mark.parametrize(('options', 'message'), [
    (['--seeds', '3-1'], 'seeds: expected A-B'),
    (['--keep', '0'], 'keep: expected at least 1'),
    (['--effort', 'nan'], 'effort: expected a factor above 0'),
    (['--body', 'nobody'], 'body: '),
    (['--body', str(ROBOT), '--seeds', '3-4'], 'seeds: expected 0-N for legs'),
    (['--body', str(ROBOT), '--ears', '2'], 'ears: expected none for legs'),
    ([str(SERIAL), '--body', str(ROBOT)], '--body: expected none beside')])
def test_bad_options_are_one_line_errors(tmp_path: Path, capsys, options, message):
    assert main(['champions', '--out', str(tmp_path / 'out'), *options]) == 2
    errors = capsys.readouterr().err
    assert message in errors
    assert errors.count('\n') == 1


def test_seed_lists():
    assert parse_seeds('2-4') == (2, 3, 4)
    assert parse_seeds('7,1') == (7, 1)
    for bad in ('', '4-2', 'a', '-1'):
        with pytest.raises(ValueError, match='seeds: expected'):
            parse_seeds(bad)
