"""A maker's URDF and YAML: read right, and every damage told in one line with its remedy."""

import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from w2b_core import bodies
from w2b_core.bodies import robot_file
from w2b_core.bodies.inertia import link_inertia
from w2b_core.bodies.robot_file import Grade, RobotFileError
from w2b_core.bodies.robot_file.directions import motions
from w2b_core.bodies.urdf import to_urdf
from w2b_core.network.symmetry import find_mirrors, limbs_of

ROBOTS = Path(__file__).resolve().parents[2] / 'examples' / 'robots'
NAMES = ('dog12', 'spider12', 'dog8')
BOMB = '<!DOCTYPE r [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>'


@pytest.mark.parametrize('name', NAMES)
def test_a_robot_stands_on_four_feet_and_is_mirrored(name):
    robot = robot_file.read(ROBOTS / f'{name}.yaml')
    body, stance = robot.body, robot.stance
    assert len(body.joints) == int(name[-2:].lstrip('rg'))
    assert [mirror.name for mirror in find_mirrors(body)] == ['left_right']
    bottoms = [foot.bottom_m[2] for foot in stance.feet.values()]
    assert bottoms == pytest.approx([-body.height_m] * 4, abs=1e-6)
    assert stance.margin_m > 0.02
    assert sum(link.mass_kg for link in body.links) == pytest.approx(
        robot.settings.weigh_kg)
    for joint in body.joints:
        assert joint.lower_rad == -joint.upper_rad
    # Limb 0 is the front left leg, 1 the front right, 2 the back left: recipes count on it.
    for limb, foot in zip(limbs_of(body), ('front_left', 'front_right', 'back_left', 'back_right'),
                          strict=True):
        assert body.joints[limb[-1]].child == stance.feet[foot].link


@pytest.mark.parametrize('name', NAMES)
def test_what_faces_another_way_in_its_file_faces_x_here(name):
    stance = robot_file.read(ROBOTS / f'{name}.yaml').stance
    for foot, place in stance.feet.items():
        assert (place.bottom_m[0] > 0) == foot.startswith('front')
        assert (place.bottom_m[1] > 0) == foot.endswith('left')


def test_fixed_joints_are_merged_with_their_mass_at_their_place():
    body = robot_file.read(ROBOTS / 'dog12.yaml').body
    scale = 0.9 / (0.42 + 0.06 + 4 * (0.035 + 0.045 + 0.02 + 0.004))
    base = body.links[0]
    assert base.mass_kg == pytest.approx(0.48 * scale)
    assert base.centre_m == (0.0, 0.0, 0.0)
    assert len(base.shapes) == 2
    # Trunk at 0.004, 0.002; computer at 0.02, 0.033: the frame is at their centre.
    trunk = next(placed for placed in base.shapes if placed.shape.size_m[0] == 0.2)
    x, z = ((0.42 * 0.004 + 0.06 * 0.02) / 0.48, (0.42 * 0.002 + 0.06 * 0.033) / 0.48)
    assert trunk.centre_m == pytest.approx((-x, 0.0, -z))
    # Parallel axes: both tensors, and what their distances add.
    arm = np.array([0.02 - 0.004, 0.0, 0.033 - 0.002])
    joined = 0.42 * 0.06 / 0.48 * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    own = np.diag([0.42 * (0.08**2 + 0.05**2) + 0.06 * (0.056**2 + 0.017**2),
                   0.42 * (0.2**2 + 0.05**2) + 0.06 * (0.085**2 + 0.017**2),
                   0.42 * (0.2**2 + 0.08**2) + 0.06 * (0.085**2 + 0.056**2)]) / 12
    assert link_inertia(base) == pytest.approx((own + joined) * scale, rel=2e-3, abs=1e-8)
    lower = body.link('fl_lower')
    assert lower.mass_kg == pytest.approx(0.024 * scale)


def test_stance_and_axes_are_those_of_the_urdf_at_its_angles():
    body = robot_file.read(ROBOTS / 'dog12.yaml').body
    hip = np.asarray(body.joint('fl_upper').origin_m)
    knee = np.asarray(body.joint('fl_lower').origin_m)
    assert knee == pytest.approx(0.08 * np.array([-np.sin(0.65), 0.0, -np.cos(0.65)]))
    assert hip == pytest.approx([0.0, 0.03, 0.0])
    assert body.joint('fl_lower').axis == (0.0, 1.0, 0.0)
    # The right legs of dog8 have mirrored axes: the same angle means the opposite.
    way = motions(robot_file.read(ROBOTS / 'dog8.yaml').body)
    assert way['lf_shoulder'].way_m[0] == pytest.approx(-way['rf_shoulder'].way_m[0], rel=0.05)
    assert 'forward' in way['lf_shoulder'].words or 'backward' in way['lf_shoulder'].words


