"""`w2b robot draw`: what the drawings say is what the body is; the SVG is parsed."""

import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from w2b_core import bodies
from w2b_core.bodies.physical_twin import (
    COXA_M,
    FEMUR_M,
    HIP_FROM_AXIS_M,
    LEG_RADIUS_M,
    TIBIA_M,
)
from w2b_core.bodies.robot_file.directions import motions
from w2b_hw.calibration import nominal
from w2b_hw.imu.registry import PARTS
from w2b_hw.joints import named
from w2b_sim.own_robot.command import main
from w2b_sim.own_robot.drawing import VIEWS

ROBOTS = Path(__file__).resolve().parents[2] / 'examples' / 'robots'
BODIES = (*bodies.BUILT_IN, *(str(ROBOTS / f'{name}.yaml') for name in ('dog8', 'dog12',
                                                                        'spider12')))
SVG = '{http://www.w3.org/2000/svg}'


def drawn(tmp_path, body, sheet='views'):
    """Return the SVG's root, its elements by their ids, and all it says."""
    path = tmp_path / f'{sheet}.svg'
    assert main(['draw', body, '--out', str(path), '--sheet', sheet]) == 0
    root = ElementTree.fromstring(path.read_bytes())
    return root, {element.get('id'): element for element in root.iter() if element.get('id')}, [
        text.text for text in root.iter(f'{SVG}text')]


def line(element):
    """Return the points (N, 2) of an element's path; y up."""
    [path] = element.iter(f'{SVG}path')
    numbers = [float(number) for number in re.findall(r'-?[\d.]+', path.get('d'))]
    return np.array(numbers).reshape(-1, 2) * np.array([1, -1])


def number(element):
    [text] = element.iter(f'{SVG}text')
    return float(text.text)


