"""Bodies as makers describe them: what the registered bodies do not have."""

from w2b_core.bodies.model import Body, Box, Capsule, Cylinder, Joint, Link, Placed, Servo, Sphere

SERVO = Servo(gain_per_s=20.0, max_speed_up_rad_s=5.0, max_speed_down_rad_s=5.0,
              max_torque_nm=0.5)
#: Its principal axes lie skew in the link.
TENSOR = ((4.0e-4, 1.0e-4, -0.5e-4), (1.0e-4, 5.0e-4, 0.8e-4), (-0.5e-4, 0.8e-4, 6.0e-4))


def skew() -> Body:
    """A board on four fixed feet with an arm: full tensors, masses apart from the shapes."""
    feet = tuple(Placed(Sphere(0.01), (x, y, -0.05)) for x in (-0.06, 0.06) for y in (-0.05, 0.05))
    base = (Placed(Box((0.14, 0.12, 0.02))),
            Placed(Box((0.02, 0.02, 0.05)), (0.0, 0.0, 0.03), (0.5, 0.0, 0.3)),
            Placed(Cylinder(0.03, 0.01, (0.0, 0.0, 1.0)), (0.03, 0.0, 0.02)), *feet)
    arm = (Placed(Capsule(0.06, 0.008, (1.0, 0.0, 0.0)), (0.03, 0.0, 0.0)),)
    return Body(
        name='skew', description='a board on four feet with an arm',
        links=(Link('base_link', base, 0.4, inertia_kg_m2=TENSOR),
               Link('arm', arm, 0.05, (0.05, 0.01, 0.0),
                    inertia_kg_m2=((2e-5, 3e-6, 0.0), (3e-6, 4e-5, 0.0), (0.0, 0.0, 5e-5)))),
        joints=(Joint('shoulder', 'base_link', 'arm', (0.0, 0.0, 0.06), (0.0, -1.0, 0.0),
                      servo=SERVO),),
        sensors=(), height_m=0.06, length_m=0.12, world='earth')


def bent(leg_kg: float = 0.01) -> Body:
    """A biped on bent legs with long feet across: light legs under a heavy trunk, which creep."""
    links = [Link('base_link', Box((0.1, 0.16, 0.04)), 1.2)]
    joints = []
    for side, y in (('left', 0.07), ('right', -0.07)):
        thigh, shank = (0.04, 0.0, -0.06), (-0.04, 0.0, -0.06)
        links += [
            Link(f'{side}_thigh', (Placed(Capsule(0.06, 0.008, (0.5547, 0.0, -0.83205)),
                                          (0.02, 0.0, -0.03)),), leg_kg, (0.02, 0.0, -0.03)),
            Link(f'{side}_shank', (
                Placed(Capsule(0.06, 0.008, (-0.5547, 0.0, -0.83205)), (-0.02, 0.0, -0.03)),
                Placed(Capsule(0.12, 0.01, (1.0, 0.0, 0.0)), shank),
                Placed(Box((0.02, 0.04, 0.01)), (-0.03, 0.0, -0.05), (0.0, 0.4, 0.2)),
                Placed(Cylinder(0.03, 0.004, (1.0, 0.0, 1.0)), (-0.01, 0.0, -0.02))),
                leg_kg, (-0.03, 0.0, -0.045))]
        joints += [Joint(f'{side}_hip', 'base_link', f'{side}_thigh', (0.0, y, -0.02),
                         (0.0, -1.0, 0.0), servo=SERVO),
                   Joint(f'{side}_knee', f'{side}_thigh', f'{side}_shank', thigh,
                         (0.0, -1.0, 0.0), servo=SERVO)]
    return Body(name='bent', description='a biped on bent legs', links=tuple(links),
                joints=tuple(joints), sensors=(), height_m=0.15, length_m=0.12, world='earth')
