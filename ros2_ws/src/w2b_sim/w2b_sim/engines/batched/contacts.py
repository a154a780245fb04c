"""
Spheres on the floor: where they touch, and the rows they add to the solve.

The base's velocity, world axes, stands in the order v_x, v_y, w_z, v_z, w_x, w_y.
"""

from __future__ import annotations

from w2b_sim.engines.batched.algebra import add, cross, get3, inlined, rotate_row, row3, set3, sub
from w2b_sim.engines.batched.simd import any_lane, fma, splat, vmax
from w2b_sim.engines.batched.tree import BASE

#: Places of the base's velocities among its unknowns.
V_X, V_Y, W_Z, V_Z, W_X, W_Y = range(BASE)

#: A sphere is in contact from this gap on, and a touch sensor reads 1 from that one on, m. Where
#: feet stand exactly on the floor at the start, rounding would decide; both are above the rounding
#: of the heights in single precision. In the original the quadruped's feet start a rounding error
#: above the floor, touch, and have no contact in the first step (the body starts 1e-7 m higher
#: for that); the spheres start with contact; the minimal robot's foot hovers 1.7e-7 m above the
#: floor in the second step and does not touch.
CONTACT_GAP_M = 5e-8
TOUCH_GAP_M = 1.3e-7
#: No contact and no touch sensor reaches farther.
FARTHEST_GAP_M = 0.02
#: Below every touch: what a link without a contact sphere near the floor starts from.
FAR_M = -1e30


@inlined
def find(layout, tables, state, frame, touch, near, held, reach):
    """
    Work out depths, the touch sensors' depths and the contacts that some lane has.

    Contacts are spheres within `reach` of the floor. Returns their number; `near` (C,) lists them.
    A depth needs one row of the rotation matrix; arms and drives are worked out for the contacts
    in the list alone, and links far above the floor in all lanes are passed over. `held` (C,) says
    of which spheres an impulse is kept from the last step: those in its list.
    """
    for sensor in range(layout.touches):
        touch[sensor] = splat(layout, FAR_M)
    count = 0
    for k in range(layout.links):
        first, last = tables.contact_first[k], tables.contact_first[k + 1]
        height = state.place[2] + state.offset[k, 2]
        if any_lane(height <= tables.extent[k] + FARTHEST_GAP_M):
            for c in range(first, last):
                depth = _depth(frame, tables, k, c, height)
                sensor = tables.contact_touch[c]
                if sensor >= 0:
                    touch[sensor] = vmax(touch[sensor], depth)
                if any_lane(depth >= -reach):
                    near[count] = c
                    count += 1
                    held[c] = 1
                    frame.depth[c] = depth
                    lever = rotate_row(frame.rotation, k, tables.contact_offset, c)
                    lever = (lever[0], lever[1], lever[2] - tables.contact_radius[c])
                    set3(frame.contact_arm, c, add(get3(frame.arm, k), lever))
                    set3(frame.contact_drive, c, add(
                        get3(frame.drive, k), cross(get3(frame.drive_spin, k), lever)))
                elif held[c]:
                    _forget(layout, state, held, c)
        else:
            for c in range(first, last):
                if held[c]:
                    _forget(layout, state, held, c)
    return count


@inlined
def _depth(frame, tables, k, c, height):
    """Return how far sphere c of link k, whose centre of mass is at `height`, is in the floor."""
    offset = row3(tables.contact_offset, c)
    up = fma(frame.rotation[k, 8], offset[2], fma(
        frame.rotation[k, 7], offset[1], frame.rotation[k, 6] * offset[0]))
    return tables.contact_radius[c] - (height + up)


@inlined
def _forget(layout, state, held, c):
    """Drop the impulses of a contact that no lane has any more."""
    held[c] = 0
    state.press[c] = splat(layout, 0.0)
    state.press_first[c] = splat(layout, 0.0)
    state.slide_x[c] = splat(layout, 0.0)
    state.slide_y[c] = splat(layout, 0.0)


@inlined
def contact_rows(layout, tables, frame, c, row_x, row_y, row_z):
    """Write the rows that map the unknowns to the velocity of contact c along x, y and z."""
    zero, one = splat(layout, 0.0), splat(layout, 1.0)
    link, base = tables.contact_link[c], layout.chain
    x, y, z = get3(frame.contact_arm, c)
    for p in range(tables.chain_length[link]):
        turned = tables.dynamic_link[tables.chain_of[link, p]]
        hinge = get3(frame.hinge, turned)
        velocity = cross(get3(frame.axis, turned), sub((x, y, z), hinge))
        row_x[p] = velocity[0]
        row_y[p] = velocity[1]
        row_z[p] = velocity[2]
    for p in range(tables.chain_length[link], base):
        row_x[p] = zero
        row_y[p] = zero
        row_z[p] = zero
    for i in range(BASE):
        row_x[base + i] = zero
        row_y[base + i] = zero
        row_z[base + i] = zero
    row_x[base + V_X] = one
    row_x[base + W_Y] = z
    row_x[base + W_Z] = -y
    row_y[base + V_Y] = one
    row_y[base + W_X] = -z
    row_y[base + W_Z] = x
    row_z[base + V_Z] = one
    row_z[base + W_X] = y
    row_z[base + W_Y] = -x
