"""The fidelity command: recordings repeated within bounds, and files that are not recordings."""

import argparse
import io
import json

import numpy as np
import pytest

from tests.reference import BODIES
from training.measure import fidelity
from training.measure.traces import load

FILE = ('reference', 'pyrosim_traces.npz')


def run(path, *options):
    parser = argparse.ArgumentParser()
    fidelity.add_arguments(parser)
    return fidelity.main(parser.parse_args(['--traces', str(path), *options]))


@pytest.fixture
def few(shared, tmp_path):
    """Write a file of a part of the recorded evaluations."""
    def write(bodies=('spherical_2dof_blind',), controllers=slice(2, 5), words=slice(1, 4),
              **changed):
        arrays = {}
        with np.load(shared.joinpath(*FILE)) as file:
            for body in bodies:
                for key in ('h', 'm'):
                    arrays[f'{body}.{key}'] = file[f'{body}.{key}'][controllers]
                for key in ('state', 'pos', 'pos_nudged'):
                    arrays[f'{body}.{key}'] = file[f'{body}.{key}'][controllers, words]
        for key, value in changed.items():
            arrays[key.replace('__', '.')] = value
        path = tmp_path / 'traces.npz'
        np.savez(path, **{key: value for key, value in arrays.items() if value is not None})
        return path
    return write


@pytest.mark.parametrize('body', BODIES)
def test_the_batched_engine_is_within_bounds(shared, body):
    traces = next(one for one in load(shared.joinpath(*FILE)) if one.name == body)
    measured = fidelity.compare(traces, *fidelity.replay('batched', traces))
    assert fidelity.within_bounds(measured), measured
    if body != 'quadruped':
        assert measured['rank_correlation'] > 0.99


def test_the_recording_itself_has_no_error(shared):
    traces = load(shared.joinpath(*FILE))[0]
    moved = traces.position_m[:, :, -1, :2] - traces.position_m[:, :, 0, :2]
    measured = fidelity.compare(traces, moved, None)
    assert measured['median_error_m'] == 0
    assert measured['rank_correlation'] == pytest.approx(1)
    assert not fidelity.within_bounds(fidelity.compare(traces, -moved, None))
    failed = np.where(np.arange(len(moved))[:, None, None] == 0, np.nan, moved)
    assert fidelity.compare(traces, failed, None)['median_error_m'] == 0


def test_a_part_of_the_recordings_as_json(few, capsys):
    assert run(few(), '--json') == 0
    bodies = json.loads(capsys.readouterr().out)['bodies']
    assert list(bodies) == ['spherical_2dof_blind']
    assert set(bodies['spherical_2dof_blind']) == {
        'median_error_m', 'p90_error_m', 'floor_median_error_m', 'rank_correlation',
        'floor_rank_correlation', 'touch'}
    assert bodies['spherical_2dof_blind']['median_error_m'] < 0.001


def test_one_evaluation_is_enough_for_errors(few, capsys):
    assert run(few(controllers=slice(0, 1), words=slice(0, 1)), '--json') == 0
    measured = json.loads(capsys.readouterr().out)['bodies']['spherical_2dof_blind']
    assert measured['median_error_m'] < 0.01
    assert measured['rank_correlation'] is None


def test_pybullet_and_mujoco_are_printed_beside_it_without_a_bound(few, capsys):
    assert run(few(controllers=slice(0, 1), words=slice(0, 2))) == 0
    lines = capsys.readouterr().out.splitlines()
    assert 'bounds' in lines[1].lower()
    for line, engine in zip(lines[2:], ('pybullet', 'mujoco'), strict=True):
        assert engine in line
        assert 'bounds' not in line.lower()


@pytest.mark.parametrize(('changes', 'message'), [
    ({'spherical_2dof_blind__m': None}, 'spherical_2dof_blind.m is missing'),
    ({'spherical_2dof_blind__h': np.zeros((3, 5, 9))}, r'expected shape (3, 5, 6), got (3, 5, 9)'),
    ({'spherical_2dof_blind__pos': np.zeros((3, 3, 500))}, 'spherical_2dof_blind.'),
    ({'spherical_2dof_blind__state': np.full((3, 3, 5, 2), np.nan)}, 'expected finite numbers'),
    ({'spherical_2dof_blind__m': np.full((3, 2, 5), 'x')}, 'expected numbers, got <U1'),
    ({'octopus__pos': np.zeros((3, 3, 500, 3))}, "unknown body 'octopus'")])
def test_a_malformed_file_is_a_one_line_error(few, capsys, changes, message):
    assert run(few(**changes), '--json') == 2
    printed = capsys.readouterr()
    assert printed.out == ''
    assert len(printed.err.splitlines()) == 1
    assert message in printed.err


def array_file(save, *values):
    buffer = io.BytesIO()
    save(buffer, *values)
    return buffer.getvalue()


@pytest.mark.parametrize('content', [
    b'', b'not a zip', b'PK\x03\x04broken', b'\x89PNG\r\n\x1a\n1234',
    array_file(np.save, np.zeros(3)), array_file(np.save, np.array([{}]))])
def test_a_file_that_is_no_npz_is_a_one_line_error(tmp_path, capsys, content):
    path = tmp_path / 'traces.npz'
    path.write_bytes(content)
    assert run(path) == 2
    errors = capsys.readouterr().err
    assert len(errors.splitlines()) == 1
    assert f'{path}: expected an .npz file of recorded evaluations (format: ' in errors
    assert 'pickle' not in errors


def test_files_that_cannot_be_read_are_one_line_errors(tmp_path, capsys):
    for path, message in ((tmp_path / 'none.npz', 'no such file'), (tmp_path, 'Is a directory')):
        assert run(path) == 2
        errors = capsys.readouterr().err
        assert len(errors.splitlines()) == 1
        assert message in errors
