"""`w2b robot`: a URDF becomes a robot that stands in both engines; bad ones write nothing."""

import re
import shutil
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh
from PIL import Image

from w2b_core import bodies
from w2b_core.bodies import robot_file
from w2b_core.bodies.inertia import volume_m3
from w2b_core.bodies.model import Box, Capsule
from w2b_core.bodies.robot_file.urdf_reader import Mesh, Piece, Place
from w2b_sim.own_robot import approximate, standing
from w2b_sim.own_robot.command import main

ROBOTS = Path(__file__).resolve().parents[2] / 'examples' / 'robots'
NAMES = ('dog12', 'spider12', 'dog8')


def robot(*arguments: str) -> int:
    return main([str(argument) for argument in arguments])


@pytest.fixture
def folder(tmp_path):
    """Return a folder with the URDFs alone."""
    for name in NAMES:
        shutil.copy(ROBOTS / f'{name}.urdf', tmp_path)
    return tmp_path


@pytest.mark.parametrize('name', NAMES)
def test_a_draft_of_a_bare_urdf_stands_as_it_is(folder, name, capsys):
    assert robot('init', folder / f'{name}.urdf') == 0
    path = folder / f'{name}.yaml'
    assert 'error' not in capsys.readouterr().out
    drafted, mine = robot_file.read(path), robot_file.read(ROBOTS / f'{name}.yaml')
    assert drafted.settings.forward == mine.settings.forward
    assert drafted.settings.locked == mine.settings.locked
    # The same feet, and a stance of about the same height.
    assert {foot: place.link for foot, place in drafted.stance.feet.items()} == {
        foot: place.link for foot, place in mine.stance.feet.items()}
    assert drafted.body.height_m == pytest.approx(mine.body.height_m, rel=0.15)
    for engine in ('pybullet', 'mujoco'):
        stood = standing.stand(drafted.body, engine)
        assert stood.problem == '', stood


def test_check_says_what_it_found_draws_it_and_lets_it_stand(tmp_path, capsys):
    picture = tmp_path / 'dog8.png'
    assert robot('check', ROBOTS / 'dog8.yaml', '--picture', picture) == 0
    said = capsys.readouterr().out
    assert 'warning: link body (and 9 more): no moments of inertia' in said
    assert '8 servos, 0.250 kg' in said
    assert 'mirrors: left_right' in said
    assert re.search(r'lf_knee +\d+ mm (forward|backward|up|down)', said)
    for engine in ('pybullet', 'mujoco'):
        sinks = re.search(rf'{engine}: sinks ([0-9.]+) mm, creeps ([0-9.]+) mm', said)
        assert float(sinks[1]) < 3
        assert float(sinks[2]) < 2
    pixels = np.asarray(Image.open(picture).convert('RGB')).reshape(-1, 3).astype(int)
    def share(colour):
        return float((np.abs(pixels - colour).max(axis=1) < 40).mean())
    # Trunk, legs, the centre of mass, and the joints' directions are in the picture.
    assert share((214, 152, 97)) > 0.01
    assert share((104, 149, 195)) > 0.001
    assert share((255, 0, 0)) > 1e-5
    assert share((128, 0, 128)) > 1e-5
    assert sorted(path.name for path in tmp_path.iterdir()) == ['dog8.png']


def test_a_robot_that_falls_over_in_the_engines_is_not_in_order():
    body = bodies.get(str(ROBOTS / 'dog12.yaml'))
    weak = replace(body, joints=tuple(replace(joint, servo=replace(
        joint.servo, max_torque_nm=0.02)) for joint in body.joints))
    for engine in ('pybullet', 'mujoco'):
        assert re.match('sinks|tilts|creeps', standing.stand(weak, engine).problem)


def test_links_that_run_into_each_other_are_found():
    assert standing.overlaps(bodies.get(str(ROBOTS / 'spider12.yaml')), poses=20) == ([], [])
    body = bodies.get(str(ROBOTS / 'dog8.yaml'))
    # Hind legs that stand where the front ones are.
    moved = {'lb_shoulder': body.joint('lf_shoulder').origin_m,
             'rb_shoulder': body.joint('rf_shoulder').origin_m}
    crossed = replace(body, joints=tuple(replace(joint, origin_m=moved.get(
        joint.name, joint.origin_m)) for joint in body.joints))
    at_rest, _swinging = standing.overlaps(crossed, poses=1)
    assert any('lf_shank' in pair and 'lb_shank' in pair for pair in at_rest)


