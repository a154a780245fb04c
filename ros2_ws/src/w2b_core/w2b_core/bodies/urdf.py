"""A body as URDF, the robot description that ROS tools, viewers and PyBullet read."""

from __future__ import annotations

from collections.abc import Sequence
from math import isinf
from xml.etree import ElementTree

import numpy as np

from w2b_core.bodies.inertia import link_inertia
from w2b_core.bodies.model import Body, Box, Capsule, Cylinder, Link, Placed, Shape, Vector
from w2b_core.bodies.turning import from_rpy, to_rpy
from w2b_core.bodies.visuals import COLOURS as MATERIALS
from w2b_core.bodies.visuals import Visual, Visuals, of

#: Frame of the IMU messages.
IMU_FRAME = 'imu_link'
#: Of links that are drawn as their collision shapes: by the joints between the base and them.
COLOURS = ((0.85, 0.45, 0.15, 1.0), (0.20, 0.45, 0.70, 1.0), (0.15, 0.20, 0.30, 1.0))


def describe(body: Body) -> str:
    """Return the robot description of `body`, for people and tools: drawn parts, IMU's frame."""
    return to_urdf(body, imu_frame=IMU_FRAME, visuals=of(body))


def to_urdf(body: Body, *, capsule_element: bool = False, imu_frame: str = '',
            visuals: Visuals | None = None) -> str:
    """
    Return the URDF document of `body`.

    Parameters
    ----------
    body
        What is described.
    capsule_element
        URDF has no capsule: one becomes a cylinder and two spheres. Some readers know a `capsule`
        element; this writes that, one smooth shape, instead.
    imu_frame
        Name of the frame of the IMU messages: a link without mass at the base's origin, with its
        axes. Physics engines need none, and get none.
    visuals
        Drawn parts by link; a link that is not in it is drawn as its collision shapes.

    """
    robot, drawn = ElementTree.Element('robot', name=body.name), visuals or {}
    used = {part.colour for parts in drawn.values() for part in parts}
    for name, colour in (*((f'colour_{index}', colour) for index, colour in enumerate(COLOURS)),
                         *((name, MATERIALS[name]) for name in sorted(used))):
        material = ElementTree.SubElement(robot, 'material', name=name)
        ElementTree.SubElement(material, 'color', rgba=_numbers(colour))
    for link in body.links:
        plain = [Visual(placed.shape, f'colour_{min(_depth(body, link), len(COLOURS) - 1)}',
                        placed.centre_m, placed.rpy_rad) for placed in link.shapes]
        _add_link(robot, link, drawn.get(link.name, plain), capsule_element)
    for joint in body.joints:
        speed = max(joint.servo.max_speed_up_rad_s, 0.0)
        if not isinf(joint.servo.max_speed_down_rad_s):
            speed = max(speed, joint.servo.max_speed_down_rad_s)
        element = ElementTree.SubElement(robot, 'joint', name=joint.name, type='revolute')
        ElementTree.SubElement(element, 'parent', link=joint.parent)
        ElementTree.SubElement(element, 'child', link=joint.child)
        ElementTree.SubElement(element, 'origin', xyz=_numbers(joint.origin_m), rpy='0 0 0')
        ElementTree.SubElement(element, 'axis', xyz=_numbers(joint.axis))
        ElementTree.SubElement(
            element, 'limit', lower=_number(joint.lower_rad), upper=_number(joint.upper_rad),
            effort=_number(joint.servo.max_torque_nm), velocity=_number(speed))
    if imu_frame:
        ElementTree.SubElement(robot, 'link', name=imu_frame)
        element = ElementTree.SubElement(robot, 'joint', name=f'{imu_frame}_joint', type='fixed')
        ElementTree.SubElement(element, 'parent', link=body.links[0].name)
        ElementTree.SubElement(element, 'child', link=imu_frame)
        ElementTree.SubElement(element, 'origin', xyz='0 0 0', rpy='0 0 0')
    ElementTree.indent(robot)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(robot, encoding='unicode') + '\n'


