"""Scores as bounded pure functions: over every behaviour, and what they prefer."""

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from training.legs.parts import FIGURES
from training.legs.recipe import load_recipe
from training.legs.scores import Scores
from w2b_sim.recording import PhaseOutcome

RECIPE = load_recipe(Path(__file__).resolve().parents[3] / 'training' / 'recipes' / 'twin.yaml')
SCORES = Scores(RECIPE)
#: A robot that stands as it began.
STILL = PhaseOutcome(**{**{field.name: np.zeros(1) for field in fields(PhaseOutcome)},
                        'seconds': 4.0, 'height_m': np.full(1, 0.078),
                        'start_height_m': np.full(1, 0.078), 'lowest_m': np.full(1, 0.078),
                        'final_height_m': np.full(1, 0.078), 'lowest_up': np.ones(1),
                        'torque_nm': np.full(1, 0.03), 'rhythm_hz': np.zeros(1)})


def test_every_figure_that_a_recipe_may_name_exists():
    assert set(SCORES.figures('forward', STILL, 0.0)) == set(FIGURES)


def with_(**values):
    return replace(STILL, **{name: np.full(1, value) for name, value in values.items()})


WALK = {'going_m_s': 0.17, 'along_m': 0.6, 'rhythm_hz': 1.5, 'fastest_joint_hz': 1.7}


@pytest.mark.parametrize('behaviour', RECIPE.behaviours)
def test_scores_stay_between_minus_one_and_one(behaviour):
    rng = np.random.default_rng(0)
    wild = PhaseOutcome(**{field.name: 4.0 if field.name == 'seconds'
                           else rng.normal(scale=3, size=500) for field in fields(PhaseOutcome)})
    wild = replace(wild, lowest_up=np.ones(500), start_height_m=np.full(500, 0.08))
    score = SCORES.score(behaviour, wild, 0.1)
    assert (np.abs(score) <= 1).all()
    assert SCORES.score(behaviour, with_(lowest_up=0.2)) == -1
    assert SCORES.score(behaviour, with_(going_m_s=np.nan, drift_m=np.nan, turning_rad_s=np.nan,
                                         lowest_up=1.0)) == -1


def test_walking_the_other_way_is_worse_than_standing_and_that_worse_than_walking():
    scores = [SCORES.score('backward', with_(**{**WALK, 'going_m_s': speed, 'along_m': 4 * speed}))
              for speed in (0.17, 0.0, -0.17)]
    assert scores == sorted(scores)
    assert scores[0] < 0 == scores[1] < 0.8 < scores[2]


def test_a_lunge_earns_nothing():
    assert SCORES.score('forward', with_(along_m=0.5, going_m_s=0.0)) == 0


@pytest.mark.parametrize('fault', [
    {'yaw_rad': 0.3}, {'across_m': 0.2}, {'rhythm_hz': 3.0}, {'fastest_joint_hz': 2.6},
    {'at_speed_limit': 0.2}, {'torque_nm': 0.1}, {'tilt': 0.1}])
def test_every_fault_costs_but_does_not_make_standing_better(fault):
    clean = SCORES.score('forward', with_(**WALK))
    faulty = SCORES.score('forward', with_(**{**WALK, **fault}))
    assert 0 < faulty < 0.97 * clean


def test_the_heading_to_hold_is_the_offset():
    turned = with_(**{**WALK, 'yaw_rad': 0.2, 'across_m': 0.6 * np.sin(0.2),
                      'along_m': 0.6 * np.cos(0.2), 'going_m_s': 0.17 * np.cos(0.2)})
    assert SCORES.score('forward', turned, 0.2) == pytest.approx(
        float(SCORES.score('forward', with_(**WALK))[0]), abs=0.01)
    assert SCORES.score('forward', turned, 0.0) < 0.8 * SCORES.score('forward', with_(**WALK))


def test_a_turn_on_the_spot_beats_one_that_drifts_or_spins():
    turn = {'turning_rad_s': 0.23, 'yaw_rad': 0.9}
    good = SCORES.score('left', with_(**turn))
    assert good > 0.8
    assert SCORES.score('left', with_(**turn, along_m=0.1)) < 0.8 * good
    assert SCORES.score('left', with_(turning_rad_s=0.5, yaw_rad=2.0)) < 0.6 * good
    assert SCORES.score('right', with_(**turn)) < 0


def test_stop_stands_and_sit_lowers_the_base_and_rests():
    down = with_(height_m=0.02, final_height_m=0.02, torque_nm=0.005)
    assert SCORES.score('stop', STILL) > 0.9 > SCORES.score('stop', down)
    assert SCORES.score('sit', down) > 0.85 > 0.4 > SCORES.score('sit', STILL)
    assert SCORES.score('stop', with_(drift_m=0.05)) < 0.5
    assert SCORES.score('sit', replace(down, torque_nm=np.full(1, 0.05))) < 0.6