def test_export_is_read_by_mujoco_with_the_same_mass(tmp_path):
    assert robot('export', ROBOTS / 'dog12.yaml', '--out', tmp_path / 'out') == 0
    model = mujoco.MjModel.from_xml_path(str(tmp_path / 'out' / 'dog12.xml'))
    assert model.body_mass.sum() == pytest.approx(0.9, abs=1e-6)
    assert (model.njnt, model.nbody) == (13, 14)
    urdf = mujoco.MjModel.from_xml_path(str(tmp_path / 'out' / 'dog12.urdf'))
    assert {urdf.joint(number).name for number in range(urdf.njnt)} == {
        joint.name for joint in bodies.get(str(ROBOTS / 'dog12.yaml')).joints}


def with_meshes(folder: Path) -> Path:
    """Return dog12 with a mesh, in millimetres, in place of each upper leg and of the trunk."""
    path = folder / 'dog12.urdf'
    (folder / 'meshes').mkdir()
    trimesh.creation.cylinder(radius=11, height=80, sections=24).export(
        folder / 'meshes' / 'upper.stl')
    trimesh.creation.box((200, 80, 50)).export(folder / 'meshes' / 'trunk.obj')
    scale = 'scale="0.001 0.001 0.001"'
    text = path.read_text().replace(
        '<cylinder radius="0.011" length="0.08"/>',
        f'<mesh filename="package://dog/meshes/upper.stl" {scale}/>').replace(
        '<box size="0.2 0.08 0.05"/>', f'<mesh filename="meshes/trunk.obj" {scale}/>')
    path.write_text(text)
    return path


def test_meshes_are_left_to_the_maker_or_approximated_on_request(folder, capsys):
    path = with_meshes(folder)
    assert robot('init', path) == 0
    said = capsys.readouterr().out
    assert 'error: link trunk (and 4 more): mesh meshes/trunk.obj: the engines know boxes' in said
    with pytest.raises(ValueError, match='mesh'):
        bodies.get(str(folder / 'dog12.yaml'))
    (folder / 'dog12.yaml').unlink()
    assert robot('init', path, '--approximate') == 0
    body = bodies.get(str(folder / 'dog12.yaml'))
    (leg,) = body.link('fl_upper').shapes
    assert isinstance(leg.shape, Capsule)
    assert leg.shape.radius_m == pytest.approx(0.011, abs=1e-3)
    assert leg.shape.length_m + 2 * leg.shape.radius_m == pytest.approx(0.08, abs=1e-3)
    trunk = body.links[0].shapes[0]
    assert isinstance(trunk.shape, Box)
    assert trunk.shape.size_m == pytest.approx((0.2, 0.08, 0.05))


@pytest.mark.parametrize('path', [
    'package://dog_description/meshes/trunk.obj', 'file:///home/maker/ws/src/dog/meshes/trunk.obj',
    '/home/maker/ws/src/dog/meshes/trunk.obj', '../meshes/trunk.obj', 'model://dog/meshes/trunk.obj',
    'meshes/trunk.obj', './meshes/trunk.obj'])
def test_a_mesh_is_found_by_the_end_of_a_path_from_another_machine(folder, path):
    urdf = with_meshes(folder)
    urdf.write_text(urdf.read_text().replace('meshes/trunk.obj', path))
    assert robot('init', urdf, '--approximate') == 0
    trunk = bodies.get(str(folder / 'dog12.yaml')).links[0].shapes[0]
    assert trunk.shape.size_m == pytest.approx((0.2, 0.08, 0.05))


@pytest.mark.parametrize(('mesh', 'kind'), [
    (trimesh.creation.capsule(height=0.08, radius=0.01), Capsule),
    (trimesh.creation.box((0.181, 0.06, 0.05)), Box),
    (trimesh.creation.box((0.009, 0.014, 0.08)), Box)])