def test_holding_torque_is_that_of_forces_at_the_feet():
    stance = robot_file.read(ROBOTS / 'dog8.yaml').stance
    # The knee of a front leg: a share of the weight times how far the foot is beside it.
    weight = 9.81 * stance.mass_kg
    assert 0.2 * 0.01 * weight < stance.torque_nm['lf_knee'] < 0.3 * 0.04 * weight
    assert stance.torque_nm['lf_knee'] == pytest.approx(stance.torque_nm['rf_knee'], rel=1e-6)


def test_the_cleaned_urdf_is_read_back_as_the_same_robot(tmp_path):
    body = robot_file.read(ROBOTS / 'spider12.yaml').body
    (tmp_path / 'again.urdf').write_text(to_urdf(body, capsule_element=True))
    feet = {name: foot.link for name, foot in
            robot_file.read(ROBOTS / 'spider12.yaml').stance.feet.items()}
    (tmp_path / 'again.yaml').write_text(
        'urdf: again.urdf\nname: spider12\nservo: {torque_nm: 0.16, speed_rad_s: 6.0}\n'
        'swing_rad: {default: 0.4}\nfeet: {' + ', '.join(
            f'{name}: {link}' for name, link in feet.items()) + '}\n')
    again = bodies.get(str(tmp_path / 'again.yaml'))
    assert again.height_m == pytest.approx(body.height_m, abs=1e-6)
    for first, second in zip(body.links, again.links, strict=True):
        assert first.name == second.name
        assert first.centre_m == pytest.approx(second.centre_m, abs=1e-8)
        assert link_inertia(first) == pytest.approx(link_inertia(second), rel=1e-6, abs=1e-12)


def in_urdf(old, new, count=1):
    return 'dog12.urdf', old, new, count


def in_yaml(old, new, count=1):
    return 'dog12.yaml', old, new, count


