"""`fidelity --body`: the batched engine against PyBullet, and what is refused."""

import argparse
import json

import numpy as np
import pytest

from training.evolution.champion import WordOutcome, write_champion
from training.evolution.operators import Layout, random_genomes
from training.measure import against_pybullet, fidelity
from w2b_core import bodies
from w2b_core.controller import file as controller_file
from w2b_core.vocabulary import Vocabulary
from w2b_sim.worlds import EARTH, WORLDS

#: Small and quick in PyBullet, and not at home in `earth`.
BODY = 'spherical_1dof_blind'
COLUMNS = {'median_error_m', 'p90_error_m', 'floor_median_error_m', 'rank_correlation',
           'floor_rank_correlation', 'touch', 'reference_touch'}


def run(*options):
    parser = argparse.ArgumentParser()
    fidelity.add_arguments(parser)
    return fidelity.main(parser.parse_args(list(options)))


@pytest.fixture(scope='module')
def vocabulary():
    return Vocabulary.load()


@pytest.fixture
def controller(tmp_path, vocabulary):
    """Write a controller of a body, trained (so it says) on two words."""
    def write(body_name=BODY, words=('forward', 'stop'), heard=None):
        body = bodies.get(body_name)
        layout = Layout.of(body)
        network = layout.network(random_genomes(np.random.default_rng(5), 1, layout)[0])
        vectors = np.array([vocabulary.vector(word) for word in words] if heard is None else heard)
        judged = [WordOutcome(word, 'stop', True, 0.0, ((0.0, 0.0, 0.0),), (0.0,), (0.0,))
                  for word in words]
        path = tmp_path / f'{body_name}.json'
        write_champion(path, body, WORLDS[body.world], network, judged, vectors, {})
        return path
    return write


def test_the_table_has_a_row_a_sample_and_way_of_running_the_engine(controller, capsys):
    assert run('--body', BODY, '--world', 'earth', '--count', '2',
               '--controllers', str(controller())) == 0
    printed = capsys.readouterr()
    lines = printed.out.splitlines()
    assert 'in earth' in lines[0]
    assert 'PyBullet at 1 ms' in lines[0]
    assert [(line[:24].strip(), line[24:36].strip()) for line in lines[2:]] == [
        (sample, engine) for sample in ('random', 'evolved')
        for engine in ('batched', 'as trained', 'MuJoCo')]
    assert 'bounds' not in printed.out.lower(), 'an aim, not a bound'
    assert 'PyBullet: evolved' in printed.err, 'its progress'


def test_json_and_no_controller_that_ships(capsys):
    assert run('--body', BODY, '--world', 'earth', '--count', '3', '--json') == 0
    printed = capsys.readouterr()
    result = json.loads(printed.out)
    assert (result['world'], result['count']) == ('earth', 3)
    assert list(result['bodies'][BODY]) == ['random']
    measured = result['bodies'][BODY]['random']
    assert set(measured) == COLUMNS
    assert measured['median_error_m'] < 0.05
    assert f'no controller of {BODY} ships' in printed.err


def test_the_reference_does_not_depend_on_the_processes(vocabulary):
    body = bodies.get(BODY)
    sample = against_pybullet.random_sample(body, vocabulary, 3, seed=1)
    one, two = (against_pybullet.in_pybullet(body, EARTH, sample, processes)
                for processes in (1, 2))
    assert np.array_equal(one.moved_m, two.moved_m)
    assert np.array_equal(one.nudged_m, two.nudged_m)
    assert np.abs(one.moved_m).max() > 1e-3, 'something moved'
    assert not np.array_equal(one.moved_m, one.nudged_m), 'the floor starts elsewhere'


def test_samples_repeat_and_are_what_the_help_says(vocabulary):
    body = bodies.get('physical_twin')
    controllers = against_pybullet.load_controllers(body, None, vocabulary)
    assert [one.body for one in controllers] == ['physical_twin']
    sample = against_pybullet.evolved_sample(body, controllers, vocabulary, 41, seed=0)
    again = against_pybullet.evolved_sample(body, controllers, vocabulary, 41, seed=0)
    layout = Layout.of(body)
    genomes = layout.genome(sample.network)
    assert np.array_equal(genomes, layout.genome(again.network))
    changed = (genomes != layout.genome(controllers[0].network)).sum(axis=1)
    assert changed.tolist() == [0] * 21 + [1] * 20
    own = np.array([vocabulary.vector(word.word) for word in controllers[0].words])
    assert np.array_equal(sample.signals[:len(own), 0], own)
    assert np.array_equal(sample.signals[21:21 + len(own), 0], own)
    assert len(np.unique(sample.signals[:21, 0], axis=0)) == 21, 'every word once'
    random = against_pybullet.random_sample(body, vocabulary, 5, seed=0)
    other = against_pybullet.random_sample(body, vocabulary, 5, seed=1)
    assert not np.array_equal(layout.genome(random.network), layout.genome(other.network))


def test_a_touch_fraction_where_there_is_touch(vocabulary):
    body = bodies.get('minimal')
    sample = against_pybullet.random_sample(body, vocabulary, 2, seed=0)
    how = against_pybullet.settings(body)[0]
    _moved, touch = against_pybullet.in_batched(body, EARTH, sample, how)
    assert 0 < touch <= 1


@pytest.mark.parametrize(('options', 'message'), [
    ((), 'expected either --traces FILE.npz or --body BODY, got neither'),
    (('--traces', 'a.npz', '--body', BODY), 'got both'),
    (('--traces', 'a.npz', '--count', '3'), '--count needs --body'),
    (('--traces', 'a.npz', '--controllers', 'x.json'), '--controllers needs --body'),
    (('--body', BODY, '--engine', 'pybullet'), 'PyBullet is the reference'),
    (('--body', 'elephant'), "unknown body 'elephant'"),
    (('--body', 'quadruped'), "PyBullet's friction is another law there, so that it is no"),
    (('--body', BODY, '--world', 'moon'), "expected one of paper, earth, got 'moon'"),
    (('--body', 'physical_twin', '--count', '0'), '--count: expected an integer >= 1, got 0'),
    (('--body', 'physical_twin', '--seed', '-1'), '--seed: expected an integer >= 0, got -1'),
    (('--body', 'physical_twin', '--controllers', 'quadruped'),
     'expected a controller of physical_twin, got one of quadruped'),
    (('--body', 'physical_twin', '--controllers', '/no/such.json'), 'no such file')])
def test_what_cannot_be_compared_is_a_one_line_error(capsys, options, message):
    assert run(*options) == 2
    printed = capsys.readouterr()
    assert printed.out == ''
    assert len(printed.err.splitlines()) == 1
    assert message in printed.err


@pytest.mark.parametrize(('changes', 'message'), [
    ({'words': ()}, 'with its trained words, got none'),
    ({'heard': np.zeros((2, 300))}, "got another vector of 'forward'")])
def test_a_controller_whose_words_are_not_known_is_refused(controller, capsys, changes, message):
    if changes.get('words') == ():
        path = controller()
        one = controller_file.load(path)
        controller_file.save(controller_file.Controller(
            one.body, one.network, one.sensors, one.motors, one.period_s, ()), path)
    else:
        path = controller(**changes)
    assert run('--body', BODY, '--world', 'earth', '--controllers', str(path)) == 2
    assert message in capsys.readouterr().err
