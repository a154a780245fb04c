"""Objectives as pure functions of where the robot went."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from training.evolution.objectives import AGGREGATES, OBJECTIVES, aggregate, scores, total, worst
from w2b_sim.engines.interface import Evaluation

WORDS = ('forward', 'backward', 'stop', 'stop')


def outcome(x, y, path, step, starts=1):
    """An evaluation of one controller under four words that ended at (x, y) in every start."""
    position = np.zeros((1, 4, starts, 3))
    position[..., 0], position[..., 1] = x, y
    return Evaluation(position, np.full((1, 4, starts), path), np.full((1, 4, starts), step),
                      np.zeros((1, 4, starts, 0)))


def test_each_objective_by_hand():
    seen = outcome(0.3, 0.4, 2.0, 0.01)
    assert scores(seen, WORDS, 'program')[0].tolist() == [0.3, -0.3, -2.0, -2.0]
    assert scores(seen, WORDS, 'balanced')[0].tolist() == [0.3, -0.3, -2.0, -2.0]
    assert scores(seen, WORDS, 'paper')[0].tolist() == [0.3, -0.3, -0.5, -0.5]


@pytest.mark.parametrize('objective', OBJECTIVES)
def test_a_step_of_more_than_10_cm_scores_0(objective):
    assert not scores(outcome(5.0, 1.0, 9.0, 0.1001), WORDS, objective).any()
    assert scores(outcome(5.0, 1.0, 9.0, 0.1), WORDS, objective).all()


@pytest.mark.parametrize('objective', OBJECTIVES)
@pytest.mark.parametrize('bad', [np.nan, np.inf, -np.inf])
def test_outcomes_that_are_not_finite_score_0(objective, bad):
    for seen in (outcome(bad, 0.0, 1.0, 0.01), outcome(0.5, bad, 1.0, 0.01),
                 outcome(0.5, 0.0, 1.0, np.nan)):
        assert scores(seen, WORDS, objective).tolist() == [[0.0] * 4]
    assert scores(outcome(0.5, 0.0, bad, 0.01), ('forward',) * 4, objective).all()


def test_starts_are_averaged_and_a_bad_start_counts_0():
    seen = outcome(1.0, 0.0, 1.0, 0.01, starts=4)
    seen.largest_step_m[0, 0, 0] = 0.5
    assert scores(seen, WORDS, 'program')[0].tolist() == [0.75, -1.0, -1.0, -1.0]


def test_controllers_do_not_mix():
    alone = [outcome(x, 0.0, 1.0, 0.01) for x in (0.1, np.nan, 0.3)]
    both = Evaluation(*(np.concatenate([getattr(one, name) for one in alone]) for name in (
        'final_position_m', 'path_length_m', 'largest_step_m', 'touch_fraction')))
    expected = np.concatenate([scores(one, WORDS, 'program') for one in alone])
    assert scores(both, WORDS, 'program').tobytes() == expected.tobytes()


def test_the_sum_and_its_bounds():
    assert total([[1.0, 2.0, -0.5]]) == [2.5]
    assert total([[20.0, 10.0], [20.0, 10.1], [np.nan, 1.0], [np.inf, 1.0], [-np.inf, 1.0],
                  [-40.0, 1.0]]).tolist() == [30.0, 0.0, 0.0, 0.0, 0.0, -39.0]


def test_worst_takes_the_worse_move_and_the_worst_stop():
    assert worst([[3.0, 0.1, -0.2, -0.5]], WORDS).tolist() == [2 * 0.1 - 2 * 0.5]
    assert worst([[0.5, 0.5, -0.2, -0.2]], WORDS) > worst([[2.0, 0.2, -0.2, -0.2]], WORDS)
    assert total([[0.5, 0.5, -0.2, -0.2]]) < total([[2.0, 0.2, -0.2, -0.2]])


@given(st.lists(st.floats(-5, 5), min_size=4, max_size=4))
def test_worst_never_exceeds_the_sum(row):
    assert worst([row], WORDS)[0] <= total([row])[0] + 1e-9


@given(st.lists(st.floats(allow_nan=True, allow_infinity=True), min_size=4, max_size=4),
       st.sampled_from(AGGREGATES))
def test_fitness_is_always_a_number_no_greater_than_30(row, kind):
    fitness = aggregate([row], WORDS, kind)
    assert np.isfinite(fitness).all()
    assert (fitness <= 30).all()


def test_unknown_names_are_refused_with_the_known_ones():
    with pytest.raises(ValueError, match=r"objective: expected .*program.*balanced, got 'x'"):
        scores(outcome(0, 0, 0, 0), WORDS, 'x')
    with pytest.raises(ValueError, match=r"unknown behaviour 'jump': expected one of stop, "):
        scores(outcome(0, 0, 0, 0), ('jump',) * 4, 'program')
    with pytest.raises(ValueError, match="aggregate: expected one of sum, worst, got 'x'"):
        aggregate([[0.0]], ('stop',), 'x')
