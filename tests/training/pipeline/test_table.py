"""Tables of trials: what is obeyed, what is required, what is an explosion."""

import json

import numpy as np
import pytest

from training.pipeline.table import (
    from_json,
    passes,
    rows,
    shorter_way,
    to_json,
    to_markdown,
    worst_margin,
)
from w2b_sim.engines.interface import Evaluation


def outcome(rows):
    position = np.zeros((1, len(rows), len(rows[0]), 3))
    position[0, :, :, 0] = rows
    return Evaluation(position, np.abs(position[..., 0]), 0 * position[..., 0],
                      np.zeros((*position.shape[:3], 0)))


def test_the_gate_row_by_row():
    words = (('forward', 'forward'), ('backward', 'backward'), ('stop', 'stop'))
    still = [0.01] * 18 + [0.09] * 2
    table = rows(outcome([[0.6] * 20, [-0.6] * 20, still, still, [0.1] * 20]), words,
                 (('halt', 'stop'), ('ahead', 'forward')), 0.5)
    assert [row.passed for row in table] == [True, True, True, True, False]
    assert passes(table), 'a held-out move word is told, not required'
    assert worst_margin(table, 0.5) == pytest.approx(1.2)
    restless = [0.01] * 17 + [0.2] * 3
    assert not passes(rows(outcome([[0.6] * 20, [-0.6] * 20, still, restless]), words,
                           (('halt', 'stop'),), 0.5))
    tolerable = [0.01] * 18 + [0.2] * 2
    assert passes(rows(outcome([[0.6] * 20, [-0.6] * 20, tolerable]), words, (), 0.5))
    markdown = to_markdown(table)
    assert '| halt | stop | **held out** | +0.01' in markdown
    assert from_json(json.loads(json.dumps(to_json(table)))) == table


def test_validation_words_are_told_and_not_required():
    words = (('forward', 'forward'), ('backward', 'backward'), ('stop', 'stop'))
    table = rows(outcome([[0.6] * 20, [-0.6] * 20, [0.0] * 20, [0.3] * 20, [0.0] * 20]),
                 words, (('halt', 'stop'),), 0.5, validation=(('abort', 'stop'),))
    assert [row.validation for row in table] == [False, False, False, True, False]
    assert [row.required for row in table] == [True, True, True, False, True]
    assert [row.passed for row in table] == [True, True, True, False, True]
    assert passes(table)
    assert shorter_way(table) == pytest.approx(0.6)
    assert '| abort | stop | validation |' in to_markdown(table)


def test_explosions_pass_no_gate():
    words = (('forward', 'forward'), ('backward', 'backward'), ('stop', 'stop'))
    far = [300.0] * 20
    table = rows(outcome([far, [-0.6] * 20, [np.nan] * 3 + [0.0] * 17]), words, (), 0.5)
    assert [row.passed for row in table] == [False, True, False]
    assert table[0].explosions == 20
    assert table[2].explosions == 3
    json.dumps(to_json(table), allow_nan=False)
