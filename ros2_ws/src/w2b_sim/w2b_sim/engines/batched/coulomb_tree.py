"""
Dry friction (see `coulomb`) of bodies with torque-limited joints.

One projected Gauss-Seidel over motors, stops, normals and tangents, in Cholesky space: with
A = L L^T and z = L^T x, an impulse along row J changes z by (L^-1 J^T) impulse. Eliminating the
motors that do not saturate, as `viscous_tree` does, leaves light legs under strong friction, whose
normals and tangents then chase one another without end.

A motor holds its rate at what the servo asks for with an impulse within +-torque * h. The stops are
Bullet's, the reference of worlds with dry friction: hard, beside the motor, and acting just before
they are reached.
"""

from __future__ import annotations

from w2b_sim.engines.batched.algebra import inlined
from w2b_sim.engines.batched.borrowed import integers
from w2b_sim.engines.batched.inertia import fill_base, fill_joints
from w2b_sim.engines.batched.memory import row
from w2b_sim.engines.batched.rows import rows_product
from w2b_sim.engines.batched.simd import any_lane, fma, splat, vmax, vmin, vsqrt, where
from w2b_sim.engines.batched.slots import return_impulses, slot_rows, take_slots
from w2b_sim.engines.batched.tree import (
    backward_all,
    base_of,
    factorise,
    forward_all,
    forward_row,
    row_add,
    row_dot,
    set_base,
)


@inlined
def solve_coulomb_tree(layout, tables, state, frame, composite, solve, near, count, erp_per_h,
                       slip_per_h, friction, h, sweeps, reach, per_gap):
    """Solve for the velocities of one step; they end in solve.y."""
    opened, used = integers(layout, layout.links), integers(layout, layout.contacts)
    fill_base(layout, composite, solve)
    fill_joints(layout, tables, frame, composite, solve)
    slots = take_slots(layout, tables, state, frame, solve, near, count, opened, used, erp_per_h,
                       reach, per_gap)
    for i in range(layout.unknowns):
        solve.y[i] = solve.b[i]
    solve.y[layout.unknowns] = splat(layout, 0.0)
    factorise(layout, tables, solve.joint, solve.base)
    forward_all(layout, tables, solve.joint, solve.base, solve.y)
    base = base_of(layout, solve.y)
    for d in range(layout.dynamic):
        base = _load_motor(layout, tables, state, frame, solve, d, erp_per_h * h, h, base)
    for i in range(slots):
        base = _load_contact(layout, tables, frame, solve, used[i], slip_per_h, base)
    for _ in range(sweeps):
        for d in range(layout.dynamic):
            base = _visit_motor(layout, tables, solve, d, base)
        for i in range(slots):
            base = _visit_contact(layout, tables, solve, used[i], slip_per_h, friction, base)
    # The last word is the joints': no stop is passed for the sake of a contact.
    for d in range(layout.dynamic):
        base = _visit_motor(layout, tables, solve, d, base)
    set_base(layout, solve.y, base)
    for d in range(layout.dynamic):
        state.motor[d] = solve.motor_impulse[d]
    return_impulses(layout, tables, state, solve, near, count, opened)
    backward_all(layout, tables, solve.joint, solve.base, solve.y)


@inlined
def _load_motor(layout, tables, state, frame, solve, d, erp, h, base):
    """
    Set a joint's row, the impulses that bring the rates wanted; apply the last step's impulse.

    A stop allows no more than the rate that reaches it in this step, and takes back a share `erp`
    of what the joint is beyond it. Returns the base's part of solve.y.
    """
    link = tables.dynamic_link[d]
    j = link - 1
    for i in range(layout.width):
        solve.motor[d, i] = splat(layout, 0.0)
    solve.motor[d, 0] = splat(layout, 1.0)
    forward_row(layout, tables, solve.joint, solve.base, link, row(solve.motor, d))
    inverse = 1.0 / rows_product(layout, solve.motor, solve.motor, d)
    low = (tables.lower[j] - state.angle[j]) / h
    high = (tables.upper[j] - state.angle[j]) / h
    solve.inverse[d] = inverse
    solve.limit[d] = state.strength[0] * (tables.torque[j] * h)
    solve.target[d] = frame.rate[j] * inverse
    solve.lowest[d] = where(low > 0.0, low * erp, low) * inverse
    solve.highest[d] = where(high < 0.0, high * erp, high) * inverse
    solve.motor_impulse[d] = state.motor[d]
    return row_add(layout, tables, link, solve.motor, d, state.motor[d], solve.y, base)


