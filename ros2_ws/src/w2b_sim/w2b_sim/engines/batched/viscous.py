"""
The original's contact: unbounded friction with force-dependent slip, solved in its two stages.

Force-dependent slip makes friction viscous: tangential velocity = -slip * force, or
impulse = -(h / slip) * velocity. Such an impulse is linear in the unknowns, so it needs no
iteration: it goes to the left side, A += (h / slip) J_t^T J_t. But the original's solver (ODE's
dWorldStep) gives it only to contacts that press when there is no friction yet, because it fixes the
friction bounds from the normal impulses it has found by then. Hence two stages: normals (and
motors) without friction; then those that press get their slip, and normals and motors are solved
again.
"""

from __future__ import annotations

from w2b_sim.engines.batched.algebra import backward_solve, cholesky, forward_solve, inlined, tri
from w2b_sim.engines.batched.contacts import tangent_rows
from w2b_sim.engines.batched.memory import row
from w2b_sim.engines.batched.rows import contact_targets, keep_impulses, load_rows, motor_bounds, \
    sweep
from w2b_sim.engines.batched.simd import fma, where


@inlined
def solve_viscous(layout, tables, state, frame, solve, near, count, erp_per_h, h_per_slip, h,
                  first_sweeps, second_sweeps):
    """Solve for the velocities of one step; they end in solve.y."""
    n = layout.unknowns
    motor_bounds(layout, tables, state, frame, solve, count, count, erp_per_h, h)
    contact_targets(layout, state, frame, solve, near, count, erp_per_h)
    if count > 0:
        _factorise(layout, solve)
        load_rows(layout, tables, frame, solve, near, count, state.press_first)
        sweep(layout, solve, count, first_sweeps)
        keep_impulses(layout, solve, near, count, state.press_first)
    for q in range(count):
        c = near[q]
        weight = where(solve.impulse[q] > 0.0, h_per_slip, h_per_slip * 0.0)
        tangent_rows(layout, tables, frame, c, row(solve.row_x, 0), row(solve.row_y, 0))
        _add_slip(layout, solve, row(solve.row_x, 0), weight, weight * frame.contact_drive[c, 0])
        _add_slip(layout, solve, row(solve.row_y, 0), weight, weight * frame.contact_drive[c, 1])
    _factorise(layout, solve)
    load_rows(layout, tables, frame, solve, near, count, state.press)
    sweep(layout, solve, count, second_sweeps)
    keep_impulses(layout, solve, near, count, state.press)
    backward_solve(n, solve.factor, solve.y)


@inlined
def _factorise(layout, solve):
    """Factorise the balance and take its right side through L^-1."""
    n = layout.unknowns
    for i in range(layout.triangle):
        solve.factor[i] = solve.a[i]
    for i in range(n):
        solve.y[i] = solve.b[i]
    cholesky(n, solve.factor)
    forward_solve(0, n, solve.factor, solve.y)


@inlined
def _add_slip(layout, solve, tangent, weight, drag):
    """Add weight * tangent tangent^T to A and take drag * tangent from b."""
    n = layout.unknowns
    for i in range(n):
        weighted = weight * tangent[i]
        for j in range(i + 1):
            solve.a[tri(i, j)] = fma(weighted, tangent[j], solve.a[tri(i, j)])
        solve.b[i] = fma(-drag, tangent[i], solve.b[i])
