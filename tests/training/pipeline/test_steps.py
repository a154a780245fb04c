"""From random numbers to a champion: ears, careful mutation, the choice, and the blind look."""

import argparse
import json
from dataclasses import replace

import numpy as np
import pytest

from training.evolution.operators import Layout, random_genomes
from training.evolution.starts import slightly_different
from training.evolution.treatments import GATE, generator
from training.robust import blind, ears, gate, lineage, quadruped, rest
from training.robust.careful import careful_mutation
from training.robust.hidden_life import live
from training.robust.lineage import Candidate, Lineage
from training.robust.listening import Listening
from training.robust.word_roles import QUADRUPED, WordRoles
from w2b_core import bodies
from w2b_core.controller import file as controller_file
from w2b_core.network import Network
from w2b_core.vocabulary import Vocabulary
from w2b_sim.engines.pybullet_evaluator import PyBulletEvaluator
from w2b_sim.worlds import PAPER

BODY = bodies.get('quadruped')
LAYOUT = Layout.of(BODY)
PLAN = Listening(1, 100, population=30, moves=2, stops=4)
ROLES = WordRoles((('forward', 'forward'), ('backward', 'backward'), ('stop', 'stop'),
                   ('cease', 'stop')), (('abort', 'stop'),), (('halt', 'stop'),))


@pytest.fixture(scope='module')
def vectors():
    vocabulary = Vocabulary.load()
    return {word: vocabulary.vector(word) for word, _asked in QUADRUPED.trained
            + QUADRUPED.validation}


@pytest.fixture(scope='module')
def walker(vectors, tmp_path_factory):
    """A controller whose hidden layer rests under stop and cease, with two rhythms."""
    found, screen = ears.find(tmp_path_factory.mktemp('ears'), ROLES, vectors, LAYOUT, 6, PLAN,
                              print)
    assert screen.trained[0] == 1.0
    hidden = np.zeros((5, 10))
    hidden[:, :6] = found[0]
    return LAYOUT.network(np.concatenate([hidden.ravel(), np.full(40, 0.5)]))


def unrest(genomes, signals):
    life = live(LAYOUT.network(genomes).hidden_weights, signals)
    return np.minimum(1.0, np.sqrt((life.swing**2).mean(axis=-1)) / 0.1).sum(axis=1)


def test_careful_children_go_on_hearing(vectors, walker):
    heard = ears.heard_of(ROLES.trained, vectors)
    parents = np.repeat(LAYOUT.genome(walker)[None], 400, axis=0)
    mutation = careful_mutation(heard, 5)
    children = mutation(np.random.default_rng(1), parents, LAYOUT)
    again = mutation(np.random.default_rng(1), parents, LAYOUT)
    assert children.tobytes() == again.tobytes()
    changed = (children[:, :LAYOUT.hidden_size] != parents[:, :LAYOUT.hidden_size]).any(axis=1)
    assert 0 < changed.mean() < 0.3
    assert (children[:, LAYOUT.hidden_size:] != parents[:, LAYOUT.hidden_size:]).any()
    careless = parents.copy()
    careless[:, :LAYOUT.hidden_size] *= 1 + 0.3 * np.random.default_rng(2).standard_normal(
        (400, LAYOUT.hidden_size))
    before, after, otherwise = (unrest(genomes, heard['stop'])
                                for genomes in (parents[:1], children, careless))
    # A word may be lost where a noisy one is won: seldom.
    assert (after > before + 0.5).mean() < 0.02
    assert (otherwise > before + 0.5).mean() > 0.1


def test_the_screen_counts_words_and_wants_two_rhythms(vectors, walker):
    deaf = np.zeros((1, 5, 6))
    found = ears.screen(deaf, ROLES, vectors)
    assert found.trained[0] == 0.5, 'it rests under stop and cease, and under the moves'
    assert found.validation[0] == 1.0
    assert not found.two[0]
    assert len(found.order()) == 0
    both = ears.screen(np.concatenate([deaf, walker.hidden_weights[None, :, :6]]), ROLES, vectors)
    assert both.two.tolist() == [False, True]
    assert both.order().tolist() == [1]
    assert both.trained[1] == 1.0


