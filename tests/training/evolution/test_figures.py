"""Behaviours that read more than the plain figures are evolved: turning, sitting."""

import numpy as np
import pytest

from training.evolution.config import RunConfig
from training.evolution.engines import needs_complete
from training.evolution.run import run
from w2b_core import bodies
from w2b_core.behaviours import BEHAVIOURS, Behaviour
from w2b_core.outcome import FIGURES, Outcome, told
from w2b_core.vocabulary import Vocabulary
from w2b_sim.engines.batched import BatchedEngine
from w2b_sim.engines.interface import Start
from w2b_sim.worlds import WORLDS

WORDS = (('left', 'left'), ('sit', 'sit'), ('stop', 'stop'))


def test_turning_and_sitting_earn_what_the_body_did(tmp_path):
    config = RunConfig(body='quadruped', seed=3, treatment='experimental', generations=2,
                       population=6, starts=1, words=WORDS, held_out=(('right', 'right'),))
    result = run(config, tmp_path / 'run')
    body, vocabulary = bodies.get('quadruped'), Vocabulary.load()
    engine = BatchedEngine(body, WORLDS[body.world], config.precision, complete=True)
    outcome = engine.evaluate(result.network.batched(), np.array(
        [vocabulary.vector(word) for word in ('left', 'sit', 'stop', 'right')]), [Start()])
    score = {word.word: word.score for word in result.outcomes}
    yaw, path = outcome.yaw_rad[0, :, 0], outcome.path_length_m[0, :, 0]
    assert score['left'] == pytest.approx(yaw[0])
    assert score['right'] == pytest.approx(-yaw[3])
    sunk = 1 - outcome.final_position_m[0, 1, 0, 2] / outcome.start_height_m[0, 1, 0]
    assert score['sit'] == pytest.approx(sunk - path[1])
    assert score['stop'] == pytest.approx(-path[2])
    assert np.abs(yaw).max() > 1e-3


def test_plain_behaviours_are_evaluated_by_the_plain_kernel():
    assert not needs_complete(['forward', 'backward', 'stop'])
    assert needs_complete(['forward', 'sit'])


@pytest.mark.parametrize('name', BEHAVIOURS.built_in())
def test_each_behaviour_names_the_figures_that_it_reads(name):
    """With the plain figures and those that it names, and no other, its worth can be told."""
    one = np.ones((1, 1, 1))
    behaviour = BEHAVIOURS.get(name)
    outcome = Outcome(np.ones((1, 1, 1, 3)), one, one, np.zeros((1, 1, 1, 0)),
                      np.ones((1, 1, 1, 2)), one, **dict.fromkeys(behaviour.figures, one))
    assert np.isfinite(behaviour.worth(outcome)).all()
    assert np.isfinite(behaviour.progress(outcome.motion)).all()


def test_a_figure_that_is_none_and_one_that_is_missing_are_named():
    with pytest.raises(ValueError, match=r'figures: expected names of yaw_rad.*, got .speed.'):
        Behaviour('run', True, lambda motion: motion.along_m, lambda motion, bounds: motion.along_m,
                  figures=('speed',))
    one = np.ones((1, 1, 1))
    plain = Outcome(np.ones((1, 1, 1, 3)), one, one, np.zeros((1, 1, 1, 0)))
    for figure in FIGURES:
        with pytest.raises(ValueError, match=f'with {figure}, .*`figures`.*complete=True'):
            told(plain, figure)
