"""What the kernel keeps of a robot between steps, and what it works out within one step."""

from __future__ import annotations

from w2b_sim.engines.batched.algebra import inlined
from w2b_sim.engines.batched.memory import structure
from w2b_sim.engines.batched.simd import splat

#: Kept between steps. Every link has its own pose, integrated by itself as in the original's
#: engine. World axes.
State = structure('State', {
    'place': (3,),                   # base centre of mass, m
    'turn': ('links', 4),            # orientation quaternion w, x, y, z
    'offset': ('links', 3),          # of the link's centre of mass from the base's, m
    'velocity': ('links', 3),        # of the centre of mass, m/s
    'spin': ('links', 3),            # angular velocity, rad/s
    'angle': ('joints',),            # hinge angle, rad
    'motors': ('joints',),           # motor neurons
    'target': ('joints',),           # angle the servos steer for, rad
    'hidden': ('hidden',),           # hidden neurons
    'press': ('contacts',),          # impulses of the last step, to start the next solve from
    'press_first': ('contacts',),    # the same of the viscous solve's first stage
    'slide_x': ('contacts',),        # friction impulses of the last step
    'slide_y': ('contacts',),
    'strength': (1,),                # factor of the servos' torque
    'mode': ('dynamic',),            # of the dynamic joints in the last step, see `motors`
    'motor': ('dynamic',),           # impulses of their motors and stops in the last step
})

#: Geometry and velocities of the present step, world axes. A link's velocity is the base's rigid
#: motion plus `drive`, `drive_spin`: what the kinematic joints and the drift correction add.
Frame = structure('Frame', {
    'rotation': ('links', 9),        # row-major rotation matrix of each link
    'arm': ('links', 3),             # from the base's centre of mass to the link's, m
    'hinge': ('links', 3),           # from the base's centre of mass to the link's hinge, m
    'axis': ('links', 3),            # that hinge's axis
    'drive': ('links', 3),           # m/s
    'drive_spin': ('links', 3),      # rad/s
    'rate': ('joints',),             # what the servos ask for, rad/s
    'depth': ('contacts',),          # of each contact sphere below the floor, m
    'contact_arm': ('contacts', 3),  # from the base's centre of mass to the touching point, m
    'contact_drive': ('contacts', 3),  # that point's share of `drive`, m/s
})


@inlined
def rest(layout, tables, state, frame, start):
    """
    Put the body into its rest pose, turned as a whole and at rest.

    Also sets the base's entries of the frame, which never change.

    `start` (5,): height of the base's centre of mass and the quaternion w, x, y, z.
    """
    w, x, y, z = start[1], start[2], start[3], start[4]
    zero = splat(layout, 0.0)
    state.place[0] = zero
    state.place[1] = zero
    state.place[2] = start[0]
    for k in range(layout.links):
        for i in range(4):
            state.turn[k, i] = start[1 + i]
        dx, dy, dz = tables.rest[k, 0], tables.rest[k, 1], tables.rest[k, 2]
        state.offset[k, 0] = ((1.0 - 2.0 * (y * y + z * z)) * dx + 2.0 * (x * y - w * z) * dy
                              + 2.0 * (x * z + w * y) * dz)
        state.offset[k, 1] = (2.0 * (x * y + w * z) * dx + (1.0 - 2.0 * (x * x + z * z)) * dy
                              + 2.0 * (y * z - w * x) * dz)
        state.offset[k, 2] = (2.0 * (x * z - w * y) * dx + 2.0 * (y * z + w * x) * dy
                              + (1.0 - 2.0 * (x * x + y * y)) * dz)
        for i in range(3):
            state.velocity[k, i] = zero
            state.spin[k, i] = zero
    for i in range(3):
        frame.arm[0, i] = zero
        frame.drive[0, i] = zero
        frame.drive_spin[0, i] = zero
    for j in range(layout.joints):
        state.angle[j] = zero
        state.motors[j] = zero
    state.strength[0] = splat(layout, 1.0)
    for d in range(layout.dynamic):
        state.mode[d] = zero
        state.motor[d] = zero
    for contact in range(layout.contacts):
        state.press[contact] = zero
        state.press_first[contact] = zero
        state.slide_x[contact] = zero
        state.slide_y[contact] = zero
