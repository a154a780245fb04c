"""A body from a file, and a body that files carry: the same to the bit, with a hash."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from tests.w2b_core.legs_controller import controller, network
from w2b_core import bodies
from w2b_core.bodies import description, robot_file
from w2b_core.bodies.model import Cylinder, Placed, Sphere
from w2b_core.controller import file as controller_file
from w2b_core.json_fields import JsonFileError

ROBOTS = Path(__file__).resolve().parents[2] / 'examples' / 'robots'
NAMES = ('dog12', 'spider12', 'dog8')


def own(name='dog8'):
    return bodies.get(str(ROBOTS / f'{name}.yaml'))


def legs_of(body):
    """Return a controller with random legs of a body, which it carries."""
    heard = controller().ear
    return replace(
        controller(), body=body.name, carried=bodies.to_carry(body),
        network=network(14, len(heard.behaviours), 3, len(body.joints)),
        motors=tuple(controller_file.Motor(joint.name, joint.lower_rad, joint.upper_rad, 1.0)
                     for joint in body.joints))


@pytest.mark.parametrize('name', bodies.names())
def test_every_registered_body_comes_back_from_a_file_to_the_bit(name, tmp_path):
    path = tmp_path / 'body.json'
    description.save(bodies.get(name), path)
    assert bodies.get(str(path)) == bodies.get(name)


@pytest.mark.parametrize('name', NAMES)
def test_every_makers_robot_comes_back_from_a_file_to_the_bit(name, tmp_path):
    path = tmp_path / 'body.json'
    description.save(own(name), path)
    assert bodies.get(str(path)) == own(name)


def test_what_a_robot_does_changes_the_hash_and_its_description_does_not():
    body = own()
    same = description.sha256(replace(body, description='my other words'))
    assert same == description.sha256(body)
    heavier = replace(body, links=(replace(body.links[0], mass_kg=0.2), *body.links[1:]))
    turned = replace(body, links=(replace(body.links[0], shape=(Placed(
        Cylinder(0.1, 0.02, (0.0, 0.0, 1.0)), rpy_rad=(0.0, 0.1, 0.0)), Placed(Sphere(0.01)))),
        *body.links[1:]))
    assert len({description.sha256(one) for one in (body, heavier, turned)}) == 3


def test_a_controller_carries_a_makers_body_and_needs_no_file(tmp_path):
    path = tmp_path / 'c.json'
    controller_file.save(legs_of(own()), path)
    again = controller_file.load(path)
    assert again.described() == own()
    # A simulation of it can be started from the controller's file alone.
    assert bodies.get(str(path)) == own()
    again.refuse_another_body(own())


def test_a_body_that_every_program_has_is_not_carried(tmp_path):
    assert bodies.to_carry(bodies.get('physical_twin')) is None
    path = tmp_path / 'c.json'
    controller_file.save(controller(), path)
    assert 'body_description' not in json.loads(path.read_text())
    with pytest.raises(JsonFileError, match='controller file that carries its body'):
        bodies.get(str(path))


def test_a_body_that_changed_since_is_refused_with_both_hashes():
    made, changed = own(), replace(own(), height_m=0.2)
    with pytest.raises(JsonFileError, match='changed since') as error:
        legs_of(made).refuse_another_body(changed)
    for body in (made, changed):
        assert description.sha256(body)[:12] in str(error.value)
    with pytest.raises(JsonFileError, match='dog8, which the controller moves'):
        legs_of(made).refuse_another_body(own('dog12'))


@pytest.mark.parametrize(('key', 'value', 'said'), [
    ('height_m', 0.2, 'sha256: expected that of what is here'),
    ('height_m', 'high', 'height_m: expected a finite number'),
    ('links', [], 'sha256|links'),
    ('joints', {}, 'joints: expected a list'),
    ('colour', 'red', 'colour: expected no such field')])
def test_a_carried_body_that_was_touched_is_refused(key, value, said, tmp_path):
    document = json.loads(controller_file.dumps(legs_of(own())))
    document['body_description'][key] = value
    with pytest.raises(JsonFileError, match=said):
        controller_file.loads(json.dumps(document))


def test_a_controller_that_drives_other_joints_than_its_body_has_is_refused():
    with pytest.raises(JsonFileError, match='those of the motors'):
        replace(legs_of(own()), carried=replace(own('dog12'), name='dog8'))


@pytest.mark.parametrize('name', ['nothing.yaml', 'nothing.json', '/nowhere/at/all'])
def test_a_file_that_is_missing_is_one_line_with_its_name(name):
    with pytest.raises(ValueError, match='expected') as error:
        bodies.get(name)
    assert name in str(error.value)
    assert '\n' not in str(error.value)


def test_the_twin_is_wired_by_its_file_and_others_in_order():
    twin = bodies.get('physical_twin')
    wiring = bodies.wiring('physical_twin')
    assert [one.channel for one in wiring.values()] == list(range(12))
    assert list(wiring) == [joint.name for joint in twin.joints]
    path = Path(robot_file.__file__).parents[1] / 'physical_twin.yaml'
    assert set(robot_file.read(path).wiring) == set(wiring)
    assert bodies.get(str(path)) == twin
    assert [one.channel for one in bodies.wiring('quadruped').values()] == list(range(8))


@pytest.mark.parametrize('carried', [False, True])
def test_a_body_as_json_is_wired_in_the_order_of_its_joints(carried, tmp_path):
    path = tmp_path / 'body.json'
    if carried:
        controller_file.save(legs_of(own('dog12')), path)
    else:
        description.save(own('dog12'), path)
    assert [(joint, one.channel) for joint, one in bodies.wiring(str(path)).items()] == [
        (joint.name, channel) for channel, joint in enumerate(own('dog12').joints)]


def test_a_makers_file_says_how_its_servos_are_wired():
    wiring = bodies.wiring(str(ROBOTS / 'dog12.yaml'))
    assert (wiring['fr_upper'].channel, wiring['fr_upper'].direction) == (5, -1)
    assert list(wiring) == [joint.name for joint in own('dog12').joints]


@pytest.fixture
def folder(tmp_path):
    """Return a folder with dog8's files."""
    for name in ('dog8.urdf', 'dog8.yaml'):
        shutil.copy(ROBOTS / name, tmp_path)
    return tmp_path


