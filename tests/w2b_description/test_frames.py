"""Frames of a robot description, against an independent library; the footprint; the drawn parts."""

import shutil
import subprocess
from xml.etree import ElementTree

import numpy as np
import pytest
import yourdfpy

from w2b_core import bodies
from w2b_core.bodies import visuals
from w2b_core.bodies.turning import from_rpy, quaternion_wxyz
from w2b_core.bodies.urdf import describe
from w2b_description.footprint import Clearance, footprint
from w2b_description.frames import FrameTree, UrdfError, rotate

every_body = pytest.mark.parametrize('name', bodies.names())
LEVEL = np.array([0.0, 0.0, 0.0, 1.0])


def xyzw(*rpy_rad):
    w, x, y, z = quaternion_wxyz(from_rpy(rpy_rad))
    return np.array([x, y, z, w])


def matrix(transform):
    found = np.eye(4)
    found[:3, :3] = np.array([rotate(transform.turn_xyzw, axis) for axis in np.eye(3)]).T
    found[:3, 3] = transform.place_m
    return found


def places(tree, positions):
    """Return each frame (4, 4) in the root's."""
    found = {tree.root: np.eye(4)}
    for transform in (*tree.moving(positions), *tree.fixed):
        found[transform.child] = found[transform.parent] @ matrix(transform)
    return found


@every_body
def test_frames_are_where_an_independent_library_has_them(name, tmp_path):
    path = tmp_path / 'body.urdf'
    path.write_text(describe(bodies.get(name)))
    robot = yourdfpy.URDF.load(str(path), build_scene_graph=True, load_meshes=False)
    tree = FrameTree(path.read_text())
    positions = dict(zip(tree.joints, np.random.default_rng(3).uniform(-0.5, 0.5, 99),
                         strict=False))
    robot.update_cfg(positions)
    found = places(tree, positions)
    assert set(found) == set(robot.link_map)
    for frame, place in found.items():
        np.testing.assert_allclose(place, robot.get_transform(frame, tree.root), atol=1e-9)


def test_a_description_of_someone_elses_turned_sliding_and_fixed_joints(tmp_path):
    urdf = """<robot name="other"><link name="a"/><link name="b"/><link name="c"/><link name="d"/>
      <joint name="ab" type="continuous"><parent link="a"/><child link="b"/>
        <origin xyz="0.1 0.2 0.3" rpy="0.3 -0.4 1.2"/><axis xyz="0 0 2"/></joint>
      <joint name="bc" type="prismatic"><parent link="b"/><child link="c"/>
        <origin rpy="0 0.7 0"/><axis xyz="0 1 0"/>
        <limit lower="0" upper="1" effort="1" velocity="1"/>
      </joint>
      <joint name="cd" type="fixed"><parent link="c"/><child link="d"/>
        <origin xyz="1 0 0" rpy="1.5707963267948966 0 0"/></joint></robot>"""
    path = tmp_path / 'other.urdf'
    path.write_text(urdf)
    robot = yourdfpy.URDF.load(str(path), build_scene_graph=True)
    positions = {'ab': 0.6, 'bc': 0.25}
    robot.update_cfg(positions)
    found = places(FrameTree(urdf), positions)
    for frame, place in found.items():
        np.testing.assert_allclose(place, robot.get_transform(frame, 'a'), atol=1e-6)


@pytest.mark.parametrize(('urdf', 'said'), [
    ('<robot', 'expected URDF'),
    ('<robot><link name="a"/><link name="b"/></robot>', 'expected one tree of links'),
    ('<robot><link name="a"/><joint name="j" type="fixed"><parent link="a"/></joint></robot>',
     'joint j: expected <child link'),
    ('<robot><link name="a"/><link name="b"/><joint name="j" type="revolute"><parent link="a"/>'
     '<child link="b"/><axis xyz="0 0 up"/></joint></robot>', "three numbers, got '0 0 up'")])
def test_what_is_no_tree_is_refused_in_one_line(urdf, said):
    with pytest.raises(UrdfError, match=said) as error:
        FrameTree(urdf)
    assert '\n' not in str(error.value)


def test_the_footprint_is_level_on_the_floor_and_looks_where_the_base_looks():
    turn, height_m = xyzw(0.3, -0.2, 2.0), 0.09
    base = np.eye(4)
    base[:3, :3] = from_rpy((0.3, -0.2, 2.0))
    base[:3, 3] = (1.0, 2.0, height_m)
    found = base @ matrix(footprint('base_link', turn, height_m))
    np.testing.assert_allclose(found[:3, 3], (1.0, 2.0, 0.0), atol=1e-12)
    np.testing.assert_allclose(found[:3, 2], (0.0, 0.0, 1.0), atol=1e-12)
    yaw = np.arctan2(found[1, 0], found[0, 0])
    assert yaw == pytest.approx(np.arctan2(base[1, 0], base[0, 0]))


def test_the_clearance_is_the_height_of_the_start_and_grows_with_a_tilt():
    body = bodies.get('physical_twin')
    clearance = Clearance(body, FrameTree(describe(body)))
    assert clearance.height_m({}, LEVEL) == pytest.approx(body.height_m)
    # A foot stands out by 0.16 m: the base rises when it rolls onto the feet of one side.
    assert clearance.height_m({}, xyzw(0.2, 0.0, 0.0)) > body.height_m + 0.015
    lifted = {f'{leg}_knee': 0.5 for leg in ('front_left', 'front_right', 'back_left',
                                             'back_right')}
    assert clearance.height_m(lifted, LEVEL) < body.height_m - 0.015


@every_body
def test_a_strict_parser_takes_the_description(name, tmp_path):
    parser = shutil.which('check_urdf')
    if parser is None:
        pytest.skip('no check_urdf here: apt-get install liburdfdom-tools')
    path = tmp_path / 'body.urdf'
    path.write_text(describe(bodies.get(name)))
    done = subprocess.run([parser, path], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert 'Successfully Parsed XML' in done.stdout
    assert not done.stderr


@every_body
def test_every_drawn_part_has_a_declared_colour_and_a_size(name):
    robot = ElementTree.fromstring(describe(bodies.get(name)))
    declared = {element.get('name') for element in robot.findall('material')}
    drawn = robot.findall('.//visual')
    assert {part.find('material').get('name') for part in drawn} <= declared
    for geometry in robot.iter('geometry'):
        sizes = [float(word) for text in geometry[0].attrib.values() for word in text.split()]
        assert min(sizes) > 0.0


@pytest.mark.parametrize('name', [name for name in bodies.names() if name in visuals.VISUALS])
def test_drawn_parts_are_of_links_and_stay_near_what_touches(name):
    """What is drawn is what one believes: no part stands out from its link by more than 3 cm."""
    body = bodies.get(name)
    found = visuals.of(body)
    assert set(found) == {link.name for link in body.links}
    robot = ElementTree.fromstring(describe(body))
    for link in robot.findall('link'):
        def centres(kind, link=link):
            return np.array([[float(word) for word in part.find('origin').get('xyz').split()]
                             for part in link.findall(kind)])
        if link.find('visual') is None:
            continue
        touching, drawn = centres('collision'), centres('visual')
        reach = 0.09 if link.get('name') == 'base_link' else 0.03
        assert (drawn >= touching.min(axis=0) - reach).all(), link.get('name')
        assert (drawn <= touching.max(axis=0) + reach).all(), link.get('name')
