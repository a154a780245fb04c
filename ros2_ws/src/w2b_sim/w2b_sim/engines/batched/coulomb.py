"""
Contact with dry friction: Gauss-Seidel over normals, motors and tangents together.

Each contact's friction impulse (f_x, f_y) opposes sliding, softened by force-dependent slip
(velocity + (slip / h) impulse = 0) and bounded by Coulomb's cone, |f| <= mu * normal impulse. An
infinite mu gives the original's unbounded viscous friction, solved in one stage.
"""

from __future__ import annotations

from w2b_sim.engines.batched.algebra import backward_solve, cholesky, forward_solve, inlined
from w2b_sim.engines.batched.contacts import tangent_rows
from w2b_sim.engines.batched.memory import row
from w2b_sim.engines.batched.rows import contact_targets, keep_impulses, load_rows, motor_bounds, \
    visit
from w2b_sim.engines.batched.simd import fma, vmin, vsqrt

#: Keeps the direction of a friction impulse of zero defined, (N s)^2.
TINY = 1e-24


@inlined
def solve_coulomb(layout, tables, state, frame, solve, near, count, erp_per_h, slip_per_h,
                  friction, h, sweeps):
    """Solve for the velocities of one step; they end in solve.y."""
    n = layout.unknowns
    motor_bounds(layout, tables, state, frame, solve, count, count, erp_per_h, h)
    contact_targets(layout, state, frame, solve, near, count, erp_per_h)
    for i in range(layout.triangle):
        solve.factor[i] = solve.a[i]
    for i in range(n):
        solve.y[i] = solve.b[i]
    cholesky(n, solve.factor)
    forward_solve(0, n, solve.factor, solve.y)
    load_rows(layout, tables, frame, solve, near, count, state.press)
    for q in range(count):
        c = near[q]
        tangent_rows(layout, tables, frame, c, row(solve.row_x, q), row(solve.row_y, q))
        state.slide_x[c] = state.slide_x[c] * solve.active[q]
        state.slide_y[c] = state.slide_y[c] * solve.active[q]
        _load_tangent(layout, solve, row(solve.row_x, q), solve.inverse_x, q, slip_per_h,
                      state.slide_x[c])
        _load_tangent(layout, solve, row(solve.row_y, q), solve.inverse_y, q, slip_per_h,
                      state.slide_y[c])
    for _ in range(sweeps):
        for d in range(layout.dynamic):
            visit(layout, solve, count, count + d, n)
        for q in range(count):
            visit(layout, solve, count, q, n)
            _visit_tangents(layout, solve, state, frame, near[q], q, slip_per_h, friction)
    keep_impulses(layout, solve, near, count, state.press)
    backward_solve(n, solve.factor, solve.y)


@inlined
def _load_tangent(layout, solve, tangent, inverse, q, slip_per_h, impulse):
    n = layout.unknowns
    forward_solve(0, n, solve.factor, tangent)
    length = slip_per_h
    for i in range(n):
        length = fma(tangent[i], tangent[i], length)
        solve.y[i] = fma(tangent[i], impulse, solve.y[i])
    inverse[q] = 1.0 / length


@inlined
def _visit_tangents(layout, solve, state, frame, c, q, slip_per_h, friction):
    n = layout.unknowns
    old_x, old_y = state.slide_x[c], state.slide_y[c]
    velocity_x = fma(slip_per_h, old_x, frame.contact_drive[c, 0])
    velocity_y = fma(slip_per_h, old_y, frame.contact_drive[c, 1])
    for i in range(n):
        velocity_x = fma(solve.row_x[q, i], solve.y[i], velocity_x)
        velocity_y = fma(solve.row_y[q, i], solve.y[i], velocity_y)
    new_x = fma(-velocity_x, solve.inverse_x[q], old_x)
    new_y = fma(-velocity_y, solve.inverse_y[q], old_y)
    size = vsqrt(fma(new_x, new_x, fma(new_y, new_y, TINY)))
    share = vmin(friction * solve.impulse[q] / size, 1.0)
    new_x, new_y = new_x * share * solve.active[q], new_y * share * solve.active[q]
    change_x, change_y = new_x - old_x, new_y - old_y
    state.slide_x[c] = new_x
    state.slide_y[c] = new_y
    for i in range(n):
        solve.y[i] = fma(solve.row_x[q, i], change_x,
                         fma(solve.row_y[q, i], change_y, solve.y[i]))