def test_a_robots_yaml_means_the_controller_beside_it_that_carries_this_very_body(folder):
    robot = folder / 'dog8.yaml'
    body = bodies.get(str(robot))
    (folder / 'notes.json').write_text('[]')
    (folder / 'body.json').write_text('{"format": "w2b-body"}')
    with pytest.raises(JsonFileError, match='in its folder, got none; train one'):
        controller_file.resolve(str(robot))
    controller_file.save(legs_of(replace(body, length_m=0.2)), folder / 'dog8.json')
    with pytest.raises(JsonFileError, match=r'dog8\.json: body: .*changed since'):
        controller_file.resolve(str(robot))
    controller_file.save(legs_of(body), folder / 'best.json')
    assert controller_file.resolve(str(robot)) == folder / 'best.json'
    controller_file.save(legs_of(body), folder / 'dog8_legs.json')
    assert controller_file.resolve(str(robot)) == folder / 'dog8_legs.json'
    found = controller_file.load(controller_file.resolve(str(robot)))
    # The node takes the YAML, which has the wiring too.
    assert controller_file.body_argument(found, str(robot)) == str(robot)
    robot.write_text('urdf: gone.urdf')
    with pytest.raises(ValueError, match=r'gone\.urdf|feet'):
        controller_file.resolve(str(robot))


def test_a_yaml_that_only_wires_a_registered_body_means_its_shipped_controller(tmp_path):
    robot = tmp_path / 'mine.yaml'
    robot.write_text('body: physical_twin\n')
    path = controller_file.resolve(str(robot))
    assert path == controller_file.shipped('physical_twin')
    assert controller_file.body_argument(controller_file.load(path), str(robot)) == str(robot)