def _add_link(robot: ElementTree.Element, link: Link, visuals: Sequence[Visual],
              capsule_element: bool) -> None:
    element = ElementTree.SubElement(robot, 'link', name=link.name)
    inertial = ElementTree.SubElement(element, 'inertial')
    ElementTree.SubElement(inertial, 'origin', xyz=_numbers(link.centre_m), rpy='0 0 0')
    ElementTree.SubElement(inertial, 'mass', value=_number(link.mass_kg))
    tensor = link_inertia(link)
    ElementTree.SubElement(inertial, 'inertia', {
        'i' + 'xyz'[row] + 'xyz'[column]: _number(tensor[row, column])
        for row in range(3) for column in range(row, 3)})
    for visual in visuals:
        for part in _add_shape(element, 'visual', Placed(
                visual.shape, visual.centre_m, visual.rpy_rad), capsule_element):
            ElementTree.SubElement(part, 'material', name=visual.colour)
    for placed in link.shapes:
        _add_shape(element, 'collision', placed, capsule_element)


def _add_shape(link: ElementTree.Element, kind: str, placed: Placed,
               capsule_element: bool) -> list[ElementTree.Element]:
    """Add a shape to a link as elements of a kind; return them."""
    added = []
    for tag, size, centre, rpy in _placed(placed, capsule_element):
        added.append(ElementTree.SubElement(link, kind))
        ElementTree.SubElement(added[-1], 'origin', xyz=_numbers(centre), rpy=_numbers(rpy))
        ElementTree.SubElement(ElementTree.SubElement(added[-1], 'geometry'), tag, size)
    return added


def _placed(placed: Placed, capsule_element: bool
            ) -> list[tuple[str, dict[str, str], np.ndarray, Vector]]:
    """Return (element, its attributes, its centre (3,), roll-pitch-yaw) in the link's frame."""
    centre, primitives = np.asarray(placed.centre_m), _primitives(placed.shape, capsule_element)
    if not any(placed.rpy_rad):
        return [(tag, size, centre + offset, rpy) for tag, size, offset, rpy in primitives]
    turn = from_rpy(placed.rpy_rad)
    return [(tag, size, centre + turn @ offset, to_rpy(turn @ from_rpy(rpy)))
            for tag, size, offset, rpy in primitives]


def _primitives(shape: Shape, capsule_element: bool
                ) -> list[tuple[str, dict[str, str], np.ndarray, Vector]]:
    """Return (element, its attributes, offset of its centre (3,), roll-pitch-yaw) a primitive."""
    here, upright = np.zeros(3), (0.0, 0.0, 0.0)
    if isinstance(shape, Box):
        return [('box', {'size': _numbers(shape.size_m)}, here, upright)]
    radius = {'radius': _number(shape.radius_m)}
    if not isinstance(shape, Capsule | Cylinder):
        return [('sphere', radius, here, upright)]
    x, y, z = shape.axis
    along_z = (0.0, float(np.arctan2(np.hypot(x, y), z)), float(np.arctan2(y, x)))
    smooth = capsule_element and isinstance(shape, Capsule)
    tube = ('capsule' if smooth else 'cylinder',
            {**radius, 'length': _number(shape.length_m)}, here, along_z)
    if smooth or isinstance(shape, Cylinder):
        return [tube]
    end = np.asarray(shape.axis) * (shape.length_m / 2)
    return [tube, ('sphere', radius, end, upright), ('sphere', radius, -end, upright)]


def _depth(body: Body, link: Link) -> int:
    """Return the number of joints between the base and `link`."""
    depth, name = 0, link.name
    parents = {joint.child: joint.parent for joint in body.joints}
    while name in parents:
        name, depth = parents[name], depth + 1
    return depth


def _number(value: float) -> str:
    return repr(float(value))


def _numbers(values: Vector | tuple[float, ...] | np.ndarray) -> str:
    return ' '.join(_number(value) for value in values)