@pytest.mark.parametrize('rpy', [(0.0, 0.0, 0.0), (0.3, -0.7, 1.1)])
def test_a_stand_in_is_of_the_kind_and_size_of_its_mesh_however_that_is_turned(mesh, kind, rpy):
    turned = mesh.copy()
    turned.apply_transform(trimesh.transformations.euler_matrix(*rpy))
    piece = Piece(Mesh('a.stl', (1, 1, 1)), Place(np.eye(3), np.array([0.1, 0.0, -0.02])))
    placed = approximate.bounding(np.asarray(turned.vertices), piece)
    assert isinstance(placed.shape, kind)
    assert volume_m3(placed.shape) == pytest.approx(mesh.bounding_primitive.volume, rel=0.1)
    assert placed.centre_m == pytest.approx((0.1, 0.0, -0.02), abs=1e-3)


def test_a_point_cloud_in_a_plane_gets_a_thin_box():
    flat = np.array([[x, y, 0.0] for x in (0.0, 0.1) for y in (0.0, 0.05)])
    placed = approximate.bounding(flat, Piece(Mesh('a.stl', (1, 1, 1)),
                                              Place(np.eye(3), np.zeros(3))))
    assert placed.shape.size_m == pytest.approx((0.1, 0.05, 1e-4))


COVER = ('<link name="{0}"><visual><geometry><mesh filename="{0}.stl"/></geometry></visual></link>'
         '<joint name="{0}_fixed" type="fixed"><parent link="{1}"/><child link="{0}"/></joint>')


def test_a_cover_that_is_seen_only_needs_no_mesh_a_leg_that_is_does(folder, capsys):
    path = folder / 'dog12.urdf'
    whole = path.read_text()
    path.write_text(whole.replace('</robot>', COVER.format('cover', 'fl_lower') + '</robot>'))
    assert robot('init', path, '--approximate') == 0
    assert "'cover':" not in (folder / 'dog12.yaml').read_text()
    assert robot_file.read(folder / 'dog12.yaml').body
    # An upper leg of which nothing but its mesh is there: that is its shape, and gives its mass.
    (folder / 'dog12.yaml').unlink()
    start, end = whole.index('<link name="fr_upper">'), whole.index('<joint name="fr_upper"')
    path.write_text(whole[:start] + '<link name="fr_upper"><visual><origin xyz="0 0 -0.04"/>'
                    '<geometry><mesh filename="leg.stl" scale="0.001 0.001 0.001"/></geometry>'
                    '</visual></link>' + whole[end:])
    assert robot('init', path, '--approximate') == 1
    assert 'link fr_upper: mesh leg.stl: no readable file' in capsys.readouterr().err
    trimesh.creation.cylinder(radius=11, height=80, sections=24).export(folder / 'leg.stl')
    assert robot('init', path, '--approximate') == 0
    upper = robot_file.read(folder / 'dog12.yaml').body.link('fr_upper')
    assert upper.mass_kg == pytest.approx(600 * np.pi * 0.011**2 * 0.08, rel=0.1)


def test_findings_that_differ_in_names_only_are_one_line(folder, capsys):
    assert robot('init', with_meshes(folder)) == 0
    said = capsys.readouterr().out
    assert said.count('the engines know boxes') == 1
    assert next(line for line in said.splitlines() if line.startswith('error')).startswith(
        'error: link trunk (and 4 more): mesh')


def test_a_refused_urdf_is_named_not_the_yaml_that_was_to_come(folder, capsys):
    (folder / 'dog12.urdf').write_text('<robot')
    assert robot('init', folder / 'dog12.urdf') == 1
    assert f'w2b robot: {folder / "dog12.urdf"} cannot be used' in capsys.readouterr().err


