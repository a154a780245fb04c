"""
What a body looks like: the parts that viewers draw instead of the shapes that touch the floor.

They have no weight and touch nothing. A link without visuals is drawn as its collision shapes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import atan2, cos, pi, sin

from w2b_core.bodies.model import Body, Box, Capsule, Cylinder, Shape, Sphere, Vector, X, Y, Z
from w2b_core.bodies.physical_twin import COXA_M, FEMUR_M, HIP_FROM_AXIS_M, LEGS, TIBIA_M
from w2b_core.registry import Registry

#: Red, green, blue, alpha by the name of a material.
COLOURS: Mapping[str, tuple[float, float, float, float]] = {
    'wood': (0.80, 0.62, 0.40, 1.0), 'board': (0.10, 0.42, 0.22, 1.0),
    'metal': (0.72, 0.74, 0.77, 1.0), 'servo': (0.12, 0.26, 0.52, 1.0),
    'print': (0.90, 0.91, 0.93, 1.0), 'rubber': (0.13, 0.13, 0.15, 1.0),
    'signal': (0.93, 0.40, 0.10, 1.0), 'shell': (0.25, 0.29, 0.35, 1.0),
}
#: Body of a micro servo of 14 g, along its output axis last; and of its horn.
SERVO_M: Vector = (0.0228, 0.0122, 0.0225)
HORN = Cylinder(0.004, 0.0055, Z)


@dataclass(frozen=True)
class Visual:
    """
    One drawn part of a link.

    `centre_m` is the part's centre in the link's frame, `rpy_rad` its turn there (as URDF has it),
    `colour` the name of a material of `COLOURS`.
    """

    shape: Shape
    colour: str
    centre_m: Vector = (0.0, 0.0, 0.0)
    rpy_rad: Vector = (0.0, 0.0, 0.0)


Visuals = Mapping[str, Sequence[Visual]]
#: Body -> a function that returns the visuals of its links, by their names.
VISUALS: Registry[Callable[[], Visuals]] = Registry('visuals')


def of(body: Body) -> Visuals:
    """Return the visuals of a body's links; empty for a body that is drawn as its shapes."""
    found = VISUALS.get(body.name)() if body.name in VISUALS else {}
    # Another body may have the name: its links are others.
    return found if set(found) <= {link.name for link in body.links} else {}