HIP = '<axis xyz="1 0 0"/>\n    <limit lower="-0.8" upper="0.8" effort="1000" velocity="0.7"/>'
BAD = {
    'no XML': (in_urdf('</robot>', ''), 'dog12.urdf: is no XML'),
    'an XML bomb': (in_urdf('<robot', BOMB + '<robot'), 'declares a document type'),
    'an external entity': (in_urdf('<robot', '<!DOCTYPE r SYSTEM "file:///etc/passwd"><robot'),
                           'declares a document type'),
    'no robot': (in_urdf('robot', 'sdf', 9), 'expected <robot>'),
    'xacro': (in_urdf('0.085 0.045 0', '${x} 0.045 0'), 'expand it: `xacro'),
    'an argument of xacro': (in_urdf('<robot name="dog12"', '<robot name="$(arg name)"'),
                             'expand it: `xacro'),
    'a link twice': (in_urdf('<link name="fr_hip"', '<link name="fl_hip"'),
                     'link fl_hip: is described twice'),
    'a joint twice': (in_urdf('<joint name="fr_hip"', '<joint name="fl_hip"'),
                      'joint fl_hip: is described twice'),
    'an unknown child': (in_urdf('<child link="fr_upper"/>', '<child link="fr_thigh"/>'),
                         "joint fr_upper: child 'fr_thigh' is no link"),
    'two parents': (in_urdf('<child link="fr_upper"/>', '<child link="fl_upper"/>'),
                    'hangs on two joints'),
    'a loop': (in_urdf('<parent link="base"/>', '<parent link="fl_foot"/>'), 'joint|root'),
    'a name missing': (in_urdf('<link name="fr_hip"', '<link name=""'), 'has no name'),
    'letters for numbers': (in_urdf('xyz="0.085 0.045 0"', 'xyz="0.085 left 0"'),
                            "joint fl_hip: xyz: expected 3 finite numbers, got '0.085 left 0'"),
    'NaN': (in_urdf('<mass value="0.42"/>', '<mass value="nan"/>'), 'link trunk: value'),
    'two numbers': (in_urdf('size="0.2 0.08 0.05"', 'size="0.2 0.08"', 2), 'expected 3 finite'),
    'a negative size': (in_urdf('radius="0.011"', 'radius="-0.011"', 2), 'more than 0 m'),
    'a negative mass': (in_urdf('<mass value="0.42"/>', '<mass value="-1"/>'),
                        'link trunk: mass of -1 kg'),
    'millimetres': (in_urdf('xyz="0.085 0.045 0"', 'xyz="85 45 0"'), 'is the file in millimetres'),
    'no limits': (in_urdf(HIP, '<axis xyz="1 0 0"/>'), 'joint fl_hip: revolute without limits'),
    'limits exchanged': (in_urdf('lower="-0.8" upper="0.8"', 'lower="0.8" upper="-0.8"'),
                         'expected the lower one first'),
    'degrees': (in_urdf('lower="-0.8" upper="0.8"', 'lower="-45" upper="45"'),
                'are they in degrees'),
    'a zero axis': (in_urdf('<axis xyz="1 0 0"/>', '<axis xyz="0 0 0"/>'),
                    'joint fl_hip: axis 0 0 0'),
    'a slider': (in_urdf('name="fl_hip" type="revolute"', 'name="fl_hip" type="prismatic"'),
                 r'joint fl_hip: is prismatic: .* lock it: locked: \[fl_hip\]'),
    'an unknown type': (in_urdf('name="fl_hip" type="revolute"', 'name="fl_hip" type="hinge"'),
                        "joint fl_hip: type 'hinge'"),
    'a linkage': (in_urdf(HIP, HIP + '<mimic joint="fr_hip"/>'), 'joint fl_hip: mimics fr_hip'),
    'a mesh': (in_urdf('<sphere radius="0.01"/>', '<mesh filename="foot.stl"/>', 2),
               'link fl_foot: mesh foot.stl'),
    'a shape unknown': (in_urdf('<sphere radius="0.01"/>', '<cone radius="0.01"/>', 2),
                        "link fl_foot: geometry 'cone'"),
    'outside its limits': (in_urdf('lower="-2.4" upper="0.1"', 'lower="-1.0" upper="0.1"'),
                           'joint fl_lower: stands at -1.30, outside -1.00..0.10'),
    'at its limit': (in_urdf('lower="-2.4" upper="0.1"', 'lower="-1.31" upper="0.1"'),
                     'joint fl_lower: stands at -1.30, at the end of'),
    'a massless leg': (in_urdf('<mass value="0.045"/>', '<mass value="0"/>'),
                       'link fl_upper: weighs nothing'),
    'two names that become one': (in_urdf('"fr_hip"', '"fl-hip"', 9), 'fl_hip'),
    'a leg of another length': (in_urdf('xyz="0 0 -0.085"', 'xyz="0 0 -0.12"'),
                                'feet: differ by'),
    'no YAML': (in_yaml('feet:', 'feet: ]['), 'expected a YAML file'),
    'an unknown field': (in_yaml('forward:', 'foreward:'), 'foreward: is no field'),
    'a field twice': (in_yaml('forward: +x', 'forward: +x\nforward: +x'), 'given twice'),
    'an anchor': (in_yaml('forward: +x', 'forward: &a +x'), 'no anchors'),
    'another folder': (in_yaml('urdf: dog12.urdf', 'urdf: ../../dog12.urdf'), 'leaves the folder'),
    'an absolute path': (in_yaml('urdf: dog12.urdf', 'urdf: /etc/passwd'), 'leaves the folder'),
    'no such URDF': (in_yaml('urdf: dog12.urdf', 'urdf: dog13.urdf'), 'got nothing readable'),
    'no front': (in_yaml('forward: +x', 'forward: north'), 'forward: expected one of [+]x'),
    'the wrong front': (in_yaml('forward: +x', 'forward: -y'),
                        'feet: names say front, but .* set forward: [+]x'),
    'feet exchanged': (in_yaml('front_left: {link: fl_foot}', 'front_left: {link: bl_foot}'),
                       'moves more than one leg|names do not fit|names say front'),
    'three feet': (in_yaml('  back_right: {link: br_foot}\n', ''), 'got no back_right'),
    'an unknown foot': (in_yaml('link: fl_foot', 'link: fl_paw'),
                        "feet.front_left: 'fl_paw' is no link"),
    'a foot on the trunk': (in_yaml('link: fl_foot', 'link: trunk'), 'hangs on 0 moving joints'),
    'a pattern that fits nothing': (in_yaml('"*_lower": -1.3', '"*_shin": -1.3'),
                                    'stand.[*]_shin: fits no joint'),
    'no servo': (in_yaml('servo: {torque_nm: 0.9, speed_rad_s: 6.0}\n', ''),
                 'give servo.torque_nm'),
    'a weak servo': (in_yaml('torque_nm: 0.9', 'torque_nm: 0.05'),
                     'holding this stance needs 0.12 N m, the servo has 0.05'),
    'a negative swing': (in_yaml('default: 0.5', 'default: -0.5'), 'swing_rad.default'),
    'infinite weight': (in_yaml('weigh_kg: 0.9', 'weigh_kg: .inf'), 'weigh_kg: expected a number'),
    'a channel twice': (in_yaml('fl_upper: {channel: 1', 'fl_upper: {channel: 0'),
                        'channel 0 is given to more than one joint'),
    'a channel too many': (in_yaml('fl_hip: {channel: 0', 'fl_hip: {channel: 16'),
                           'servos.fl_hip: channel: expected 0 to 15, got 16'),
    'a direction of 2': (in_yaml('fl_hip: {channel: 0, direction: 1',
                                 'fl_hip: {channel: 0, direction: 2'), 'expected 1 or -1, got 2'),
    'a servo without a channel': (in_yaml('  fl_hip: {channel: 0, direction: 1}\n', ''),
                                  'servos: no channel for fl_hip'),
    'falls over': (in_yaml('"*_upper": 0.65', '"*_upper": -0.9, "b*_upper": -0.9'),
                   'centre of mass outside the support polygon|below the feet|needs'),
}


