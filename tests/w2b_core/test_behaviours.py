"""Every behaviour: what it earns, and when it counts as obeyed."""

from math import pi

import numpy as np
import pytest

from w2b_core.behaviours import BEHAVIOURS, Bounds
from w2b_core.outcome import Motion, Outcome

BOUNDS = Bounds(move_m=0.3, still_m=0.1)
#: Behaviour -> what a body does that shows it.
SHOWN = {
    'stop': {'x': 0.0}, 'forward': {'x': 0.5}, 'backward': {'x': -0.5}, 'left': {'yaw': pi / 2},
    'right': {'yaw': -pi / 2}, 'sit': {'height': 0.6},
}


def outcome(x: float = 0.0, y: float = 0.0, yaw: float = 0.0, height: float = 1.0) -> Outcome:
    """One controller, word and start; the base began 0.2 m high."""
    one = np.ones((1, 1, 1))
    return Outcome(np.array([x, y, 0.2 * height]).reshape(1, 1, 1, 3), np.hypot(x, y) * one,
                   0.01 * one, np.zeros((1, 1, 1, 0)), yaw_rad=yaw * one, start_height_m=0.2 * one)


@pytest.mark.parametrize('name', BEHAVIOURS.names())
def test_a_body_that_shows_a_behaviour_obeys_it_and_no_other_move(name):
    seen = outcome(**SHOWN[name])
    shown = {other for other in BEHAVIOURS
             if BEHAVIOURS.get(other).obeyed(seen.motion, BOUNDS).all()}
    # Who turns or sits on the spot has stopped, too.
    assert shown - {'stop'} == {name} - {'stop'}
    assert ('stop' in shown) == (abs(SHOWN[name].get('x', 0.0)) < BOUNDS.still_m)


@pytest.mark.parametrize('name', BEHAVIOURS.names())
def test_nothing_earns_more_than_what_was_asked_for(name):
    behaviour = BEHAVIOURS.get(name)
    earned = {other: float(behaviour.worth(outcome(**motion))[0, 0, 0])
              for other, motion in SHOWN.items()}
    assert earned[name] == max(earned.values())
    assert behaviour.worth(outcome(**SHOWN[name])).shape == (1, 1, 1)


@pytest.mark.parametrize('name', ['left', 'right', 'sit'])
def test_a_figure_that_the_engine_did_not_tell_is_asked_for_by_name(name):
    silent = Motion(np.zeros(1), np.zeros(1))
    with pytest.raises(ValueError, match=r'expected an evaluation with (yaw_rad|height)'):
        BEHAVIOURS.get(name).progress(silent)


def test_moves_are_those_that_a_stop_word_must_beat():
    assert {name for name in BEHAVIOURS if BEHAVIOURS.get(name).moves} == {
        'forward', 'backward', 'left', 'right'}