def test_a_slider_and_names_of_inner_links_are_understood(folder, capsys):
    """Names that no leg's tip or joint has, and a joint that is no hinge."""
    path = folder / 'dog12.urdf'
    text = path.read_text().replace('name="base_fixed" type="fixed"',
                                    'name="base_fixed" type="planar"')
    for leg in ('fl', 'fr', 'bl', 'br'):
        for part in ('hip', 'lower', 'foot'):
            text = re.sub(rf'"{leg}_{part}"', f'"x{leg}{part}"', text)
        text = re.sub(rf'<joint name="{leg}_upper"', f'<joint name="x{leg}upper"', text)
    path.write_text(text)
    assert robot('init', path) == 0
    said = capsys.readouterr().out
    assert 'warning: joint base_fixed: is planar: held still' in said
    assert 'do not say which is front' not in said
    drafted = robot_file.read(folder / 'dog12.yaml')
    assert drafted.settings.locked == ('base_fixed',)
    assert drafted.settings.feet['back_left'].link == 'xblfoot'


def test_check_says_which_part_spoils_the_symmetry(folder, capsys):
    shutil.copy(ROBOTS / 'dog12.yaml', folder)
    path = folder / 'dog12.urdf'
    path.write_text(path.read_text().replace('xyz="0.085 0.045 0"', 'xyz="0.095 0.045 0"'))
    assert robot('check', folder / 'dog12.yaml', '--no-engines') == 0
    said = capsys.readouterr().out
    assert re.search('warning: dog12 has no mirror left_right: joint fl_hip has no image', said)


BAD_MESH = {
    'missing': ('meshes/no.stl', 'no readable file'),
    'another folder': ('../../../etc/passwd.stl', 'leaves the folder'),
    'absolute': ('/etc/passwd', 'leaves the folder'),
    'from the net': ('http://example.org/a.stl', 'expected a file beside the URDF'),
    'no mesh format': ('meshes/trunk.step', 'expected one of .stl'),
    'damaged': ('meshes/damaged.stl', 'cannot be read|finite vertices|millimetres'),
}


@pytest.mark.parametrize('what', BAD_MESH)
def test_a_bad_mesh_is_one_line_and_nothing_is_written(folder, what, capsys):
    name, said = BAD_MESH[what]
    path = with_meshes(folder)
    (folder / 'meshes' / 'damaged.stl').write_bytes(b'solid x\nfacet nothing' * 3)
    path.write_text(path.read_text().replace('meshes/trunk.obj', name))
    assert robot('init', path, '--approximate') == 1
    errors = [line for line in capsys.readouterr().err.splitlines() if line.startswith('error')]
    assert len(errors) == 1
    assert re.search(said, errors[0]), errors
    assert not (folder / 'dog12.yaml').exists()


@pytest.mark.parametrize(('text', 'said'), [
    ('<robot name="r"><link name="a"/></robot>', 'no joints'),
    ('<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="continuous">'
     '<parent link="a"/><child link="b"/></joint></robot>', 'expected four chains'),
    ('<!DOCTYPE x [<!ENTITY a "b">]><robot name="&a;"/>', 'declares a document type'),
    ('', 'is no XML')])
def test_a_urdf_that_is_no_quadruped_is_told_and_nothing_is_written(tmp_path, text, said, capsys):
    path = tmp_path / 'robot.urdf'
    path.write_text(text)
    assert robot('init', path) == 1
    assert said in capsys.readouterr().err
    assert [one.name for one in tmp_path.iterdir()] == ['robot.urdf']


def test_a_yaml_that_is_there_is_never_overwritten(folder, capsys):
    path = folder / 'dog8.yaml'
    path.write_text('mine')
    assert robot('init', folder / 'dog8.urdf') == 1
    assert 'is there already' in capsys.readouterr().err
    assert path.read_text() == 'mine'


def test_check_of_a_robot_with_errors_lists_them_all(folder, capsys):
    shutil.copy(ROBOTS / 'dog12.yaml', folder)
    path = folder / 'dog12.yaml'
    path.write_text(path.read_text().replace('default: 0.5', 'default: -1').replace(
        'weigh_kg: 0.9', 'weigh_kg: heavy'))
    assert robot('check', path) == 1
    errors = [line for line in capsys.readouterr().err.splitlines() if line.startswith('error')]
    assert [line.split(':')[1].strip() for line in errors] == ['swing_rad.default', 'weigh_kg']
    assert not path.with_suffix('.png').exists()
