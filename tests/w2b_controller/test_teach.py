"""`w2b teach`: a word more, the legs to the bit, and what else changed."""

import sys

import numpy as np
import pytest

from tests.w2b_core.legs_controller import controller
from w2b_controller.cli import teach
from w2b_core.controller import file as controller_file
from w2b_core.network.leaky import BLOCKS
from w2b_core.vocabulary import Vocabulary


@pytest.fixture
def run(monkeypatch, capsys):
    def run(*arguments):
        monkeypatch.setattr(sys, 'argv', ['w2b teach', *arguments])
        code = teach.main()
        return code, capsys.readouterr()
    return run


@pytest.fixture
def legs(tmp_path):
    path = tmp_path / 'legs.json'
    controller_file.save(controller(), path)
    return path


def test_a_word_is_added_and_the_legs_stay(run, legs, tmp_path):
    before = controller_file.load(legs)
    word = next(word for word in ('tiptoe', 'waltz', 'gallop') if word not in before.ear.words
                and word in Vocabulary.load())
    code, told = run(word, 'backward', '--controller', str(legs), '--out',
                     str(tmp_path / 'new.json'))
    assert code == 0, told.err
    after = controller_file.load(tmp_path / 'new.json')
    assert after.ear.words[word] == 'backward'
    assert after.ear.understand(word, Vocabulary.load()).behaviour == 'backward'
    for block in BLOCKS:
        assert np.array_equal(getattr(before.network, block.name),
                              getattr(after.network, block.name))
    assert 'other words are answered otherwise now' in told.out
    assert controller_file.load(legs) == before


@pytest.mark.parametrize(('arguments', 'reason'), [
    (('qwxzv', 'stop'), 'qwxzv'), (('gallop', 'fly'), 'behaviour: expected one of stop, '),
    (('stop', 'forward'), 'stops in any sentence'), (('not', 'forward'), 'negation')])
def test_what_cannot_be_taught_is_refused_and_nothing_written(run, legs, arguments, reason):
    text = legs.read_text()
    code, told = run(*arguments, '--controller', str(legs))
    assert code == 2
    assert reason in told.err
    assert told.err.count('\n') == 1
    assert legs.read_text() == text


def test_a_controller_without_an_ear_and_one_that_ships_are_refused(run, tmp_path):
    code, told = run('gallop', 'forward', '--controller', 'quadruped_all_engines', '--out',
                     str(tmp_path / 'new.json'))
    assert code == 2
    assert 'expected a controller with an ear' in told.err
    code, told = run('gallop', 'forward', '--controller', 'quadruped_all_engines')
    assert code == 2
    assert 'give --out FILE.json' in told.err
    assert not list(tmp_path.iterdir())
