"""A run: resumable, repeatable, and refused where it would be mixed with another."""

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.training.landscape import VECTORS, Landscape
from training.evolution.checkpoint import CheckpointError
from training.evolution.config import RunConfig
from training.evolution.run import RunConflictError, load_result, run
from training.evolution.rundir import RunDirectory

WORDS = (('forward', 'forward'), ('backward', 'backward'), ('stop', 'stop'))
CONFIG = RunConfig(body='minimal', seed=3, words=WORDS, held_out=(('halt', 'stop'),),
                   generations=30, population=8)


class Killed(BaseException):
    """Stands for a kill: nothing may catch it."""


def go(config, directory, **options):
    return run(config, directory, vectors=VECTORS, evaluator=options.pop('evaluator', Landscape()),
               **options)


def stop_at(generation):
    def progress(seen):
        if seen.generation == generation:
            raise Killed
    return progress


def champion_bytes(directory):
    return (directory / 'champion.json').read_bytes()


def test_a_run_and_what_it_leaves(tmp_path):
    landscape = Landscape()
    result = go(CONFIG, tmp_path, evaluator=landscape)
    assert landscape.batches[0] == (16, 3, 1), 'one generation is one batch'
    assert len(landscape.batches) == 31, 'and one batch judges the champion'
    best = result.history['best_fitness']
    assert len(best) == 30
    assert (np.diff(best) >= 0).all()
    assert best[-1] > best[0]
    assert result.fitness == best[-1]
    assert result.evaluations == sum(c * w * k for c, w, k in landscape.batches[:-1])
    assert [(word.word, word.trained) for word in result.outcomes] == [
        ('forward', True), ('backward', True), ('stop', True), ('halt', False)]
    assert sum(word.score for word in result.outcomes if word.trained) == pytest.approx(
        result.fitness)
    assert 0 < result.seconds['engine'] <= result.seconds['total']
    written = json.loads(champion_bytes(tmp_path))
    assert written['body'] == 'minimal'
    assert written['record']['seed'] == 3
    assert [word['word'] for word in written['words']] == ['forward', 'backward', 'stop']


def test_a_finished_run_is_not_run_again(tmp_path):
    first = go(CONFIG, tmp_path)
    landscape = Landscape()
    again = go(CONFIG, tmp_path, evaluator=landscape)
    assert not landscape.batches
    assert again.fitness == first.fitness == load_result(tmp_path).fitness
    assert again.network.hidden_weights.tobytes() == first.network.hidden_weights.tobytes()


@pytest.mark.parametrize('interval', [1, 4])
def test_stopped_and_resumed_runs_end_in_the_same_champion(tmp_path, interval):
    whole = go(CONFIG, tmp_path / 'whole')
    broken = tmp_path / 'broken'
    for generation in (3, 4, 11, 29):
        with pytest.raises(Killed):
            go(CONFIG, broken, progress=stop_at(generation), checkpoint_s=1e9,
               checkpoint_generations=interval)
    result = go(CONFIG, broken)
    assert champion_bytes(broken) == champion_bytes(tmp_path / 'whole')
    for name, column in whole.history.items():
        assert column.tobytes() == result.history[name].tobytes(), name


def test_a_kill_loses_at_most_one_interval(tmp_path):
    with pytest.raises(Killed):
        go(CONFIG, tmp_path, progress=stop_at(17), checkpoint_s=1e9, checkpoint_generations=5)
    seen = []
    go(CONFIG, tmp_path, progress=lambda progress: seen.append(progress.generation))
    assert seen[0] == 16, 'generations 16 and 17 are done again, no others'


def test_more_generations_take_a_run_further(tmp_path):
    go(replace(CONFIG, generations=10), tmp_path / 'grown')
    grown = go(CONFIG, tmp_path / 'grown')
    whole = go(CONFIG, tmp_path / 'whole')
    assert champion_bytes(tmp_path / 'grown') == champion_bytes(tmp_path / 'whole')
    assert len(grown.history['best_fitness']) == len(whole.history['best_fitness']) == 30
    with pytest.raises(RunConflictError, match='generations: it has 30, asked 20'):
        go(replace(CONFIG, generations=20), tmp_path / 'grown')