def changed(tmp_path, change):
    for name in ('dog12.urdf', 'dog12.yaml'):
        shutil.copy(ROBOTS / name, tmp_path)
    for name, old, new, count in (change if isinstance(change[0], tuple) else (change,)):
        path = tmp_path / name
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new, count))
    return tmp_path / 'dog12.yaml'


@pytest.mark.parametrize('what', BAD)
def test_a_damaged_robot_is_one_line_with_file_part_and_remedy(what, tmp_path):
    change, said = BAD[what]
    path = changed(tmp_path, change)
    before = sorted(tmp_path.iterdir())
    with pytest.raises(RobotFileError, match=said) as error:
        bodies.get(str(path))
    text = str(error.value)
    assert '\n' not in text
    assert text.startswith(f'{path}: ')
    assert len(text) < len(str(path)) + 500
    first = next(one for one in error.value.findings if one.grade is Grade.ERROR)
    assert first.fix
    assert sorted(tmp_path.iterdir()) == before


def test_a_file_of_binary_or_of_nothing_is_one_line(tmp_path):
    path = tmp_path / 'robot.yaml'
    for data in (b'', b'\x00\xff\xfe', b'- 1\n- 2\n', b'urdf: [1]\n', b'a: ' + b'[' * 5000):
        path.write_bytes(data)
        with pytest.raises(RobotFileError) as error:
            bodies.get(str(path))
        assert '\n' not in str(error.value)


WARN = {
    'a placeholder': (in_urdf('<inertia ixx="0.0003115"', '<inertia ixx="100"'),
                      'link trunk: moments of .* which no solid has'),
    'no inertial': (in_urdf('<mass value="0.06"/>', '<mass value="0"/>'),
                    'link computer: mass of 0 kg'),
    'a centre far away': (in_urdf('<origin xyz="0 0.012 0"/>', '<origin xyz="0 0.3 0"/>'),
                          'link fl_hip: its centre of mass lies 270 mm outside its shape'),
    'limits near': (in_urdf('lower="-2.4" upper="0.1"', 'lower="-1.6" upper="0.1"'),
                    'joint fl_lower: swings by 0.30 rad, not 0.50'),
    'feet a little apart': (in_urdf('xyz="0 0 -0.085"', 'xyz="0 0 -0.089"'),
                            'feet: differ by 3 mm'),
    'a hot servo': (in_yaml('torque_nm: 0.9', 'torque_nm: 0.15'), 'it runs hot'),
    'a scale': (in_yaml('weigh_kg: 0.9', 'weigh_kg: 4.0'), 'all masses are scaled by 4.46'),
    'a robot of lead': ((in_urdf('<mass value="0.42"/>', '<mass value="11.0"/>'),
                         in_yaml('weigh_kg: 0.9', 'length_m: 0.2'),
                         in_yaml('torque_nm: 0.9', 'torque_nm: 9')),
                        'weighs 11.5 kg as described, 9[0-9]{3} kg for a cubic metre'),
    'a name with a space': (in_urdf('"computer"', '"the computer"', 9),
                            'link the computer: is called the_computer here'),
    'a hyphen': (in_urdf('"fr_hip"', '"fr-hip"', 9), 'link fr-hip: is called fr_hip here'),
}


