"""The physical twin's champion: kept word by word, held-out words asked once and last."""

import json
from dataclasses import replace

import numpy as np
import pytest

from training.evolution.operators import Layout
from training.robust import blind, ears, gate, twin
from training.robust.scenarios import DIRECTION
from training.robust.twin import ROLES, Candidate
from w2b_core import bodies
from w2b_core.controller import file as controller_file
from w2b_core.network import Network
from w2b_core.vocabulary import Vocabulary

BODY = bodies.get('physical_twin')
HELD_OUT = {word for word, _asked in ROLES.held_out}
NETWORK = Network(np.full((5, 6), 0.1), np.full((12, 5), 0.2),
                  np.array([joint.time_constant for joint in BODY.joints]))


def row(word, asked, x=None, far=0.05, trained=True):
    x = {'forward': 0.5, 'backward': -0.5, 'stop': 0.0}[asked] if x is None else x
    return gate.Row(word, asked, trained, x, x, x, far, 0.0, 0, far <= 0.1 or asked != 'stop')


class Gate:
    """In place of PyBullet: everybody obeys, but for words in `disobeyed`; remembers what came."""

    def __init__(self, disobeyed=()):
        self.disobeyed, self.calls = disobeyed, []

    def __call__(self, network, body, world, words, held_out, vectors, *, starts, validation=(),
                 **_options):
        assert body.name == 'physical_twin'
        assert world.name == 'earth'
        self.calls.append(((words, validation, held_out), starts, set(vectors)))
        return tuple(row(word, asked, far=0.3 if word in self.disobeyed else 0.05,
                         trained=(word, asked) in words)
                     for word, asked in words + validation + held_out)


@pytest.fixture
def vectors():
    vocabulary = Vocabulary.load()
    return {word: vocabulary.vector(word) for word, _asked in ROLES.trained + ROLES.validation}


@pytest.fixture
def made(monkeypatch, tmp_path):
    """Make the champion in a directory, with ears and evolution left out."""
    def make(judge):
        monkeypatch.setattr(gate, 'gate', judge)
        monkeypatch.setattr(gate, 'later', lambda *_args, **_options: (
            gate.Later('forward', 60.0, 2.5, -0.3),))
        monkeypatch.setattr(ears, 'find', lambda *_args: (np.zeros((1, 5, 6)), None))
        monkeypatch.setattr(twin, '_candidate', lambda _directory, config, *_args: Candidate(
            config.seed, replace(NETWORK, motor_weights=NETWORK.motor_weights + config.seed),
            1.0, (row('forward', 'forward', 0.2 + 0.1 * config.seed),
                  row('backward', 'backward', -0.4))))
        return twin.champion(tmp_path, ear_seeds=1, seeds=[0, 1], vocabulary='default', threads=1,
                             effort=1.0, say=lambda _text: None)
    return make


def test_words_are_held_out_of_every_behaviour():
    assert {'halt', 'suspend'} <= HELD_OUT
    for behaviour in DIRECTION:
        others = [word for word, asked in ROLES.held_out
                  if asked == behaviour and word not in ('halt', 'suspend')]
        assert len(others) >= 2, behaviour
    config = twin.config_of(3, 'default', 0.01)
    assert config.world == 'earth'
    assert not HELD_OUT & {word for word, _asked in config.words}
    assert all(stage.generations >= 1 for stage in config.stages)


def test_who_obeys_more_words_is_chosen_then_who_gets_farther_both_ways():
    def candidate(*rows):
        return Candidate(0, NETWORK, 0.0, rows)

    near, far = ((row('forward', 'forward', way), row('backward', 'backward', -1.0),
                  row('stop', 'stop')) for way in (0.3, 0.6))
    restless = (row('forward', 'forward', 3.0), row('backward', 'backward', -3.0),
                row('stop', 'stop', far=0.2))
    ordered = sorted([candidate(*rows) for rows in (near, restless, far)],
                     key=lambda found: found.order)
    assert [found.table for found in ordered] == [far, near, restless]


def test_the_held_out_words_are_asked_last_and_once(made, tmp_path):
    judge = Gate()
    assert made(judge)
    trained_calls, last = judge.calls[:-1], judge.calls[-1]
    assert not any(HELD_OUT & asked for _words, _starts, asked in trained_calls)
    assert last[2] == HELD_OUT
    assert all(starts == gate.STARTS for _words, starts, _asked in judge.calls)
    champion = controller_file.load(tmp_path / 'champion.json')
    assert champion.body == 'physical_twin'
    assert champion.record['seed'] == 1
    assert champion.record['opened'] == 1
    assert {word.word for word in champion.words} == {word for word, _asked in ROLES.trained}
    told = json.loads((tmp_path / 'table.json').read_text())
    assert [line['word'] for line in told['rows']] == [word for word, _asked in ROLES.every]
    assert told['later'] == [{'word': 'forward', 'seconds': 60.0, 'median_x_m': 2.5,
                              'median_y_m': -0.3}]
    again = Gate()
    assert made(again)
    assert not again.calls, 'all of it was kept'


def test_no_held_out_word_is_asked_of_who_fails(made, tmp_path):
    judge = Gate(disobeyed=('cease',))
    assert not made(judge)
    assert not any(HELD_OUT & asked for _words, _starts, asked in judge.calls)
    assert not (tmp_path / blind.FILE).exists()
    assert not (tmp_path / 'champion.json').exists()


def test_a_broken_final_table_goes_on_with_the_next_word(monkeypatch, tmp_path, vectors):
    class Stopped(Gate):
        def __call__(self, *args, **options):
            if len(self.calls) == 5:
                raise KeyboardInterrupt
            return super().__call__(*args, **options)

    monkeypatch.setattr(gate, 'gate', Stopped())
    with pytest.raises(KeyboardInterrupt):
        twin.final(tmp_path, NETWORK, vectors, 1)
    whole = Gate()
    monkeypatch.setattr(gate, 'gate', whole)
    table = twin.final(tmp_path, NETWORK, vectors, 1)
    asked = [word for word, _asked in ROLES.trained + ROLES.validation]
    assert [line.word for line in table] == asked
    assert len(whole.calls) == len(asked) - 5
    another = replace(NETWORK, motor_weights=2 * NETWORK.motor_weights)
    twin.final(tmp_path, another, vectors, 1)
    assert len(whole.calls) == 2 * len(asked) - 5, 'another controller is asked everything anew'


def test_a_short_run_makes_a_candidate(monkeypatch, tmp_path, vectors):
    monkeypatch.setattr(gate, 'gate', Gate())
    monkeypatch.setattr(twin, 'STAGES', tuple(
        replace(stage, generations=1, moves=1, stops=1, length=0.02) for stage in twin.STAGES))
    config = replace(twin.config_of(0, 'default', 1.0), population=3, physics_steps=2)
    heard = 0.1 * np.random.default_rng(1).normal(size=(1, 5, 6))
    found = twin._candidate(tmp_path / 'seed_0000', config, heard, vectors, 1, print)
    again = twin._candidate(tmp_path / 'seed_0000', config, heard, vectors, 1, print)
    assert found.network.hidden_weights.tobytes() == again.network.hidden_weights.tobytes()
    assert found.network.motor_weights.shape == (12, 5)
    assert found.table == again.table
    assert Layout.of(BODY).genome(found.network).ndim == 1
