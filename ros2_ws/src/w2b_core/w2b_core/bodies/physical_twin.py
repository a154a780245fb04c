"""
The physical quadruped's twin: 12 position servos of 14 g, hip, knee and ankle on four legs.

The paper names the parts (a laser-cut wooden body with a Raspberry Pi 3B+, a PWM driver, an IMU and
a buck converter; printed legs; 12 micro servos of 14 g) and no dimensions. These are a plausible
build of such parts:

=============  ===========================================  ======
part           what it holds                                 mass
=============  ===========================================  ======
base_link      0.12 x 0.12 x 0.04 m: plates 90 g, Pi 45 g,   231 g
               driver, IMU, converter 40 g, 4 hip servos
each coxa      30 mm: knee servo and bracket                  22 g
each femur     50 mm: ankle servo and two printed sides       24 g
each tibia     70 mm: printed, rubber foot                    12 g
=============  ===========================================  ======

The servo is a metal-gear micro servo at 5 V: data sheets of this class name 0.18 N m stall torque
and 0.10 s for 60 degrees without load (10.5 rad/s); half of that speed is assumed under load.
"""

from math import cos, pi, sin

from w2b_core.bodies.model import Body, Box, Capsule, Joint, Link, Servo, Vector, Z

SERVO = Servo(gain_per_s=20.0, max_speed_up_rad_s=5.0, max_speed_down_rad_s=5.0,
              max_torque_nm=0.18)
BODY_M: Vector = (0.12, 0.12, 0.04)
HIP_FROM_AXIS_M = 0.08
COXA_M, FEMUR_M, TIBIA_M = 0.03, 0.05, 0.07
LEG_RADIUS_M = 0.008
HIP_LIMIT_RAD = pi / 6
#: Leg and the direction in which it stands out, counter-clockwise from the front left.
LEGS = (('front_left', pi / 4), ('back_left', 3 * pi / 4), ('back_right', -3 * pi / 4),
        ('front_right', -pi / 4))


def physical_twin() -> Body:
    """Return the twin: hips turn about the vertical; positive knees and ankles lift the leg."""
    links = [Link('base_link', Box(BODY_M), mass_kg=0.231)]
    hips, knees, ankles = [], [], []
    for leg, angle in LEGS:
        outward: Vector = (cos(angle), sin(angle), 0.0)
        lifting: Vector = (sin(angle), -cos(angle), 0.0)

        def along(distance_m: float, outward: Vector = outward) -> Vector:
            return (outward[0] * distance_m, outward[1] * distance_m, 0.0)

        coxa, femur, tibia = f'{leg}_coxa', f'{leg}_femur', f'{leg}_tibia'
        links += [
            Link(coxa, Capsule(COXA_M - 2 * LEG_RADIUS_M, LEG_RADIUS_M, outward), 0.022,
                 along(COXA_M / 2)),
            Link(femur, Capsule(FEMUR_M, LEG_RADIUS_M, outward), 0.024, along(FEMUR_M / 2)),
            Link(tibia, Capsule(TIBIA_M, LEG_RADIUS_M, Z), 0.012, (0.0, 0.0, -TIBIA_M / 2))]
        hips.append(Joint(f'{leg}_hip', 'base_link', coxa, along(HIP_FROM_AXIS_M), Z,
                          -HIP_LIMIT_RAD, HIP_LIMIT_RAD, SERVO, time_constant=0.3))
        knees.append(Joint(f'{leg}_knee', coxa, femur, along(COXA_M), lifting,
                           servo=SERVO, time_constant=1.0))
        ankles.append(Joint(f'{leg}_ankle', femur, tibia, along(FEMUR_M), lifting,
                            servo=SERVO, time_constant=1.0))
    return Body(
        name='physical_twin',
        description='12 position servos: hip, knee and ankle on four legs; no sensors',
        links=tuple(links), joints=tuple(hips + knees + ankles), sensors=(),
        height_m=TIBIA_M + LEG_RADIUS_M, length_m=BODY_M[0], world='earth')
