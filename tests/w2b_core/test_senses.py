"""The table of senses and what they read."""

import numpy as np
import pytest

from w2b_core.behaviours import DEFAULT_BEHAVIOURS, holds
from w2b_core.senses import SENSES, Readings, Reference, gravity_in, heading_of, read, split


def quaternion(roll=0.0, pitch=0.0, yaw=0.0):
    (cr, cp, cy), (sr, sp, sy) = ([f(a / 2) for a in (roll, pitch, yaw)] for f in (np.cos, np.sin))
    return (sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy, cr * cp * cy + sr * sp * sy)


def command(name, share=1.0):
    u = np.zeros(len(DEFAULT_BEHAVIOURS))
    u[DEFAULT_BEHAVIOURS.index(name)] = share
    return u


@pytest.mark.parametrize(('name', 'expected'), [
    ('stop', (0, 0)), ('forward', (1, 1)), ('backward', (1, -1)), ('left', (0, 0)),
    ('right', (0, 0)), ('sit', (0, 0))])
def test_only_straight_commands_hold_a_heading(name, expected):
    np.testing.assert_array_equal(holds(DEFAULT_BEHAVIOURS, command(name)), expected)


def test_steer_has_the_direction_and_both_wrap_at_a_full_turn():
    turned = Readings(heading_rad=np.pi + 0.05)
    ahead, back = Reference(-np.pi, 1.0, 1.0), Reference(-np.pi, 1.0, -1.0)
    expected = 4 * np.sin(0.05)
    np.testing.assert_allclose(read(('heading', 'steer'), turned, ahead), [expected, expected])
    np.testing.assert_allclose(read(('heading', 'steer'), turned, back), [expected, -expected])


def test_without_a_command_no_heading_is_held():
    np.testing.assert_array_equal(read(('heading', 'steer'), Readings(heading_rad=1.0)), [0, 0])


def test_every_kind_is_read_in_the_order_asked_for():
    readings = Readings({'foot': 1.0}, {'knee': 0.3}, {'knee': -0.2}, 0.1, 2.0, (0.1, 0.2, -0.9))
    names = ('motor:knee', 'touch:foot', 'gravity:y', 'position:knee', 'yaw_rate', 'steer')
    values = read(names, readings, Reference(0.0, 0.5, 0.5))
    np.testing.assert_allclose(values, [-0.2, 1.0, 0.2, 0.3, 0.5, 0.5 * 4 * np.sin(0.1)])
    assert {split(name)[0] for name in names} | {'heading'} == set(SENSES)


@pytest.mark.parametrize('name', ['smell', 'touch', 'touch:', 'yaw_rate:x', 'gravity:w',
                                  'heading:'])
def test_an_unknown_sense_is_refused_with_those_there_are(name):
    with pytest.raises(ValueError, match='expected one of touch:LINK'):
        split(name)


def test_gravity_and_heading_follow_from_the_orientation():
    np.testing.assert_allclose(gravity_in(quaternion(yaw=1.0)), (0, 0, -1), atol=1e-12)
    # Nose down: gravity points to the front.
    np.testing.assert_allclose(gravity_in(quaternion(pitch=0.2)),
                               (np.sin(0.2), 0, -np.cos(0.2)), atol=1e-12)
    np.testing.assert_allclose(gravity_in(quaternion(roll=0.2)),
                               (0, -np.sin(0.2), -np.cos(0.2)), atol=1e-12)
    assert heading_of(quaternion(0.1, -0.1, 2.5)) == pytest.approx(2.5)