@inlined
def _load_contact(layout, tables, frame, solve, s, slip_per_h, base):
    """Take a slot's rows into Cholesky space and apply its impulses; return the base's part."""
    leaf = tables.slot_leaf[s]
    slot_rows(layout, tables, frame, solve, s)
    forward_row(layout, tables, solve.joint, solve.base, leaf, row(solve.row_x, s))
    forward_row(layout, tables, solve.joint, solve.base, leaf, row(solve.row_y, s))
    forward_row(layout, tables, solve.joint, solve.base, leaf, row(solve.row_z, s))
    # An empty slot answers to nothing, so its impulses stay zero.
    active = solve.active[s]
    solve.inverse_x[s] = active / (slip_per_h + rows_product(layout, solve.row_x, solve.row_x, s))
    solve.inverse_y[s] = active / (slip_per_h + rows_product(layout, solve.row_y, solve.row_y, s))
    solve.inverse_z[s] = active / rows_product(layout, solve.row_z, solve.row_z, s)
    solve.cross_x[s] = rows_product(layout, solve.row_x, solve.row_z, s)
    solve.cross_y[s] = rows_product(layout, solve.row_y, solve.row_z, s)
    base = row_add(layout, tables, leaf, solve.row_z, s, solve.impulse[s], solve.y, base)
    base = row_add(layout, tables, leaf, solve.row_x, s, solve.slide_x[s], solve.y, base)
    return row_add(layout, tables, leaf, solve.row_y, s, solve.slide_y[s], solve.y, base)


@inlined
def _visit_motor(layout, tables, solve, d, base):
    """
    Visit the row of a joint, along which both motor and stop act.

    The motor's impulse is what brings the rate to its target, within the torque; the stop's what
    then is missing to its bounds. Their sum is the former, bounded by the latter.
    """
    link, inverse, old = tables.dynamic_link[d], solve.inverse[d], solve.motor_impulse[d]
    limit = solve.limit[d]
    rate = row_dot(layout, tables, link, solve.motor, d, solve.y, base)
    without = fma(-rate, inverse, old)
    new = vmin(vmax(solve.target[d] + without, -limit), limit)
    new = vmin(vmax(new, solve.lowest[d] + without), solve.highest[d] + without)
    solve.motor_impulse[d] = new
    return row_add(layout, tables, link, solve.motor, d, new - old, solve.y, base)


@inlined
def _visit_contact(layout, tables, solve, s, slip_per_h, friction, base):
    """
    Visit a contact: the normal, then both tangents, whose impulse ends inside the friction cone.

    The three velocities are worked out side by side, and what the normal's change does to the
    tangents' is added: the latency of one product, not of three. Returns the base's part of z.
    """
    leaf = tables.slot_leaf[s]
    velocity = row_dot(layout, tables, leaf, solve.row_z, s, solve.y, base)
    velocity_x = row_dot(layout, tables, leaf, solve.row_x, s, solve.y, base)
    velocity_y = row_dot(layout, tables, leaf, solve.row_y, s, solve.y, base)
    old, old_x, old_y = solve.impulse[s], solve.slide_x[s], solve.slide_y[s]
    new = vmax(fma(solve.leave[s] - velocity, solve.inverse_z[s], old), 0.0)
    change = new - old
    velocity_x = fma(solve.cross_x[s], change,
                     velocity_x + fma(slip_per_h, old_x, solve.drive[s, 0]))
    velocity_y = fma(solve.cross_y[s], change,
                     velocity_y + fma(slip_per_h, old_y, solve.drive[s, 1]))
    new_x = fma(-velocity_x, solve.inverse_x[s], old_x)
    new_y = fma(-velocity_y, solve.inverse_y[s], old_y)
    size = fma(new_x, new_x, new_y * new_y)
    bound = friction * new
    slides = size > bound * bound
    if any_lane(slides):
        share = where(slides, bound / vsqrt(size), 1.0)
        new_x, new_y = new_x * share, new_y * share
    solve.impulse[s] = new
    solve.slide_x[s] = new_x
    solve.slide_y[s] = new_y
    change_x, change_y = new_x - old_x, new_y - old_y
    for p in range(layout.chain):
        place = tables.chain_of[leaf, p]
        solve.y[place] = fma(solve.row_y[s, p], change_y, fma(
            solve.row_x[s, p], change_x, fma(solve.row_z[s, p], change, solve.y[place])))
    return _moved(solve, s, layout.chain, change, change_x, change_y, base)


@inlined
def _moved(solve, s, c, change, change_x, change_y, base):
    """Return the base's part of solve.y after changes of a contact's impulses."""
    base = _moved_along(solve.row_z, s, c, change, base)
    base = _moved_along(solve.row_x, s, c, change_x, base)
    return _moved_along(solve.row_y, s, c, change_y, base)


@inlined
def _moved_along(rows, s, c, change, base):
    return (fma(rows[s, c], change, base[0]), fma(rows[s, c + 1], change, base[1]),
            fma(rows[s, c + 2], change, base[2]), fma(rows[s, c + 3], change, base[3]),
            fma(rows[s, c + 4], change, base[4]), fma(rows[s, c + 5], change, base[5]))
