"""
Contacts of a leg in as few slots as its busiest lane needs.

Which of a body's spheres touch the floor differs from robot to robot: over sixteen lanes nearly
twenty of the physical twin's do somewhere, but only four or five in each lane. The solve visits
slots, and a slot holds the first, second, ... contact of one leg in each lane, whichever that is. A
leg is what ends in one outermost link: a link's dynamic joints are the inner ones of any outermost
link that it carries (`tables.leaf`), so that a row of the outermost link's form holds the row of
any contact of the leg, with zeros for the joints that do not move it. The order of visits in a lane
is that of its contacts, and an empty slot changes nothing: the neighbours change no bit.
"""

from __future__ import annotations

from w2b_sim.engines.batched.algebra import cross, get3, inlined, sub
from w2b_sim.engines.batched.contacts import V_X, V_Y, V_Z, W_X, W_Y, W_Z
from w2b_sim.engines.batched.simd import any_lane, both, splat, where
from w2b_sim.engines.batched.tree import BASE


@inlined
def take_slots(layout, tables, state, frame, solve, near, count, opened, used, erp_per_h, reach,
               per_gap):
    """
    Put the contacts that each lane has into slots; return how many slots `used` lists.

    `opened` (L,) is scratch. Below the floor a normal must leave it by a share of the depth; above
    it, within `reach`, approach no faster than the gap times `per_gap`.
    """
    zero = splat(layout, 0.0)
    for k in range(layout.links):
        opened[k] = 0
        solve.taken[k] = zero
    for q in range(count):
        c = near[q]
        leaf = tables.leaf[tables.contact_link[c]]
        depth = frame.depth[c]
        here = depth >= -reach
        leave = where(depth >= 0.0, depth * erp_per_h, depth * per_gap)
        leave = leave - frame.contact_drive[c, 2]
        place = solve.taken[leaf]
        for k in range(opened[leaf] + 1):
            mine = both(here, place == k)
            if not any_lane(mine):
                continue
            slot = tables.slot_first[leaf] + k
            if k == opened[leaf]:
                _open(solve, slot, zero)
                opened[leaf] = k + 1
            solve.contact[slot] = where(mine, c, solve.contact[slot])
            solve.active[slot] = where(mine, 1.0, solve.active[slot])
            solve.level[slot] = where(mine, tables.chain_length[tables.contact_link[c]],
                                      solve.level[slot])
            solve.leave[slot] = where(mine, leave, solve.leave[slot])
            solve.impulse[slot] = where(mine, state.press[c], solve.impulse[slot])
            solve.slide_x[slot] = where(mine, state.slide_x[c], solve.slide_x[slot])
            solve.slide_y[slot] = where(mine, state.slide_y[c], solve.slide_y[slot])
            for i in range(3):
                solve.arm[slot, i] = where(mine, frame.contact_arm[c, i], solve.arm[slot, i])
                solve.drive[slot, i] = where(mine, frame.contact_drive[c, i],
                                             solve.drive[slot, i])
        solve.taken[leaf] = place + where(here, 1.0, zero)
    slots = 0
    for leaf in range(layout.links):
        for k in range(opened[leaf]):
            used[slots] = tables.slot_first[leaf] + k
            slots += 1
    return slots


@inlined
def _open(solve, slot, zero):
    """Make a slot empty."""
    solve.contact[slot] = zero - 1.0
    solve.active[slot] = zero
    solve.level[slot] = zero
    solve.leave[slot] = zero
    solve.impulse[slot] = zero
    solve.slide_x[slot] = zero
    solve.slide_y[slot] = zero
    for i in range(3):
        solve.arm[slot, i] = zero
        solve.drive[slot, i] = zero


@inlined
def return_impulses(layout, tables, state, solve, near, count, opened):
    """Write the slots' impulses to the contacts, for the next step to start from."""
    zero = splat(layout, 0.0)
    for q in range(count):
        c = near[q]
        leaf = tables.leaf[tables.contact_link[c]]
        press, slide_x, slide_y = zero, zero, zero
        for k in range(opened[leaf]):
            slot = tables.slot_first[leaf] + k
            mine = solve.contact[slot] == c
            press = where(mine, solve.impulse[slot], press)
            slide_x = where(mine, solve.slide_x[slot], slide_x)
            slide_y = where(mine, solve.slide_y[slot], slide_y)
        state.press[c] = press
        state.slide_x[c] = slide_x
        state.slide_y[c] = slide_y


@inlined
def slot_rows(layout, tables, frame, solve, slot):
    """Write the rows that map the unknowns to the velocity of a slot's contact along x, y, z."""
    zero, one = splat(layout, 0.0), splat(layout, 1.0)
    leaf, base = tables.slot_leaf[slot], layout.chain
    length = tables.chain_length[leaf]
    x, y, z = get3(solve.arm, slot)
    for p in range(length):
        turned = tables.dynamic_link[tables.chain_of[leaf, p]]
        velocity = cross(get3(frame.axis, turned), sub((x, y, z), get3(frame.hinge, turned)))
        moves = solve.level[slot] > length - p - 0.5
        solve.row_x[slot, p] = where(moves, velocity[0], zero)
        solve.row_y[slot, p] = where(moves, velocity[1], zero)
        solve.row_z[slot, p] = where(moves, velocity[2], zero)
    for p in range(length, base + BASE):
        solve.row_x[slot, p] = zero
        solve.row_y[slot, p] = zero
        solve.row_z[slot, p] = zero
    solve.row_x[slot, base + V_X] = one
    solve.row_x[slot, base + W_Y] = z
    solve.row_x[slot, base + W_Z] = -y
    solve.row_y[slot, base + V_Y] = one
    solve.row_y[slot, base + W_X] = -z
    solve.row_y[slot, base + W_Z] = x
    solve.row_z[slot, base + V_Z] = one
    solve.row_z[slot, base + W_X] = y
    solve.row_z[slot, base + W_Y] = -x
