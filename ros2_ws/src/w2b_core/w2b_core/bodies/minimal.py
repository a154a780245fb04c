"""The minimal robot of the paper: two capsules and a hinge."""

from w2b_core.bodies.model import Body, Capsule, Joint, Link, X, Y, Z

LENGTH_M = 1.0
RADIUS_M = 0.1


def minimal() -> Body:
    """Return the minimal robot: a lying capsule (the base) and a standing one below its end."""
    return Body(
        name='minimal',
        description='two capsules joined end to end by one hinge',
        links=(Link('base_link', Capsule(LENGTH_M, RADIUS_M, X), inertia_axis=Y),
               Link('lower_link', Capsule(LENGTH_M, RADIUS_M, Z),
                    centre_m=(0.0, 0.0, -LENGTH_M / 2))),
        joints=(Joint('hinge', 'base_link', 'lower_link', (-LENGTH_M / 2, 0.0, 0.0),
                      axis=(0.0, -1.0, 0.0)),),
        sensors=('touch:base_link', 'touch:lower_link', 'position:hinge'),
        height_m=1.1, length_m=1.0)
