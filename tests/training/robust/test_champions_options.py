"""What the champions and ablation commands refuse before they compute anything."""

from pathlib import Path

import numpy as np
import pytest

from training.__main__ import main
from training.robust.ablation import load_walkers


@pytest.mark.parametrize(('options', 'message'), [
    (['--gait', '/no/such.json'], '/no/such.json: expected a controller file, got nothing'),
    (['--gait', 'elephant'], 'expected one of'),
    (['--gait', 'physical_twin'],
     'expected a controller for quadruped, got one for physical_twin'),
    (['--seeds', '3-1'], 'seeds: expected A-B'),
    (['--keep', '0'], 'keep: expected at least 1'),
    (['--effort', 'nan'], 'effort: expected a factor above 0')])
def test_bad_options_are_one_line_errors(tmp_path: Path, capsys, options, message):
    assert main(['champions', '--out', str(tmp_path / 'out'), *options]) == 2
    errors = capsys.readouterr().err
    assert message in errors
    assert errors.count('\n') == 1


@pytest.mark.parametrize(('content', 'message'), [
    (None, 'got none that can be read'), (b'', 'got none that can be read'),
    (b'text', 'not a file of numpy arrays'),
    (np.zeros((2, 3)), r'expected numbers of shape \(N, 4\)'),
    (np.zeros(4), 'expected numbers'), (np.zeros((0, 4)), 'expected numbers'),
    (np.array([['a', 'b', 'c', 'd']]), 'expected numbers')])
def test_walkers_that_are_none(tmp_path: Path, content, message):
    path = tmp_path / 'walkers.npy'
    if isinstance(content, bytes):
        path.write_bytes(content)
    elif content is not None:
        np.save(path, content)
    with pytest.raises(ValueError, match=message) as caught:
        load_walkers(path, 4)
    assert str(path) in str(caught.value)


def test_walkers_come_back_as_they_were(tmp_path: Path):
    walkers = np.arange(8.0).reshape(2, 4)
    np.save(tmp_path / 'walkers.npy', walkers)
    assert np.array_equal(load_walkers(tmp_path / 'walkers.npy', 4), walkers)
