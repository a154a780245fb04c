"""The quadruped of the paper: a box on four two-jointed legs with touch-sensitive feet."""

from w2b_core.bodies.model import Body, Box, Capsule, Joint, Link, Vector, X, Y, Z

BOX = Box((0.1, 0.1, 0.04))
HIP_FROM_AXIS_M = 0.05
SEGMENT_LENGTH_M = 0.1
SEGMENT_RADIUS_M = 0.02
#: In the original the feet start a rounding error above the floor: they touch and carry nothing in
#: the first step. Written out, it does not hang on rounding.
START_GAP_M = 1e-7
#: Leg, its outward direction, and the axis about which a positive angle lifts it. The original
#: measures a hinge's angle from the child to the parent about (-sin, cos, 0): the same thing.
LEGS: tuple[tuple[str, Vector, Vector, Vector], ...] = (
    ('front', (1.0, 0.0, 0.0), X, (0.0, -1.0, 0.0)),
    ('left', (0.0, 1.0, 0.0), Y, (1.0, 0.0, 0.0)),
    ('back', (-1.0, 0.0, 0.0), X, (0.0, 1.0, 0.0)),
    ('right', (0.0, -1.0, 0.0), Y, (-1.0, 0.0, 0.0)),
)


def _along(direction: Vector, distance_m: float) -> Vector:
    return (direction[0] * distance_m, direction[1] * distance_m, direction[2] * distance_m)


def quadruped(name: str = 'quadruped', touch: bool = True) -> Body:
    """Return the quadruped, with or without its four touch sensors."""
    links = [Link('base_link', BOX)]
    hips, knees = [], []
    for leg, outward, along, axis in LEGS:
        upper, lower = f'{leg}_upper_leg', f'{leg}_lower_leg'
        links.append(Link(upper, Capsule(SEGMENT_LENGTH_M, SEGMENT_RADIUS_M, along),
                          centre_m=_along(outward, SEGMENT_LENGTH_M / 2),
                          inertia_axis=Y if along == X else Z))
        links.append(Link(lower, Capsule(SEGMENT_LENGTH_M, SEGMENT_RADIUS_M, Z),
                          centre_m=(0.0, 0.0, -SEGMENT_LENGTH_M / 2)))
        hips.append(Joint(f'{leg}_hip', 'base_link', upper, _along(outward, HIP_FROM_AXIS_M), axis,
                          time_constant=0.3))
        knees.append(Joint(f'{leg}_knee', upper, lower, _along(outward, SEGMENT_LENGTH_M), axis,
                           time_constant=1.0))
    return Body(
        name=name,
        description='box on four legs of two segments' + ('' if touch else ', without sensors'),
        links=tuple(links), joints=tuple(hips + knees),
        sensors=tuple(f'touch:{leg[0]}_lower_leg' for leg in LEGS) if touch else (),
        height_m=0.12 + START_GAP_M, length_m=0.1)
