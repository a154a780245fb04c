"""The shipped primed quadruped is what its record says, and passes its gate from other starts."""

import json
from pathlib import Path

import numpy as np
import pytest

from training.pipeline.recipe import load_recipe, shipped
from training.pipeline.table import from_json, passes, to_markdown
from training.pipeline.trials import trial, weights_sha256
from w2b_core import bodies
from w2b_core.controller import file as controller_file
from w2b_core.network import Network
from w2b_core.vocabulary import Vocabulary
from w2b_sim.worlds import PAPER

RECIPE = load_recipe(shipped()['quadruped'])
QUADRUPED = RECIPE.words
TABLES = Path(__file__).resolve().parents[3] / 'docs' / 'champions'


@pytest.fixture(scope='module')
def champion():
    return controller_file.load(controller_file.shipped('quadruped_serial'))


def test_its_words_and_record_are_the_champions_command_s(champion):
    assert tuple((word.word, word.behaviour) for word in champion.words) == QUADRUPED.trained
    assert champion.record['mode'] == 'robust'
    for role in ('trained', 'validation', 'held_out'):
        assert tuple(map(tuple, champion.record['words'][role])) == getattr(QUADRUPED, role)
    evolved_on = {word for word, _asked in champion.record['config']['words']}
    assert not evolved_on & {word for word, _asked in QUADRUPED.held_out + QUADRUPED.validation}
    vocabulary = Vocabulary.load()
    for word in champion.words:
        assert controller_file.vector_sha256(vocabulary.vector(word.word)) == word.sha256


def test_its_table_tells_every_word_and_how_many_were_opened(champion):
    told = json.loads((TABLES / 'quadruped_serial.json').read_text(encoding='utf-8'))
    assert [row['word'] for row in told['rows']] == [word for word, _asked in QUADRUPED.every]
    assert told['opened'] == champion.record['opened'] >= 1
    assert champion.record['weights_sha256'] == weights_sha256(champion.network)
    assert told['rows'] == champion.record['gate']['rows']
    markdown = (TABLES / 'quadruped_serial.md').read_text(encoding='utf-8')
    assert to_markdown(from_json(told['rows'])) in markdown


def test_its_touch_sensors_are_in_use(champion):
    touch = champion.network.hidden_weights[:, champion.network.hidden_count + 1:]
    assert (touch != 0).all()


def test_it_obeys_in_pybullet(champion):
    stops = tuple(pair for pair in QUADRUPED.held_out if pair[1] == 'stop')
    vocabulary = Vocabulary.load()
    vectors = {word: vocabulary.vector(word) for word, _asked in QUADRUPED.trained + stops}
    table = trial(champion.network, bodies.get(RECIPE.body), PAPER, QUADRUPED.trained, stops,
                  vectors, move_m=RECIPE.move_m, starts=3, seed=99)
    assert passes(table), to_markdown(table)


def test_touch_changes_what_it_does(champion):
    network, body = champion.network, bodies.get(RECIPE.body)
    numb = network.hidden_weights.copy()
    numb[:, network.hidden_count + 1:] = 0.0
    both = Network(np.array([network.hidden_weights, numb]), np.array([network.motor_weights] * 2),
                   network.motor_time_constants)
    from training.evolution.engines import make_evaluator
    from w2b_sim.engines.interface import Start

    judge = make_evaluator('batched', body, PAPER)
    vocabulary = Vocabulary.load()
    signals = np.array([vocabulary.vector(word) for word in ('forward', 'backward')])
    end = judge.evaluate(both, signals, (Start(),)).final_position_m[:, :, 0, :2]
    assert (np.linalg.norm(end[0] - end[1], axis=-1) > 0.02).any()
