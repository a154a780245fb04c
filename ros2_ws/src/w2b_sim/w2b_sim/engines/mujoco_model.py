"""A body and a world as MJCF, the model description that MuJoCo reads."""

from __future__ import annotations

from math import ceil
from xml.etree import ElementTree

import numpy as np

from w2b_core.bodies.inertia import link_inertia
from w2b_core.bodies.model import Body, Box, Capsule, Cylinder, Joint, Link, Placed, Vector
from w2b_core.bodies.turning import from_rpy, quaternion_wxyz
from w2b_sim.worlds import World

#: Coulomb's coefficient where the world asks for unbounded friction, as in PyBullet.
FRICTION_FOR_UNBOUNDED = 2.0
#: A physics step that is longer is divided: stiff contacts need small ones.
LONGEST_STEP_S = 0.005
#: A link this close to the floor touches it.
TOUCH_THRESHOLD_M = 0.002
#: Share of its asked velocity that a motor constraint reaches in a step: MuJoCo's impedance.
MOTOR_IMPEDANCE = 0.9999
#: Friction is this many times as stiff as the normal direction, so that feet hardly creep.
FRICTION_STIFFNESS = 10.0
_FLOOR, _ROBOT = '2', '1'


def substeps(world: World) -> int:
    """Return MuJoCo's steps in one physics step of the world."""
    return ceil(world.physics_step_s / LONGEST_STEP_S - 1e-9)


def moves(joint: Joint) -> bool:
    """Return whether a joint leaves any motion; a locked one is none to MuJoCo."""
    return joint.lower_rad < joint.upper_rad


def to_mjcf(body: Body, world: World) -> str:
    """
    Return the MJCF document of `body` on the floor of `world`.

    Every servo is a motor constraint: a joint's dry friction of the servo's torque, which the
    engine makes relative to the velocity that the servo steers for.
    """
    friction = FRICTION_FOR_UNBOUNDED if world.friction is None else world.friction
    root = ElementTree.Element('mujoco', model=body.name)
    ElementTree.SubElement(root, 'compiler', angle='radian', balanceinertia='true',
                           autolimits='false')
    ElementTree.SubElement(
        root, 'option', timestep=_number(world.physics_step_s / substeps(world)),
        gravity=_numbers((0.0, 0.0, world.gravity_m_s2)), cone='elliptic',
        impratio=_number(FRICTION_STIFFNESS))
    scene = ElementTree.SubElement(root, 'worldbody')
    ElementTree.SubElement(scene, 'light', pos='0 0 3', dir='0 0 -1', directional='true')
    ElementTree.SubElement(scene, 'geom', name='floor', type='plane', size='0 0 1',
                           friction=_numbers((friction, 0.0, 0.0)), condim='3',
                           contype=_FLOOR, conaffinity=_ROBOT, rgba='0.9 0.9 0.88 1')
    base = ElementTree.SubElement(scene, 'body', name=body.links[0].name,
                                  pos=_numbers((0.0, 0.0, body.height_m)))
    ElementTree.SubElement(base, 'freejoint')
    elements = {body.links[0].name: base}
    _fill(base, body.links[0], friction)
    for joint in body.joints:
        link = body.link(joint.child)
        element = ElementTree.SubElement(elements[joint.parent], 'body', name=link.name,
                                         pos=_numbers(joint.origin_m))
        if moves(joint):
            ElementTree.SubElement(
                element, 'joint', name=joint.name, type='hinge', axis=_numbers(joint.axis),
                limited='true', range=f'{joint.lower_rad!r} {joint.upper_rad!r}',
                frictionloss=_number(joint.servo.max_torque_nm),
                solimpfriction=_numbers((MOTOR_IMPEDANCE, MOTOR_IMPEDANCE, 1.0)))
        _fill(element, link, friction)
        elements[link.name] = element
    return ElementTree.tostring(root, encoding='unicode')


def _fill(element: ElementTree.Element, link: Link, friction: float) -> None:
    """Add what a link weighs and what of it can touch."""
    tensor = link_inertia(link)
    ElementTree.SubElement(
        element, 'inertial', pos=_numbers(link.centre_m), mass=_number(link.mass_kg),
        fullinertia=_numbers(tensor[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]))
    for placed in link.shapes:
        ElementTree.SubElement(
            element, 'geom', _geometry(placed), friction=_numbers((friction, 0.0, 0.0)),
            condim='3', contype=_ROBOT, conaffinity=_FLOOR, rgba='0.25 0.45 0.7 1',
            margin='0', gap=_number(TOUCH_THRESHOLD_M))


def _geometry(placed: Placed) -> dict[str, str]:
    shape, turn = placed.shape, from_rpy(placed.rpy_rad)
    centre = {'pos': _numbers(placed.centre_m)}
    if isinstance(shape, Box):
        return {**centre, 'type': 'box', 'size': _numbers(np.asarray(shape.size_m) / 2),
                'quat': _numbers(quaternion_wxyz(turn))}
    if isinstance(shape, Capsule | Cylinder):
        half = turn @ np.asarray(shape.axis) * shape.length_m / 2
        middle = np.asarray(placed.centre_m)
        return {'type': 'capsule' if isinstance(shape, Capsule) else 'cylinder',
                'size': _number(shape.radius_m),
                'fromto': _numbers(np.concatenate([middle - half, middle + half]))}
    return {**centre, 'type': 'sphere', 'size': _number(shape.radius_m)}


def _number(value: float) -> str:
    return repr(float(value))


def _numbers(values: Vector | tuple[float, ...] | np.ndarray) -> str:
    return ' '.join(_number(value) for value in values)