@pytest.mark.parametrize('what', WARN)
def test_what_is_odd_is_a_warning_and_the_robot_is_read(what, tmp_path):
    change, said = WARN[what]
    path = changed(tmp_path, change)
    if what == 'a hyphen':
        path.write_text(path.read_text().replace('fr_hip:', 'fr-hip:').replace('*_hip', '*?hip'))
    robot = robot_file.read(path)
    assert robot.body is not None
    lines = [str(finding) for finding in robot.findings]
    assert any(re.search(said, line) for line in lines), lines


def test_a_placeholder_of_100_kg_m2_is_replaced_by_the_tensor_of_the_shape(tmp_path):
    text = (ROBOTS / 'dog12.urdf').read_text()
    start = text.index('<inertia ', text.index('<link name="fl_upper"'))
    given = text[start:text.index('/>', start)]
    path = changed(tmp_path, in_urdf(given, '<inertia ixx="100" ixy="0" ixz="0" iyy="100" '
                                     'iyz="0" izz="100"'))
    robot = robot_file.read(path)
    assert any('100 kg m2 for 0.045 kg: placeholder; computed from its shape' in str(finding)
               for finding in robot.findings)
    moments = np.linalg.eigvalsh(link_inertia(robot.body.link('fl_upper')))
    assert moments.max() < 1e-4


def test_xacro_in_a_comment_or_a_commented_macro_is_no_xacro(tmp_path):
    link = '<link name="computer">'
    path = changed(tmp_path, in_urdf(
        link, f'<!-- <xacro:macro name="leg"> <box size="${{length}} 1 1"/> $(find x) -->{link}'))
    assert robot_file.read(path).body == robot_file.read(ROBOTS / 'dog12.yaml').body


def test_continuous_joints_turn_as_far_as_the_maker_says(tmp_path):
    path = changed(tmp_path, in_urdf('type="revolute"', 'type="continuous"', 99))
    assert robot_file.read(path).body == robot_file.read(ROBOTS / 'dog12.yaml').body


def test_what_is_no_hinge_is_held_still_if_it_is_locked(tmp_path):
    hinged = robot_file.read(ROBOTS / 'dog12.yaml').body
    path = changed(tmp_path, in_urdf('name="base_fixed" type="fixed"',
                                     'name="base_fixed" type="floating"'))
    with pytest.raises(RobotFileError, match='joint base_fixed: is floating'):
        robot_file.read(path)
    path.write_text(path.read_text() + 'locked: [base_fixed]\n')
    assert robot_file.read(path).body == hinged


@pytest.mark.parametrize(('centre_m', 'believed'), [
    ((0.0, 0.002, 0.0), True), ((0.0, 0.0, 0.0), False), ((0.0, 0.0, 0.09), False)])
def test_a_centre_of_mass_beside_its_shape_is_believed_between_the_joints(tmp_path, centre_m,
                                                                          believed):
    """The shape is a motor beside the far joint; nobody gave a centre of mass of 0 0 0."""
    path = changed(tmp_path, in_urdf('<origin xyz="0 0.012 0"/>',
                                     f'<origin xyz="{" ".join(map(str, centre_m))}"/>'))
    text = (tmp_path / 'dog12.urdf').read_text()
    start = text.index('<collision>', text.index('<link name="fl_hip">'))
    end = text.index('</collision>', start)
    part = '<origin xyz="0 0.05 0"/><geometry><sphere radius="0.004"/></geometry>'
    (tmp_path / 'dog12.urdf').write_text(text[:start] + '<collision>' + part + text[end:])
    robot = robot_file.read(path)
    said = [one for one in robot.findings if 'fl_hip' in one.where and 'outside' in one.what]
    assert (robot.body.link('fl_hip').centre_m, bool(said)) == (
        (centre_m, False) if believed else ((0.0, 0.05, 0.0), True))