@pytest.mark.parametrize(('field', 'value', 'message'), [
    ('seed', 4, 'seed: it has 3, asked 4'),
    ('population', 9, 'population: it has 8, asked 9'),
    ('objective', 'paper', "objective: it has 'program', asked 'paper'"),
    ('words', WORDS[:2], 'words: it has'),
])
def test_another_run_is_refused_with_what_differs(tmp_path, field, value, message):
    with pytest.raises(Killed):
        go(CONFIG, tmp_path, progress=stop_at(2))
    with pytest.raises(RunConflictError, match=message):
        go(replace(CONFIG, **{field: value}), tmp_path)


def test_other_vectors_are_another_run(tmp_path):
    go(CONFIG, tmp_path)
    changed = {**VECTORS, 'stop': VECTORS['stop'] + 0.01}
    with pytest.raises(RunConflictError, match='stop: it has'):
        run(CONFIG, tmp_path, vectors=changed, evaluator=Landscape())


def test_two_runners_on_one_directory(tmp_path):
    with (RunDirectory(tmp_path, {'config': {}}),
          pytest.raises(RunConflictError, match=r'process \d+ is running in this directory')):
        go(CONFIG, tmp_path)


@pytest.mark.parametrize('damage', ['empty', 'truncated', 'flipped', 'text', 'other'])
def test_a_damaged_checkpoint_is_refused(tmp_path, damage):
    with pytest.raises(Killed):
        go(CONFIG, tmp_path, progress=stop_at(5), checkpoint_generations=1)
    path = tmp_path / 'checkpoint.npz'
    content = path.read_bytes()
    middle = len(content) // 2
    if damage == 'other':
        other = replace(CONFIG, body='quadruped')
        with pytest.raises(Killed):
            go(other, tmp_path / 'other', progress=stop_at(5), checkpoint_generations=1)
    path.write_bytes({
        'empty': b'', 'truncated': content[:middle], 'text': b'{}',
        'flipped': content[:middle] + bytes([content[middle] ^ 0xff]) + content[middle + 1:],
        'other': (tmp_path / 'other' / 'checkpoint.npz').read_bytes() if damage == 'other' else b'',
    }[damage])
    with pytest.raises(CheckpointError, match='delete it to start') as caught:
        go(CONFIG, tmp_path)
    assert '\n' not in str(caught.value)


@pytest.mark.parametrize(('file', 'content'), [
    ('summary.json', b''), ('summary.json', b'[]'), ('summary.json', b'{}'),
    ('summary.json', b'{"generations": 30}'), ('champion.json', b'{}'), ('champion.json', b'\xff'),
    ('statistics.npz', b''), ('statistics.npz', b'text'), ('statistics.npz', b'PK\x03\x04')])
def test_damaged_results_are_named_and_made_anew(tmp_path, file, content):
    go(CONFIG, tmp_path)
    kept = champion_bytes(tmp_path)
    (tmp_path / file).write_bytes(content)
    with pytest.raises(RunConflictError, match=r'delete summary\.json beside it') as caught:
        go(CONFIG, tmp_path)
    assert str(tmp_path / file) in str(caught.value)
    assert '\n' not in str(caught.value)
    assert 'pickle' not in str(caught.value), 'no hint at a way that is none'
    (tmp_path / 'summary.json').unlink()
    go(CONFIG, tmp_path)
    assert champion_bytes(tmp_path) == kept


@pytest.mark.parametrize('content', [b'', b'[]', b'{}', b'{"config": 3}', b'\xff'])
def test_a_damaged_configuration_is_refused(tmp_path, content):
    go(CONFIG, tmp_path)
    (tmp_path / 'config.json').write_bytes(content)
    with pytest.raises(RunConflictError, match=r'config\.json: not readable') as caught:
        go(CONFIG, tmp_path)
    assert len(str(caught.value)) < 300 + len(str(tmp_path))


def test_what_a_kill_left_half_written_is_swept_away(tmp_path):
    go(CONFIG, tmp_path)
    for name in ('.checkpoint.npz.123', '.summary.json.7', '.champion.json.x1y2'):
        (tmp_path / name).write_bytes(b'half')
    go(CONFIG, tmp_path)
    assert {path.name for path in tmp_path.iterdir() if path.name.startswith('.')} == {'.lock'}


def test_a_directory_that_cannot_be_made(tmp_path):
    (tmp_path / 'file').write_text('x')
    with pytest.raises(RunConflictError, match='cannot be used as a run directory'):
        go(CONFIG, tmp_path / 'file')


def test_an_unfinished_run_has_no_result(tmp_path):
    with pytest.raises(Killed):
        go(CONFIG, tmp_path, progress=stop_at(2))
    with pytest.raises(RunConflictError, match='holds no finished run'):
        load_result(tmp_path)


