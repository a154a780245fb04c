"""Dry friction (see `coulomb`) of bodies with torque-limited joints, motors in the same sweeps."""

from __future__ import annotations

from w2b_sim.engines.batched.algebra import inlined
from w2b_sim.engines.batched.coulomb import TINY
from w2b_sim.engines.batched.inertia import fill_base, fill_joints
from w2b_sim.engines.batched.memory import row
from w2b_sim.engines.batched.motors import hard_stop_targets, start_stops, visit_motor_and_stop
from w2b_sim.engines.batched.rows import contact_targets, keep_impulses, prepare, visit_normal
from w2b_sim.engines.batched.simd import any_lane, fma, vsqrt, where
from w2b_sim.engines.batched.tree import backward_all, forward_row, row_add, row_dot, row_length


@inlined
def solve_coulomb_tree(layout, tables, state, frame, composite, solve, near, count, erp_per_h,
                       slip_per_h, friction, h, sweeps, reach, per_gap):
    """Solve for the velocities of one step; they end in solve.y."""
    fill_base(layout, composite, solve)
    fill_joints(layout, tables, frame, composite, solve)
    hard_stop_targets(layout, tables, state, frame, solve, count, erp_per_h * h, h)
    contact_targets(layout, frame, solve, near, count, erp_per_h, reach, per_gap)
    prepare(layout, tables, frame, solve, near, count, state.press)
    start_stops(layout, tables, state, solve, count)
    for q in range(count):
        c = near[q]
        state.slide_x[c] = state.slide_x[c] * solve.active[q]
        state.slide_y[c] = state.slide_y[c] * solve.active[q]
        _load(layout, tables, solve, tables.contact_link[c], row(solve.row_x, q),
              solve.inverse_x, q, slip_per_h, state.slide_x[c])
        _load(layout, tables, solve, tables.contact_link[c], row(solve.row_y, q),
              solve.inverse_y, q, slip_per_h, state.slide_y[c])
    for _ in range(sweeps):
        for d in range(layout.dynamic):
            visit_motor_and_stop(layout, tables, state, solve, count, d)
        for q in range(count):
            visit_normal(layout, tables, solve, near, q)
            _visit_tangents(layout, tables, solve, state, frame, near[q], q, slip_per_h, friction)
    keep_impulses(layout, solve, near, count, state.press)
    backward_all(layout, tables, solve.factor_joint, solve.factor_base, solve.y)


@inlined
def _load(layout, tables, solve, link, tangent, inverse, q, slip_per_h, impulse):
    """Take a tangent's row into Cholesky space and apply an impulse along it."""
    forward_row(layout, tables, solve.factor_joint, solve.factor_base, link, tangent)
    inverse[q] = 1.0 / (slip_per_h + row_length(layout, tables, link, tangent))
    row_add(layout, tables, link, tangent, impulse, solve.y)


@inlined
def _visit_tangents(layout, tables, solve, state, frame, c, q, slip_per_h, friction):
    """Visit both tangents of a contact; its friction ends inside the cone."""
    link = tables.contact_link[c]
    row_x, row_y = row(solve.row_x, q), row(solve.row_y, q)
    old_x, old_y = state.slide_x[c], state.slide_y[c]
    velocity_x = row_dot(layout, tables, link, row_x, solve.y,
                         fma(slip_per_h, old_x, frame.contact_drive[c, 0]))
    velocity_y = row_dot(layout, tables, link, row_y, solve.y,
                         fma(slip_per_h, old_y, frame.contact_drive[c, 1]))
    new_x = fma(-velocity_x, solve.inverse_x[q], old_x)
    new_y = fma(-velocity_y, solve.inverse_y[q], old_y)
    size = fma(new_x, new_x, fma(new_y, new_y, TINY))
    bound = friction * solve.impulse[q]
    slides = size > bound * bound
    if any_lane(slides):
        share = where(slides, bound / vsqrt(size), 1.0)
        new_x, new_y = new_x * share, new_y * share
    new_x, new_y = new_x * solve.active[q], new_y * solve.active[q]
    state.slide_x[c] = new_x
    state.slide_y[c] = new_y
    row_add(layout, tables, link, row_x, new_x - old_x, solve.y)
    row_add(layout, tables, link, row_y, new_y - old_y, solve.y)
