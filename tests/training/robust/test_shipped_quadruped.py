"""The shipped quadruped passes the gate it claims to have passed, from other starts."""

import pytest

from training.robust import gate
from training.robust.champions import HELD_OUT, MOVE_M, TRAINED
from w2b_controller import controller_file
from w2b_controller.vocabulary import Vocabulary
from w2b_sim import bodies
from w2b_sim.worlds import PAPER


@pytest.fixture(scope='module')
def shipped():
    return controller_file.load(controller_file.shipped('quadruped'))


def test_its_words_and_record_are_the_champions_command_s(shipped):
    assert tuple((word.word, word.behaviour) for word in shipped.words) == TRAINED
    assert shipped.record['mode'] == 'robust'
    assert [tuple(pair) for pair in shipped.record['held_out']] == list(HELD_OUT)
    vocabulary = Vocabulary.load()
    for word in shipped.words:
        assert controller_file.vector_sha256(vocabulary.vector(word.word)) == word.sha256


def test_its_touch_sensors_are_in_use(shipped):
    touch = shipped.network.hidden_weights[:, shipped.network.hidden_count + 1:]
    assert (touch != 0).all()


def test_it_obeys_in_pybullet(shipped):
    stops = tuple(pair for pair in HELD_OUT if pair[1] == 'stop')
    vocabulary = Vocabulary.load()
    vectors = {word: vocabulary.vector(word) for word, _asked in TRAINED + stops}
    table = gate.gate(shipped.network, bodies.get('quadruped'), PAPER, TRAINED, stops, vectors,
                      move_m=MOVE_M['quadruped'], starts=3, seed=99)
    assert gate.passes(table), gate.to_markdown(table)
