"""What the batched engine models, and the refusal of all else with the reason."""

from __future__ import annotations

from math import hypot

from w2b_sim.bodies.model import Body, Box, Capsule, Servo, Sphere

#: Kinds of sensors, as the kernel numbers them.
TOUCH, POSITION, MOTOR = range(3)
SENSOR_KINDS = {'touch': TOUCH, 'position': POSITION, 'motor': MOTOR}


class UnsupportedBodyError(ValueError):
    """A body is outside what the batched engine models; the message says in what."""


def refuse_what_is_not_modelled(body: Body) -> None:
    """Raise UnsupportedBodyError if the body is outside what the engine models."""
    def refuse(reason: str) -> None:
        raise UnsupportedBodyError(f'{body.name}: the batched engine does not model {reason}')

    names = [link.name for link in body.links]
    placed = {names[0]}
    if len(set(names)) != len(names):
        refuse('links of the same name')
    for link in body.links:
        if not isinstance(link.shape, Box | Capsule | Sphere):
            refuse(f'the shape {type(link.shape).__name__} of link {link.name}: '
                   'expected Box, Capsule or Sphere')
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
    joints = {joint.name for joint in body.joints}
    for sensor in body.sensors:
        kind, _colon, source = sensor.partition(':')
        if kind not in SENSOR_KINDS or source not in (names if kind == 'touch' else joints):
            refuse(f'the sensor {sensor!r}')
