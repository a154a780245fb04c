"""What the page shows: robots from their descriptions, diagnostics, robots in the graph, words."""

import asyncio
import json

import aiohttp
import pytest

from tests.w2b_web.serving import Serving, heard
from w2b_core import bodies
from w2b_core.bodies.urdf import to_urdf
from w2b_web.discovery import MOST_ROBOTS, robots_of
from w2b_web.lights import GONE_S, STALE_S, Lights
from w2b_web.server import Server
from w2b_web.shape import ShapeError, read
from w2b_web.words import MOST, Words, trained_words

LINK = '<link name="{}"><visual><geometry><sphere radius="0.1"/></geometry></visual></link>'
JOINT = '<joint name="{}" type="revolute"><parent link="{}"/><child link="{}"/></joint>'


@pytest.mark.parametrize('name', bodies.names())
def test_every_body_is_drawn_whole(name):
    body, shape = bodies.get(name), read(to_urdf(bodies.get(name), imu_frame='imu_link'))
    assert [joint['name'] for joint in shape['joints'] if joint['kind'] == 'turn'] == [
        joint.name for joint in body.joints]
    drawn = {link['name'] for link in shape['links'] if link['visuals']}
    assert drawn == {link.name for link in body.links if link.shapes}
    assert not shape['notes']
    # What a browser's JSON can read.
    assert json.loads(json.dumps(shape, allow_nan=False)) == shape


def test_a_mesh_is_said_to_be_a_box():
    shape = read('<robot name="r"><link name="a"><visual><geometry><mesh filename="package://x/'
                 'y.stl"/></geometry></visual></link></robot>')
    assert shape['links'][0]['visuals'][0]['size'] == [0.03] * 3
    assert shape['notes'] == ['1 meshes of the robot description are drawn as small boxes']


@pytest.mark.parametrize(('urdf', 'says'), [
    ('', 'expected XML'), ('<robot', 'expected XML'), ('<sdf/>', 'expected <robot>'),
    ('<robot/>', 'expected 1 to 500 links'), ('x' * 2_000_001, 'characters at most'),
    ('<!DOCTYPE robot [<!ENTITY a "b">]><robot>&a;</robot>', 'without a document type'),
    ('<robot>' + LINK.format('a') * 501 + '</robot>', 'expected 1 to 500 links'),
    ('<robot>' + LINK.format('a').replace('0.1', 'nan') + '</robot>', 'expected 1 numbers'),
    ('<robot>' + LINK.format('a').replace('0.1', '1 2') + '</robot>', 'expected 1 numbers'),
    ('<robot>' + LINK.format('a').replace('sphere', 'torus') + '</robot>', 'got <torus>'),
    ('<robot>' + LINK.format('a') + JOINT.format('j', 'a', 'b') + '</robot>', 'as child'),
    ('<robot>' + LINK.format('a') + LINK.format('b') + JOINT.format('j', 'a', 'b')
     + JOINT.format('k', 'b', 'a') + '</robot>', 'got a circle'),
    ('<robot>' + LINK.format('a') + LINK.format('b') + JOINT.format('j', 'a', 'b')
     + JOINT.format('k', 'a', 'b') + '</robot>', 'expected one parent')])
def test_a_description_that_cannot_be_drawn_says_why(urdf, says):
    with pytest.raises(ShapeError) as raised:
        read(urdf)
    assert says in str(raised.value)
    assert len(str(raised.value)) < 300


def test_lights_are_sorted_by_robot_and_go_out():
    now = [0.0]
    lights = Lights(lambda: now[0])
    lights.take('brain: frames', 0, 'sensor frames flow')
    lights.take('dog1/brain: frames', 2, 'no sensor frames')
    assert json.loads(lights.news(''))['items'] == [
        {'name': 'brain: frames', 'level': 0, 'text': 'sensor frames flow'}]
    assert lights.news('') is None, 'nothing new'
    assert json.loads(lights.news('/dog1'))['items'][0]['level'] == 2
    assert not lights.silent('', 'brain')
    now[0] = STALE_S + 0.1
    assert json.loads(lights.news(''))['items'][0]['level'] == 3
    assert lights.silent('', 'brain')
    assert not lights.silent('', 'sim'), 'one that never reported is not silent'
    now[0] = GONE_S + 0.1
    assert json.loads(lights.news(''))['items'] == []


def test_robots_are_found_by_their_topics():
    diagnostic, joints = 'diagnostic_msgs/msg/DiagnosticStatus', 'sensor_msgs/msg/JointState'
    topics = [('/dog2/joint_states', [joints]), ('/dog1/body_status', [diagnostic]),
              ('/dog1/joint_states', [joints]), ('/rosout', ['rcl_interfaces/msg/Log']),
              ('/other/body_status', ['std_msgs/msg/String'])]
    assert robots_of(topics, '') == ['', '/dog1', '/dog2']
    assert robots_of(topics, '/dog2') == ['/dog2', '/dog1']
    assert robots_of([], '') == [''], 'its own place is there though nobody is'
    many = [(f'/r{number}/joint_states', [joints]) for number in range(100)]
    assert len(robots_of(many, '')) == MOST_ROBOTS


def test_robots_that_came_while_no_server_ran_are_in_the_list_of_the_next_one():
    async def listed(serving):
        async with aiohttp.ClientSession() as session, serving.page(session) as page:
            return (await heard(page, 'robots'))['names']
    serving = Serving()
    with serving:
        pass
    serving.hub.from_ros(serving.hub.robots, ['', '/dog1'])
    serving.server = Server(serving.access, serving.hub)
    with serving:
        assert asyncio.run(listed(serving)) == ['', '/dog1']


def test_suggestions_are_trained_words_first_then_frequent_ones():
    words, trained = Words(), trained_words('physical_twin')
    assert {'forward', 'stop', 'left'} <= set(trained)
    found = words.suggest('for', trained)
    assert len(found) <= MOST
    assert found[0]['behaviour'], 'a trained word first'
    assert all(word['word'].startswith('for') for word in found)
    assert words.suggest('do not forwar', trained)[0]['word'].startswith('forwar'), 'the last word'
    assert words.suggest('qqqq', trained) == []
    opening = words.suggest('', trained)
    assert [word['behaviour'] for word in opening] == list(dict.fromkeys(trained.values()))
    assert words.suggest('', {}) == []


def test_of_a_controller_that_primes_words_too():
    assert trained_words('physical_twin_serial')['stop'] == 'stop'
    with pytest.raises(ValueError, match='expected'):
        trained_words('nothing')