@pytest.mark.parametrize('name', BODIES, ids=lambda name: Path(name).stem)
def test_every_joint_is_named_with_its_output_and_turns_the_right_way(tmp_path, name):
    body, wiring = bodies.get(name), bodies.wiring(name)
    _root, elements, said = drawn(tmp_path, name)
    for joint in body.joints:
        # In a view, with its output beside it, and in the table.
        beside = [index for index, text in enumerate(said) if text == joint.name]
        assert any(said[index + 1] == f'ch {wiring[joint.name].channel}' for index in beside)
        assert len(beside) >= 2
        arc = line(elements[f'arrow:{joint.name}'])
        # Where the axis points at the viewer it turns counter-clockwise, else the other way.
        view = next(index for index in range(len(VIEWS)) if any(
            element.get('id') == f'arrow:{joint.name}' for element in elements[
                f'axes_{index + 1}'].iter()))
        facing = np.asarray(joint.axis) @ np.array(VIEWS[view][3]) / np.linalg.norm(joint.axis)
        assert abs(facing) > 0.5, 'seen from a side where it hardly shows'
        middle, turned = arc[len(arc) // 2] - (arc[0] + arc[-1]) / 2, arc[-1] - arc[0]
        assert (middle[0] * turned[1] - middle[1] * turned[0] > 0) == (facing > 0)


def test_an_arrow_goes_where_ten_degrees_take_the_leg(tmp_path):
    body = bodies.get('physical_twin')
    _root, elements, _ = drawn(tmp_path, 'physical_twin')
    ways = {joint: motion.way_m for joint, motion in motions(body).items()}
    for joint in body.joints:
        view = 1 if joint.name.endswith('hip') else 0 if '_left_' in joint.name else 2
        _title, axes, sign, _way = VIEWS[view]
        way = ways[joint.name][list(axes)] * np.array([sign, 1])
        arc = line(elements[f'arrow:{joint.name}'])
        if joint.name.endswith('knee'):
            assert arc[-1][1] > arc[0][1], 'a positive knee lifts the leg'
        else:
            assert (arc[-1] - arc[0]) @ way > 0, joint.name


@pytest.mark.parametrize('name', BODIES, ids=lambda name: Path(name).stem)
def test_dimensions_are_those_of_the_body_and_drawn_to_one_scale(tmp_path, name):
    body = bodies.get(name)
    _root, elements, _ = drawn(tmp_path, name)
    # From the body's own data, another way than the drawing does: by a dense cloud of its shapes.
    from w2b_core.bodies.robot_file.stance import origins_m
    from w2b_sim.own_robot.outline import _surface
    origins = origins_m(body)
    cloud = np.concatenate([_surface(placed) + origins[link.name] for link in body.links
                            for placed in link.shapes])
    size_mm = 1000 * np.ptp(cloud, axis=0)
    for view, axis, what in ((0, 0, 'length'), (0, 2, 'height'), (1, 1, 'width'),
                             (1, 0, 'length'), (3, 1, 'width'), (3, 2, 'height')):
        # Long cylinders of makers' robots count as capsules, and balls are sampled.
        assert number(elements[f'number:{view}:overall {what}']) == pytest.approx(
            size_mm[axis], rel=0.02, abs=0.2)
    for view in (0, 1, 3):
        scales = [np.linalg.norm(np.ptp(line(element), axis=0))
                  / number(elements[name.replace('dimension', 'number')])
                  for name, element in elements.items() if name.startswith(f'dimension:{view}:')]
        assert len(scales) >= 2
        assert np.ptp(scales) < 0.01 * np.mean(scales), 'numbers and lines disagree'


def test_the_twins_dimensions_are_those_of_its_source(tmp_path):
    _root, elements, said = drawn(tmp_path, 'physical_twin')
    for joint, length_m in (('hip', COXA_M), ('knee', FEMUR_M), ('ankle', TIBIA_M)):
        assert number(elements[f'number:limb:front_left_{joint}']) == 1000 * length_m
    assert number(elements['number:0:base length']) == 120
    assert number(elements['number:0:base height']) == 40
    assert number(elements['number:0:overall height']) == 1000 * (0.02 + TIBIA_M + LEG_RADIUS_M)
    apart_mm = round(1000 * HIP_FROM_AXIS_M * 2**0.5, 1)
    assert number(elements['number:1:first axes length']) == apart_mm
    assert number(elements['number:1:first axes width']) == apart_mm
    assert f'end (radius {1000 * LEG_RADIUS_M:g})' in said
    # Channel, name, limits and motion, as the calibration asks for them.
    row = said.index('front_left_hip', said.index('+10 degrees moves'))
    assert said[row - 1:row + 3] == ['0', 'front_left_hip', '-30..30',
                                     motions(bodies.get('physical_twin'))['front_left_hip'].words]


def test_the_same_body_gives_the_same_bytes(tmp_path):
    for sheet in ('views', 'wiring', 'horns'):
        drawn(tmp_path, 'physical_twin', sheet)
        first = (tmp_path / f'{sheet}.svg').read_bytes()
        drawn(tmp_path, 'physical_twin', sheet)
        assert (tmp_path / f'{sheet}.svg').read_bytes() == first


@pytest.mark.parametrize('name', BODIES, ids=lambda name: Path(name).stem)
def test_the_wiring_has_every_servo_at_its_output_and_the_addresses_of_the_drivers(tmp_path, name):
    wiring = bodies.wiring(name)
    _root, elements, said = drawn(tmp_path, name, 'wiring')
    outputs = {int(key.removeprefix('output:')): element.find(f'{SVG}text').text
               for key, element in elements.items() if key.startswith('output:')}
    assert outputs == {wired.channel: joint for joint, wired in wiring.items()}
    whole = ' '.join(said)
    board = nominal(joints=named(name)).board.address
    for address in (board, *(address for part in PARTS for address in part.addresses)):
        assert f'0x{address:02X}' in whole
    for pin in ('pin 1: 3.3 V', 'pin 3: SDA', 'pin 5: SCL', 'pin 6: GND', 'V+ (servos)'):
        assert pin in said


def test_a_wiring_of_ones_own_is_drawn(tmp_path):
    for name in ('dog8.urdf', 'dog8.yaml'):
        (tmp_path / name).write_bytes((ROBOTS / name).read_bytes())
    path = tmp_path / 'dog8.yaml'
    joints = [joint.name for joint in bodies.get(str(path)).joints]
    path.write_text(path.read_text() + 'servos:\n' + ''.join(
        f'  {joint}: {{channel: {15 - number}, direction: -1, zero_us: 1480}}\n'
        for number, joint in enumerate(joints)))
    _root, elements, _ = drawn(tmp_path, str(path), 'wiring')
    assert elements['output:15'].find(f'{SVG}text').text == joints[0]
    _root, _elements, said = drawn(tmp_path, str(path), 'horns')
    assert f'{joints[0]}, ch 15, longer pulse: -' in said
    assert said.count('1480 us') == len(joints)
    # 0.5 rad at 2000 us for 180 degrees; the direction is reversed.
    assert f'{1480 - 0.5 * 2000 / np.pi:.0f} us' in said


def test_horns_have_the_pulses_that_the_hardware_would_send(tmp_path):
    _root, _elements, said = drawn(tmp_path, 'physical_twin', 'horns')
    for servo, joint in zip(nominal().servos, bodies.get('physical_twin').joints, strict=True):
        assert f'{joint.name}, ch {servo.channel}, longer pulse: +' in said
        for angle_rad in (0.0, joint.lower_rad, joint.upper_rad):
            assert f'{servo.pulse_us(angle_rad):.0f} us' in said


@pytest.mark.parametrize(('arguments', 'expected'), [
    (('nobody', '--out', 'x.svg'), 'body: expected one of quadruped, '),
    (('missing.yaml', '--out', 'x.svg'), 'missing.yaml'),
    (('physical_twin', '--out', 'x.png'), 'expected a name that ends in .svg, got x.png'),
    (('physical_twin', '--out', 'no/such/x.svg'), 'no/such')])
def test_slips_are_answered_in_a_line(tmp_path, monkeypatch, capsys, arguments, expected):
    monkeypatch.chdir(tmp_path)
    assert main(['draw', *arguments]) == 1
    said = capsys.readouterr().err
    assert expected in said
    assert 'Traceback' not in said
    assert list(tmp_path.iterdir()) == []
