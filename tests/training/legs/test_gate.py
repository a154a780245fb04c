"""The gate of legs: what evolved in one engine and is not seen in the others does not ship."""

import pytest

from training.legs import gate

WALK = {'body_lengths_per_s': 0.8, 'turning_deg_s': 0.0}
EVOLVED = {'stop': {'body_lengths_per_s': 0.0, 'turning_deg_s': 0.0},
           'forward': WALK, 'backward': WALK,
           'left': {'body_lengths_per_s': 0.0, 'turning_deg_s': 10.0},
           'right': {'body_lengths_per_s': 0.0, 'turning_deg_s': -10.0}}
STILL = {'body_lengths_per_s': 0.0, 'worst_body_lengths_per_s': 0.0, 'heading_error_deg': 1.0,
         'worst_heading_error_deg': 2.0, 'yaw_deg': 0.0, 'displacement_m': 0.002,
         'worst_displacement_m': 0.003, 'worst_drift_m': 0.001, 'falls': 0}
SEEN = {'stop': STILL,
        **{name: {**STILL, 'body_lengths_per_s': 0.7, 'worst_body_lengths_per_s': 0.6}
           for name in ('forward', 'backward')},
        'left': {**STILL, 'yaw_deg': 90.0}, 'right': {**STILL, 'yaw_deg': -90.0}}
JUDGED = {'pybullet': SEEN, 'mujoco': SEEN}


def changed(engine, behaviour, **figures):
    seen = JUDGED[engine]
    return {**JUDGED, engine: {**seen, behaviour: {**seen[behaviour], **figures}}}


def test_what_both_engines_see_ships_and_reaches_the_bounds():
    assert gate.refusals(EVOLVED, JUDGED) == []
    assert gate.misses(JUDGED) == []


@pytest.mark.parametrize(('judged', 'message'), [
    (changed('mujoco', 'backward', body_lengths_per_s=0.39),
     'mujoco: backward at 0.39 body lengths/s, evolved 0.80: expected at least 50% of it'),
    (changed('pybullet', 'forward', body_lengths_per_s=-0.8), 'pybullet: forward at -0.80'),
    (changed('pybullet', 'right', yaw_deg=-49.0),
     'pybullet: right at 4.90 degrees/s, evolved 10.00'),
    (changed('mujoco', 'left', yaw_deg=-90.0), 'mujoco: left at -9.00'),
    (changed('mujoco', 'stop', falls=1), 'mujoco: falls in 1 starts under stop')])
def test_less_than_half_of_the_evolved_way_in_either_engine_is_refused(judged, message):
    [line] = gate.refusals(EVOLVED, judged)
    assert line.startswith(message)


def test_half_of_the_way_is_enough_and_legs_that_never_walked_are_not():
    assert gate.refusals(EVOLVED, changed('mujoco', 'forward', body_lengths_per_s=0.41)) == []
    stands = {**EVOLVED, 'forward': {**WALK, 'body_lengths_per_s': -0.01}}
    assert len(gate.refusals(stands, JUDGED)) == 2


@pytest.mark.parametrize(('judged', 'message'), [
    (changed('mujoco', 'forward', body_lengths_per_s=0.45),
     'mujoco: forward at 0.45 of 0.5 body lengths/s'),
    (changed('pybullet', 'backward', worst_heading_error_deg=25.0),
     'pybullet: backward leaves its heading by 25 degrees, more than 20'),
    (changed('pybullet', 'left', yaw_deg=22.0), 'pybullet: left turns by 22 of 30 degrees'),
    (changed('mujoco', 'right', yaw_deg=60.0), 'mujoco: right turns by -60 of 30 degrees'),
    (changed('mujoco', 'stop', worst_displacement_m=0.081),
     'mujoco: stop shifts by 81 mm, more than 10'),
    (changed('mujoco', 'stop', worst_drift_m=0.02), 'mujoco: stop shifts by 20 mm')])
def test_a_missed_bound_is_said_with_how_much_is_missing(judged, message):
    [line] = gate.misses(judged)
    assert line.startswith(message)


def test_the_table_has_a_row_for_each_engine_and_behaviour():
    lines = gate.table(JUDGED).splitlines()
    assert len(lines) == 2 + 2 * len(SEEN)
    assert '| mujoco | forward | 0.70 (0.60) | 1.0 (2.0) degrees |  |  | 0 |' in lines
    assert '| pybullet | right |  |  | -90 degrees | 2 (3) mm | 0 |' in lines
    assert '| pybullet | stop |  |  |  | 2 (3) mm | 0 |' in lines
