"""What the page draws of a robot description."""

import pytest

from w2b_core import bodies
from w2b_core.bodies.urdf import to_urdf
from w2b_web.shape import ShapeError, read


def test_a_body_that_ships_is_drawn_with_all_its_joints():
    shape = read(to_urdf(bodies.get('physical_twin')))
    assert shape['name'] == 'physical_twin'
    turning = [joint['name'] for joint in shape['joints'] if joint['kind'] == 'turn']
    assert len(turning) == 12
    assert all(link['visuals'] for link in shape['links'] if link['name'] != 'base_footprint')


@pytest.mark.parametrize(('text', 'expected'), [
    ('<robot', 'expected XML'),
    ('<model/>', 'expected <robot>, got <model>'),
    ('<!DOCTYPE x [<!ENTITY a "b">]><robot name="&a;"/>', 'without a document type')])
def test_what_is_no_description_is_refused_in_one_line(text, expected):
    with pytest.raises(ShapeError, match=expected) as refused:
        read(text)
    assert '\n' not in str(refused.value)