def test_seeds_give_different_champions_and_starts_are_many(tmp_path):
    go(CONFIG, tmp_path / 'a')
    go(replace(CONFIG, seed=4), tmp_path / 'b')
    assert champion_bytes(tmp_path / 'a') != champion_bytes(tmp_path / 'b')
    landscape = Landscape()
    result = go(replace(CONFIG, starts=4), tmp_path / 'c', evaluator=landscape)
    assert {batch[2] for batch in landscape.batches} == {4}
    assert len(set(result.outcomes[0].final_position_m)) == 4


def test_control_hears_permuted_vectors(tmp_path):
    heard = []

    class Listening(Landscape):
        def evaluate(self, network, signals, starts):
            heard.append(np.array(signals))
            return super().evaluate(network, signals, starts)

    go(replace(CONFIG, treatment='control'), tmp_path, evaluator=Listening())
    for row, word in zip(heard[-1], ('forward', 'backward', 'stop', 'halt'), strict=True):
        assert sorted(row) == sorted(VECTORS[word])
        assert (row != VECTORS[word]).any()


def test_configuration_round_trip():
    assert RunConfig.from_json(json.loads(json.dumps(CONFIG.to_json()))) == CONFIG


@pytest.mark.parametrize(('change', 'message'), [
    ({'body': 'snake'}, "body: expected one of .*quadruped.*, got 'snake'"),
    ({'world': 'mars'}, "world: expected one of paper, earth, got 'mars'"),
    ({'engine': 'ode'}, "engine: expected one of batched, pybullet, mujoco, got 'ode'"),
    ({'generations': 0}, 'generations: expected an integer >= 1, got 0'),
    ({'population': 1.5}, 'population: expected an integer >= 2, got 1.5'),
    ({'seed': -1}, 'seed: expected an integer >= 0, got -1'),
    ({'words': ()}, 'words: expected at least one, got none'),
    ({'words': (('up', 'fly'),)}, "words: expected 'up' to ask for one of .*, got 'fly'"),
    ({'held_out': (('stop', 'stop'),)}, "words: expected each once, got 'stop' more than once"),
    ({'held_out': (('FORWARD', 'stop'),)}, "got 'FORWARD' and 'forward': one word"),
    ({'held_out': (('for\u00adward', 'stop'),)}, "and 'forward': one word"),
    ({'words': (('forward', 'forward'), ('Forward', 'backward'))}, 'one word'),
    ({'held_out': (('halt', 'stop'), ('ＨＡＬＴ', 'stop'))}, 'one word'),
])
def test_bad_configurations_are_refused(change, message):
    with pytest.raises(ValueError, match=message):
        replace(CONFIG, **change)


@pytest.mark.parametrize(('words', 'held_out'), [
    ('forward backward stop', "for'ward"), ('forward backward stop back-wards', 'backwards'),
    ('forward backward stop dont', 'DON’T'), ('forward backward (stop)', 'stop!')])
def test_words_are_compared_as_the_vocabulary_spells_them(tmp_path, words, held_out):
    """What is held out under another spelling than it is trained in would not be held out."""
    asked = dict(WORDS)
    with pytest.raises(ValueError, match='one word'):
        run(replace(CONFIG, words=tuple((word, asked.get(word, 'stop')) for word in words.split()),
                    held_out=((held_out, 'stop'),)), tmp_path, evaluator=Landscape())
    assert not list(tmp_path.iterdir())


def test_a_run_knows_its_words_by_the_vocabularys_spelling(tmp_path):
    shouted = replace(CONFIG, words=tuple((word.upper(), asked) for word, asked in WORDS),
                      held_out=(('Halt!', 'stop'),))
    run(CONFIG, tmp_path / 'a', evaluator=Landscape())
    result = run(shouted, tmp_path / 'b', evaluator=Landscape())
    assert [outcome.word for outcome in result.outcomes] == [
        word for word, _asked in CONFIG.words + CONFIG.held_out]
    assert champion_bytes(tmp_path / 'a') == champion_bytes(tmp_path / 'b')


def test_unknown_fields_are_refused():
    with pytest.raises(ValueError, match="unknown field 'speed'"):
        RunConfig.from_json({**CONFIG.to_json(), 'speed': 1})
    with pytest.raises(ValueError, match=r'run configuration: .*seed'):
        RunConfig.from_json({'body': 'minimal', 'words': WORDS})
