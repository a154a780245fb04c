"""Trials in PyBullet, and the blind look: once, and counted."""

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.training.pipeline.walker import RECIPE, ROLES, found_walker, known_vectors
from training.evolution.starts import slightly_different
from training.evolution.treatments import GATE, generator
from training.pipeline import blind, trials
from training.pipeline.table import Row
from w2b_core import bodies
from w2b_core.vocabulary import Vocabulary
from w2b_sim.engines.pybullet_evaluator import PyBulletEvaluator
from w2b_sim.worlds import PAPER

BODY = bodies.get('quadruped')
HELD_OUT = {word for word, _asked in RECIPE.words.held_out}


@pytest.fixture(scope='module')
def walker(tmp_path_factory):
    return found_walker(tmp_path_factory.mktemp('ears'))


def test_a_controller_is_looked_at_once_and_counted(monkeypatch, tmp_path, walker):
    looks = []

    def trial(network, body, world, words, held_out, vectors, **options):
        assert not words
        assert set(vectors) == HELD_OUT
        looks.append(trials.weights_sha256(network))
        return tuple(Row(word, asked, False, 0.0, 0.0, 0.0, 0.05, 0.0, 0, True)
                     for word, asked in held_out)

    def look(network):
        return blind.look(tmp_path, network, BODY, PAPER, RECIPE.words.held_out,
                          Vocabulary.load(), move_m=0.5, starts=20)

    monkeypatch.setattr(trials, 'trial', trial)
    first, opened = look(walker)
    again, still = look(walker)
    assert looks == [trials.weights_sha256(walker)], 'the second look is the first one, kept'
    assert first == again
    assert opened == still == 1
    assert look(replace(walker, motor_weights=2 * walker.motor_weights))[1] == 2
    assert len(json.loads((tmp_path / blind.FILE).read_text())['openings']) == 2


def test_a_damaged_record_of_openings_is_an_error(tmp_path, walker):
    (tmp_path / blind.FILE).write_text('{"openings": ')
    with pytest.raises(ValueError, match='not a readable record of openings'):
        blind.look(tmp_path, walker, BODY, PAPER, RECIPE.words.held_out, Vocabulary.load(),
                   move_m=0.5, starts=20)


def test_word_by_word_is_the_same_as_all_at_once(tmp_path, walker):
    vectors, short = known_vectors(), replace(PAPER, steps=30)
    loud = replace(walker, motor_weights=3 * walker.motor_weights)
    at_once = trials.trial(loud, BODY, short, ROLES.trained, (), vectors, move_m=0.5, starts=2,
                           seed=1, validation=ROLES.validation)
    with PyBulletEvaluator(BODY, short) as evaluator:
        kept = trials.kept_trial(tmp_path, loud, BODY, short, ROLES.trained, vectors,
                                 validation=ROLES.validation, move_m=0.5, starts=2, seed=1,
                                 evaluator=evaluator)
    assert kept == at_once
    assert any(abs(row.median_x_m) > 1e-3 for row in kept)


def test_later_is_where_pybullet_has_the_robot_then(walker):
    vectors = known_vectors()
    places = trials.later(walker, BODY, PAPER, ROLES.trained, vectors, seconds=2.0, starts=3,
                          seed=4)
    assert [place.word for place in places] == ['forward', 'backward']
    starts = slightly_different(generator(4, GATE), 3)
    with PyBulletEvaluator(BODY, replace(PAPER, steps=40)) as judge:
        alone = judge.evaluate(walker.batched(), np.array([vectors['backward']]), starts)
    assert (places[1].median_x_m, places[1].median_y_m) == pytest.approx(
        tuple(np.median(alone.final_position_m[0, 0, :, :2], axis=0)))