def _physical_twin() -> Visuals:
    """Two wooden plates with the servos between them, the Pi on top, printed legs, rubber feet."""
    base = [
        Visual(Box((0.12, 0.12, 0.003)), 'wood', (0.0, 0.0, -0.0185)),
        Visual(Box((0.12, 0.12, 0.003)), 'wood', (0.0, 0.0, 0.0125)),
        # Raspberry Pi 3B+, its USB and Ethernet sockets at the back; driver and IMU before it.
        Visual(Box((0.085, 0.056, 0.0016)), 'board', (-0.015, 0.0, 0.0185)),
        *(Visual(Box((0.017, 0.014, 0.013)), 'metal', (-0.0505, y, 0.026))
          for y in (-0.018, 0.0, 0.018)),
        Visual(Box((0.015, 0.015, 0.003)), 'rubber', (-0.015, 0.0, 0.021)),
        Visual(Box((0.024, 0.06, 0.0016)), 'servo', (0.043, 0.0, 0.0155)),
        # The front, so that one sees where it looks.
        Visual(Box((0.004, 0.07, 0.012)), 'signal', (0.062, 0.0, -0.003)),
        *(Visual(Cylinder(0.004, 0.006, X), 'rubber', (0.064, y, -0.003)) for y in (-0.02, 0.02)),
        *(Visual(Cylinder(0.028, 0.003, Z), 'metal', (x, y, -0.003))
          for x in (-0.045, 0.045) for y in (-0.025, 0.025)),
    ]
    links: dict[str, Sequence[Visual]] = {'base_link': base}
    for leg, angle in LEGS:
        turn: Vector = (0.0, 0.0, angle)

        def at(outward_m: float, up_m: float = 0.0, aside_m: float = 0.0,
               angle: float = angle) -> Vector:
            return (outward_m * cos(angle) - aside_m * sin(angle),
                    outward_m * sin(angle) + aside_m * cos(angle), up_m)

        # Hip servos stand upright in the plates' corners, their axis is the hip's.
        base.append(Visual(Box(SERVO_M), 'servo', at(HIP_FROM_AXIS_M - 0.006, -0.003), turn))
        upright = (pi / 2, 0.0, angle)
        links[f'{leg}_coxa'] = (
            Visual(HORN, 'metal', at(0.0, 0.010)),
            Visual(Box((COXA_M, 0.014, 0.003)), 'print', at(COXA_M / 2, 0.0125), turn),
            Visual(Box((0.003, 0.026, 0.026)), 'print', at(0.012), turn),
            Visual(Box(SERVO_M), 'servo', at(COXA_M - 0.004), upright))
        links[f'{leg}_femur'] = (
            *(Visual(Box((FEMUR_M + 0.012, 0.003, 0.013)), 'print', at(FEMUR_M / 2, 0.0, aside),
                     turn) for aside in (-0.0145, 0.0145)),
            *(Visual(HORN, 'metal', at(0.0, 0.0, aside), upright) for aside in (-0.017, 0.017)),
            Visual(Box(SERVO_M), 'servo', at(FEMUR_M - 0.006), upright))
        links[f'{leg}_tibia'] = (
            *(Visual(HORN, 'metal', at(0.0, 0.0, aside), upright) for aside in (-0.0125, 0.0125)),
            *(Visual(Box((0.014, 0.003, 0.030)), 'print', at(0.0, -0.012, aside), turn)
              for aside in (-0.009, 0.009)),
            Visual(Box((0.013, 0.021, 0.004)), 'print', at(0.0, -0.027), turn),
            Visual(Cylinder(TIBIA_M - 0.030, 0.0055, Z), 'print',
                   (0.0, 0.0, -0.030 - (TIBIA_M - 0.030) / 2)),
            Visual(Sphere(0.0085), 'rubber', (0.0, 0.0, -TIBIA_M)))
    return links


def _quadruped() -> Visuals:
    """The paper's box and capsules, with a front to tell them by and feet that are sensors."""
    links: dict[str, Sequence[Visual]] = {'base_link': (
        Visual(Box((0.1, 0.1, 0.04)), 'shell'),
        Visual(Box((0.06, 0.06, 0.006)), 'board', (-0.01, 0.0, 0.022)),
        Visual(Box((0.012, 0.05, 0.008)), 'signal', (0.035, 0.0, 0.022)))}
    for leg, axis, outward in (('front', X, (1.0, 0.0)), ('left', Y, (0.0, 1.0)),
                               ('back', X, (-1.0, 0.0)), ('right', Y, (0.0, -1.0))):
        angle = atan2(outward[1], outward[0])
        joint = (pi / 2, 0.0, angle)
        links[f'{leg}_upper_leg'] = (
            Visual(Capsule(0.1, 0.0197, axis), 'servo',
                   (0.05 * outward[0], 0.05 * outward[1], 0.0)),
            Visual(Cylinder(0.046, 0.014, Z), 'metal', (0.0, 0.0, 0.0), joint))
        links[f'{leg}_lower_leg'] = (
            Visual(Capsule(0.1, 0.02, Z), 'signal' if leg == 'front' else 'print',
                   (0.0, 0.0, -0.05)),
            Visual(Cylinder(0.046, 0.014, Z), 'metal', (0.0, 0.0, 0.0), joint),
            Visual(Sphere(0.0225), 'rubber', (0.0, 0.0, -0.1)))
    return links


VISUALS.add('physical_twin', _physical_twin)
VISUALS.add('quadruped', _quadruped)
VISUALS.add('quadruped_blind', _quadruped)