def test_rest_is_told_word_by_word_and_hangs_on_the_feet(vectors, walker, capsys):
    signals = np.array([vectors[word] for word, _asked in ROLES.trained])
    assert rest.rests(walker, signals, 0.0).tolist() == [False, False, True, True]
    # A strong input from the feet holds every neuron where it is.
    heavy = walker.hidden_weights.copy()
    heavy[:, 6:] = 20.0
    standing = replace(walker, hidden_weights=heavy)
    assert rest.rests(standing, signals, 0.0).tolist() == [False, False, True, True]
    assert rest.rests(standing, signals, 1.0).all()
    assert rest.main(argparse.Namespace(controller='nobody', vocabulary='default')) == 2
    assert 'nobody' in capsys.readouterr().err


def test_ears_are_found_once(tmp_path, vectors):
    said = []
    first, screen = ears.find(tmp_path, ROLES, vectors, LAYOUT, 6, PLAN, said.append)
    again, _screen = ears.find(tmp_path, ROLES, vectors, LAYOUT, 6, PLAN, said.append)
    assert len(said) == 6
    assert first.tobytes() == again.tobytes()
    assert screen.two.all()
    assert len(first) <= ears.KEEP
    assert len(set(screen.trained)) == len(set(screen.validation)) == 1, 'none that sorts fewer'
    assert (np.diff(screen.sturdy) <= 0).all(), 'best first'
    with pytest.raises(ValueError, match='holds another run'):
        ears.find(tmp_path, replace(ROLES, trained=(*ROLES.trained, ('stay', 'stop'))), vectors,
                  LAYOUT, 6, PLAN, said.append)


def row(word, x, far, **more):
    return gate.Row(word, {'forward': 'forward', 'backward': 'backward'}.get(word, 'stop'), True,
                    x, x, x, far, 0.0, 0, more.pop('passed', True), **more)


def table(forward, backward, *stops):
    return (row('forward', forward, 1.0), row('backward', backward, 1.0),
            *(row(f'stop{number}', 0.0, far, passed=far <= 0.1)
              for number, far in enumerate(stops)))


def test_candidates_that_obey_more_words_come_first_then_those_that_get_farther(tmp_path):
    line = Lineage(tmp_path, 'quadruped', ROLES, 'default', {}, 0.5)
    network = Network(np.zeros((5, 10)), np.zeros((8, 5)), np.ones(8))
    far, near, restless = (Candidate(seed, 0, network, 0.0, rows) for seed, rows in enumerate((
        table(1.0, -0.9, 0.05, 0.05), table(0.6, -2.0, 0.05, 0.05), table(2.0, -2.0, 0.05, 0.3))))
    assert sorted([restless, near, far], key=line.order) == [far, near, restless]


def test_who_gets_farthest_both_ways_is_a_candidate(monkeypatch, tmp_path):
    ways = [0.1, 0.9, 0.4, 0.8, 0.2]

    def gated(network, body, world, words, held_out, vectors, *, validation, seed, **_options):
        assert {word for word, _asked in words} == {'forward', 'backward'}
        assert not held_out
        assert not validation
        assert seed not in (lineage.WALK_GATE, lineage.CHOICE_GATE, lineage.FINAL_GATE)
        way = ways[round(float(network.motor_weights[0, 0]))]
        return row('forward', 2.0, 2.0), row('backward', -way, way)

    monkeypatch.setattr(gate, 'gate', gated)
    line = Lineage(tmp_path, 'quadruped', ROLES, 'default', {}, 0.5)
    population = Network(np.zeros((5, 5, 10)), np.arange(5.0)[:, None, None] * np.ones((1, 8, 5)),
                         np.ones(8))
    assert line._scouted(population) == [1, 3]


class Spy:
    """A vocabulary that remembers which words were looked up."""

    def __init__(self):
        self.words = Vocabulary.load()
        self.asked = set()

    def vector(self, word):
        self.asked.add(word)
        return self.words.vector(word)


HELD_OUT = {word for word, _asked in QUADRUPED.held_out}


@pytest.fixture
def spied(monkeypatch):
    spy = Spy()
    monkeypatch.setattr(quadruped.Vocabulary, 'load', lambda name: spy)
    return spy


def make(directory):
    return quadruped.champion(directory, ear_seeds=1, seeds=[0], keep=1, vocabulary='default',
                              threads=1, effort=1.0)


