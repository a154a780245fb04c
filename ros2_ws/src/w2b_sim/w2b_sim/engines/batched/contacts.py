"""
Spheres on the floor: where they touch, and the rows they add to the solve.

Order of the unknowns: v_x, v_y, w_z | rates of the dynamic joints | v_z, w_x, w_y, velocities of the
base in world axes. A floor pushes along z, so the row of a normal impulse has zeros in the first
three places, and they stay zero through L^-1: normals are solved in the trailing unknowns alone.
"""

from __future__ import annotations

from w2b_sim.engines.batched.algebra import add, cross, get3, inlined, rotate, set3
from w2b_sim.engines.batched.simd import any_lane, fma, splat, vmax, where

#: A sphere is in contact from this gap on, and a touch sensor reads 1 from that one on, m. Where
#: feet stand exactly on the floor at the start, rounding would decide; both are above the rounding
#: of the heights in single precision. In the original the quadruped's feet start a rounding error
#: above the floor, touch, and have no contact in the first step (the body starts 1e-7 m higher
#: for that); the spheres start with contact; the minimal robot's foot hovers 1.7e-7 m above the
#: floor in the second step and does not touch.
CONTACT_GAP_M = 5e-8
TOUCH_GAP_M = 1.3e-7
#: Below every touch: what a link without a contact sphere near the floor starts from.
FAR_M = -1e30


@inlined
def find(layout, tables, state, frame, touch, near):
    """
    Work out depths, the touch sensors' depths and the contacts that some lane has.

    Returns their number; `near` (C,) lists them. A depth needs one row of the rotation matrix;
    arms and drives are worked out for the contacts in the list alone.
    """
    for sensor in range(layout.touches):
        touch[sensor] = splat(layout, FAR_M)
    count = 0
    for c in range(layout.contacts):
        k = tables.contact_link[c]
        radius = tables.contact_radius[c]
        offset = tables.contact_offset[c]
        height = fma(frame.rotation[k, 8], offset[2], fma(
            frame.rotation[k, 7], offset[1], frame.rotation[k, 6] * offset[0]))
        depth = radius - ((state.place[2] + state.offset[k, 2]) + height)
        frame.depth[c] = depth
        if tables.contact_touch[c] >= 0:
            sensor = tables.contact_touch[c]
            touch[sensor] = vmax(touch[sensor], depth)
        if any_lane(depth >= -CONTACT_GAP_M):
            near[count] = c
            count += 1
            lever = rotate(frame.rotation, k, offset)
            lever = (lever[0], lever[1], lever[2] - radius)
            set3(frame.contact_arm, c, add(get3(frame.arm, k), lever))
            set3(frame.contact_drive, c, add(
                get3(frame.drive, k), cross(get3(frame.drive_spin, k), lever)))
        else:
            state.press[c] = splat(layout, 0.0)
            state.press_first[c] = splat(layout, 0.0)
            state.slide_x[c] = splat(layout, 0.0)
            state.slide_y[c] = splat(layout, 0.0)
    return count


@inlined
def touching(depth):
    """Return 1 in the lanes whose depth makes a contact, else 0."""
    return where(depth >= -CONTACT_GAP_M, 1.0, depth * 0.0)


@inlined
def normal_row(layout, tables, frame, c, row):
    """Write the row that maps the unknowns to contact c's velocity along z."""
    zero = splat(layout, 0.0)
    row[0] = zero
    row[1] = zero
    row[2] = zero
    for d in range(layout.dynamic):
        row[3 + d] = _joint_velocity(layout, tables, frame, c, d)[2]
    row[3 + layout.dynamic] = splat(layout, 1.0)
    row[4 + layout.dynamic] = frame.contact_arm[c, 1]
    row[5 + layout.dynamic] = -frame.contact_arm[c, 0]


@inlined
def tangent_rows(layout, tables, frame, c, row_x, row_y):
    """Write the rows that map the unknowns to contact c's velocities along x and y."""
    zero, one = splat(layout, 0.0), splat(layout, 1.0)
    row_x[0] = one
    row_x[1] = zero
    row_x[2] = -frame.contact_arm[c, 1]
    row_y[0] = zero
    row_y[1] = one
    row_y[2] = frame.contact_arm[c, 0]
    for d in range(layout.dynamic):
        velocity = _joint_velocity(layout, tables, frame, c, d)
        row_x[3 + d] = velocity[0]
        row_y[3 + d] = velocity[1]
    row_x[3 + layout.dynamic] = zero
    row_x[4 + layout.dynamic] = zero
    row_x[5 + layout.dynamic] = frame.contact_arm[c, 2]
    row_y[3 + layout.dynamic] = zero
    row_y[4 + layout.dynamic] = -frame.contact_arm[c, 2]
    row_y[5 + layout.dynamic] = zero


@inlined
def _joint_velocity(layout, tables, frame, c, d):
    """Return the velocity of contact c while dynamic joint d turns at 1 rad/s and all else rests."""
    joint = tables.dynamic_joint[d]
    if tables.moves[joint, tables.contact_link[c]] == 0:
        zero = splat(layout, 0.0)
        return zero, zero, zero
    hinge = get3(frame.hinge, joint + 1)
    point = get3(frame.contact_arm, c)
    return cross(get3(frame.axis, joint + 1),
                 (point[0] - hinge[0], point[1] - hinge[1], point[2] - hinge[2]))
