"""The spherical robots of the paper: a pendulum swings inside a sphere and rolls it."""

from math import pi

from w2b_core.bodies.model import Body, Capsule, Joint, Link, Sphere, X, Y

RADIUS_M = 0.1

#: What the sensor neuron reads: the paper's proprioception, the original program's wiring (there a
#: sensor's own number is taken for a neuron's, so the 'sensor' is motor neuron 0), or nothing.
WIRINGS = {'sensors': ('position:pendulum',), 'original': ('motor:pendulum',), 'blind': ()}


def spherical(degrees_of_freedom: int, wiring: str) -> Body:
    """
    Return the sphere with 1 or 2 degrees of freedom and a wiring of `WIRINGS`.

    With one degree of freedom the bob's joint exists and is locked: its motor neuron does nothing.
    """
    bob_limit_rad = pi / 2 if degrees_of_freedom == 2 else 0.0
    return Body(
        name=f'spherical_{degrees_of_freedom}dof_{wiring}',
        description=f'pendulum with {degrees_of_freedom} degree(s) of freedom in a sphere, '
                    f'{wiring}',
        links=(Link('base_link', Sphere(RADIUS_M), mass_kg=0.5),
               Link('pendulum_link', Capsule(0.1, 0.01, X), inertia_axis=Y),
               Link('bob_link', Sphere(0.02), centre_m=(0.04, 0.0, 0.0))),
        joints=(Joint('pendulum', 'base_link', 'pendulum_link', (0.0, 0.0, 0.0),
                      axis=(0.0, -1.0, 0.0), lower_rad=-pi / 2, upper_rad=pi / 2,
                      time_constant=0.3),
                Joint('bob', 'pendulum_link', 'bob_link', (0.0, 0.0, 0.0), axis=(1.0, 0.0, 0.0),
                      lower_rad=-bob_limit_rad, upper_rad=bob_limit_rad, time_constant=0.3)),
        sensors=WIRINGS[wiring], height_m=RADIUS_M, length_m=2 * RADIUS_M)