def test_no_held_out_word_is_looked_up_unless_a_candidate_is_chosen(monkeypatch, tmp_path, spied,
                                                                    walker, capsys):
    candidate = Candidate(0, 0, walker, 1.0, table(1.0, -1.0, 0.05))
    monkeypatch.setattr(Lineage, 'evolve', lambda *_args: [candidate])
    monkeypatch.setattr(Lineage, 'final', lambda *_args: table(1.0, -1.0, 0.3))
    assert not make(tmp_path)
    assert 'nothing was chosen and no held-out word asked' in capsys.readouterr().out
    assert not spied.asked & HELD_OUT
    assert not (tmp_path / blind.FILE).exists()


def test_the_chosen_one_is_asked_once_and_counted(monkeypatch, tmp_path, spied, walker):
    looks = []

    def gated(network, body, world, words, held_out, vectors, **options):
        assert not words
        assert set(vectors) == HELD_OUT
        looks.append(blind.weights_sha256(network))
        return tuple(replace(row(word, 0.0, 0.05), behaviour=asked, trained=False)
                     for word, asked in held_out)

    def choose(network):
        monkeypatch.setattr(Lineage, 'evolve', lambda *_args: [
            Candidate(3, 0, network, 1.0, table(1.0, -1.0, 0.05))])

    obeyed = tuple(replace(row(word, {'forward': 1.0, 'backward': -1.0}.get(asked, 0.0), 0.05),
                           behaviour=asked) for word, asked in QUADRUPED.trained)
    monkeypatch.setattr(gate, 'gate', gated)
    monkeypatch.setattr(Lineage, 'final', lambda *_args: obeyed)
    monkeypatch.setattr(Lineage, 'numb', lambda *_args: obeyed)
    monkeypatch.setattr(Lineage, 'later', lambda *_args: (gate.Later('forward', 60.0, 2.5, -0.3),))
    choose(walker)
    assert make(tmp_path)
    assert make(tmp_path)
    assert looks == [blind.weights_sha256(walker)], 'the second look is the first one, kept'
    champion = controller_file.load(tmp_path / 'champion.json')
    assert champion.record['opened'] == 1
    assert {word.word for word in champion.words} == {word for word, _asked in QUADRUPED.trained}
    choose(replace(walker, motor_weights=2 * walker.motor_weights))
    assert make(tmp_path)
    assert json.loads((tmp_path / 'table.json').read_text())['opened'] == 2
    assert len(looks) == 2
    told = (tmp_path / 'champion.md').read_text()
    assert told.endswith('60 s after *forward*: x +2.50 m, y -0.30 m (medians of 5 starts).\n')


def test_later_is_where_pybullet_has_the_robot_then(vectors, walker):
    places = gate.later(walker, BODY, PAPER, ROLES.trained, vectors, seconds=2.0, starts=3, seed=4)
    assert [place.word for place in places] == ['forward', 'backward']
    starts = slightly_different(generator(4, GATE), 3)
    with PyBulletEvaluator(BODY, replace(PAPER, steps=40)) as judge:
        alone = judge.evaluate(replace(
            walker, hidden_weights=walker.hidden_weights[None],
            motor_weights=walker.motor_weights[None]), np.array([vectors['backward']]), starts)
    assert (places[1].median_x_m, places[1].median_y_m) == pytest.approx(
        tuple(np.median(alone.final_position_m[0, 0, :, :2], axis=0)))


def test_a_damaged_record_of_openings_is_an_error(tmp_path, walker):
    (tmp_path / blind.FILE).write_text('{"openings": ')
    with pytest.raises(ValueError, match='not a readable record of openings'):
        blind.look(tmp_path, walker, BODY, PAPER, QUADRUPED.held_out, Vocabulary.load(),
                   move_m=0.5)


def test_a_walk_below_the_bound_is_discarded_and_kept_as_such(monkeypatch, tmp_path, vectors):
    monkeypatch.setattr(lineage, 'STAGES', tuple(
        replace(stage, generations=2, moves=1, stops=1, length=0.1) for stage in lineage.STAGES))
    monkeypatch.setattr(lineage, 'LEAST_FITNESS', (-9.0, 9.0))
    monkeypatch.setattr(gate, 'gate', None)
    monkeypatch.setattr(ears, 'find', lambda *_args: (
        random_genomes(np.random.default_rng(0), 3, LAYOUT)[:, :30].reshape(3, 5, 6), None))
    said = []
    line = Lineage(tmp_path, 'quadruped', QUADRUPED, 'default', vectors, 0.5, say=said.append)
    assert line.evolve(1, [4], 1) == []
    assert json.loads((tmp_path / 'seed_0004' / 'walk.json').read_text())['rows'] is None
    assert said[0].endswith('after stage 2, discarded')
