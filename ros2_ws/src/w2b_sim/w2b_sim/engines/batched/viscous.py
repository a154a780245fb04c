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

from w2b_sim.engines.batched.algebra import inlined
from w2b_sim.engines.batched.contacts import CONTACT_GAP_M, contact_rows
from w2b_sim.engines.batched.memory import row
from w2b_sim.engines.batched.motors import soft_stop_targets, sweep
from w2b_sim.engines.batched.rows import contact_targets, keep_impulses, prepare
from w2b_sim.engines.batched.simd import where
from w2b_sim.engines.batched.tree import backward_all, rank_one, row_add


@inlined
def solve_viscous(layout, tables, state, frame, solve, near, count, erp_per_h, h_per_slip, h,
                  first_sweeps, second_sweeps):
    """Solve for the velocities of one step; they end in solve.y."""
    soft_stop_targets(layout, tables, state, frame, solve, count, erp_per_h, h)
    contact_targets(layout, frame, solve, near, count, erp_per_h, CONTACT_GAP_M, 0.0)
    if count > 0:
        prepare(layout, tables, frame, solve, near, count, state.press_first)
        sweep(layout, tables, solve, near, count, first_sweeps)
        keep_impulses(layout, solve, near, count, state.press_first)
    for q in range(count):
        c = near[q]
        link = tables.contact_link[c]
        weight = where(solve.impulse[q] > 0.0, h_per_slip, h_per_slip * 0.0)
        contact_rows(layout, tables, frame, c, row(solve.row_x, 0), row(solve.row_y, 0),
                     row(solve.rows, q))
        rank_one(layout, tables, solve.joint, solve.base, link, row(solve.row_x, 0), weight)
        rank_one(layout, tables, solve.joint, solve.base, link, row(solve.row_y, 0), weight)
        row_add(layout, tables, link, 0, row(solve.row_x, 0),
                -(weight * frame.contact_drive[c, 0]), solve.b)
        row_add(layout, tables, link, 0, row(solve.row_y, 0),
                -(weight * frame.contact_drive[c, 1]), solve.b)
    prepare(layout, tables, frame, solve, near, count, state.press)
    sweep(layout, tables, solve, near, count, second_sweeps)
    keep_impulses(layout, solve, near, count, state.press)
    backward_all(layout, tables, solve.factor_joint, solve.factor_base, solve.y)
