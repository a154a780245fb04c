"""What the batched engine models, and the refusal of all else with the reason."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from math import hypot, isfinite

from w2b_core.bodies.model import Body, Box, Capsule, Cylinder, Joint, Link, Servo, Shape, Sphere
from w2b_core.senses import AXES

#: Kinds of sensors, as the kernels number them; those from the fourth on are a leaky network's.
TOUCH, POSITION, MOTOR, YAW_RATE, GRAVITY, HEADING, STEER = range(7)
SENSOR_KINDS = {'touch': TOUCH, 'position': POSITION, 'motor': MOTOR}
LEAKY_SENSES = {**SENSOR_KINDS, 'yaw_rate': YAW_RATE, 'gravity': GRAVITY, 'heading': HEADING,
                'steer': STEER}


class UnsupportedBodyError(ValueError):
    """A body is outside what the batched engine models; the message says in what."""


def refuse_what_is_not_modelled(body: Body, kinds: Mapping[str, int] = SENSOR_KINDS) -> None:
    """
    Raise UnsupportedBodyError if the body is outside what the engine models.

    `kinds` are the senses of the networks that it is to run: `SENSOR_KINDS` or `LEAKY_SENSES`.
    """
    def refuse(reason: str) -> None:
        raise UnsupportedBodyError(f'{body.name}: the batched engine does not model {reason}')

    if not body.links or not body.joints:
        refuse('a body without links or without joints')
    if body.hidden_neurons < 1:
        refuse(f'{body.hidden_neurons} hidden neurons')
    names = [link.name for link in body.links]
    placed = {names[0]}
    if len(set(names)) != len(names):
        refuse('links of the same name')
    for link in body.links:
        if not link.shapes:
            refuse(f'link {link.name} without a shape')
        for part in link.shapes:
            if not isinstance(part.shape, Box | Capsule | Cylinder | Sphere):
                refuse(f'the shape {type(part.shape).__name__} of link {link.name}: '
                       'expected Box, Capsule, Cylinder or Sphere')
        if not link.mass_kg > 0:
            refuse(f'link {link.name} without mass: got {link.mass_kg} kg')
    for joint in body.joints:
        if type(joint.servo) is not Servo:
            refuse(f'the servo law {type(joint.servo).__name__} of joint {joint.name}')
        if joint.child in placed:
            refuse(f'closed loops: link {joint.child} has a second parent, by joint {joint.name}')
        if joint.parent not in placed:
            refuse(f'joint {joint.name} before the joint of its parent link {joint.parent}')
        if not hypot(*joint.axis) > 0:
            refuse(f'joint {joint.name} without an axis')
        if not joint.lower_rad <= joint.upper_rad:
            refuse(f'limits of joint {joint.name} that leave no angle')
        placed.add(joint.child)
    if loose := set(names) - placed:
        refuse(f'links that no joint holds: {", ".join(sorted(loose))}')
    if any(body.links[0].centre_m[:2]):
        refuse(f'a base whose centre of mass is not above or below its frame: put the frame of '
               f'{names[0]} there')
    for what, value, allowed in _quantities(body):
        if not allowed(value):
            refuse(f'{what} of {value}')
    joints = {joint.name for joint in body.joints}
    if len(joints) != len(body.joints):
        refuse('joints of the same name')
    if len(set(body.sensors)) != len(body.sensors):
        refuse('the same sensor twice')
    for sensor in body.sensors:
        kind, _colon, source = sensor.partition(':')
        sources: dict[str, Collection[str]] = {'touch': names, 'position': joints, 'motor': joints,
                                               'gravity': AXES}
        if kind not in kinds or source not in sources.get(kind, ('',)):
            refuse(f'the sensor {sensor!r}: expected a link, joint or axis of {body.name} after '
                   f'one of {", ".join(kinds)}')


def _positive(value: float) -> bool:
    return isfinite(value) and value > 0


def _at_least_0(value: float) -> bool:
    return isfinite(value) and value >= 0


def _not_negative(value: float) -> bool:
    """Infinity is no limit; NaN is nothing."""
    return value >= 0


def _quantities(body: Body) -> Iterator[tuple[str, float, Callable[[float], bool]]]:
    """Yield what a body's numbers are, the numbers, and what they must be."""
    yield 'a start height', body.height_m, isfinite
    for link in body.links:
        yield from _of_link(link)
    for joint in body.joints:
        yield from _of_joint(joint)


def _of_link(link: Link) -> Iterator[tuple[str, float, Callable[[float], bool]]]:
    yield f'a mass of link {link.name}', link.mass_kg, _positive
    for value in (*link.centre_m, *(link.inertia_axis or ())):
        yield f'a centre or axis of link {link.name}', value, isfinite
    for placed in link.shapes:
        for value in (*placed.centre_m, *placed.rpy_rad):
            yield f'a place of a shape of link {link.name}', value, isfinite
        for value, allowed in _sizes(placed.shape):
            yield f'a size of link {link.name}', value, allowed
    for row in link.inertia_kg_m2 or ():
        for value in row:
            yield f'an inertia of link {link.name}', value, isfinite


def _sizes(shape: Shape) -> Iterator[tuple[float, Callable[[float], bool]]]:
    if isinstance(shape, Box):
        yield from ((edge_m, _positive) for edge_m in shape.size_m)
        return
    yield shape.radius_m, _positive
    if isinstance(shape, Capsule | Cylinder):
        yield shape.length_m, _at_least_0 if isinstance(shape, Capsule) else _positive
        yield hypot(*shape.axis), _positive


def _of_joint(joint: Joint) -> Iterator[tuple[str, float, Callable[[float], bool]]]:
    for value in (*joint.origin_m, *joint.axis):
        yield f'a place or axis of joint {joint.name}', value, isfinite
    for value in (joint.lower_rad, joint.upper_rad):
        yield f'a limit of joint {joint.name}', value, isfinite
    servo = joint.servo
    yield f'a time constant of joint {joint.name}', joint.time_constant, _positive
    yield f'a servo gain of joint {joint.name}', servo.gain_per_s, _at_least_0
    yield f'a servo speed of joint {joint.name}', servo.max_speed_up_rad_s, _not_negative
    yield f'a servo speed of joint {joint.name}', servo.max_speed_down_rad_s, _not_negative
    yield f'a servo torque of joint {joint.name}', servo.max_torque_nm, _not_negative
