"""The original's contact (see `viscous`) of bodies with torque-limited joints."""

from __future__ import annotations

from w2b_sim.engines.batched.algebra import inlined
from w2b_sim.engines.batched.contacts import CONTACT_GAP_M, contact_rows
from w2b_sim.engines.batched.inertia import fill_base, fill_joints
from w2b_sim.engines.batched.memory import row
from w2b_sim.engines.batched.motors import soft_stop_targets, sweep
from w2b_sim.engines.batched.rows import contact_targets, keep_impulses, prepare
from w2b_sim.engines.batched.simd import where
from w2b_sim.engines.batched.tree import backward_all, rank_one, row_add


@inlined
def solve_viscous_tree(layout, tables, state, frame, composite, solve, near, count, erp_per_h,
                       h_per_slip, h, first_sweeps, second_sweeps):
    """Solve for the velocities of one step; they end in solve.y."""
    fill_base(layout, composite, solve)
    fill_joints(layout, tables, frame, composite, solve)
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
        row_add(layout, tables, link, row(solve.row_x, 0),
                -(weight * frame.contact_drive[c, 0]), solve.b)
        row_add(layout, tables, link, row(solve.row_y, 0),
                -(weight * frame.contact_drive[c, 1]), solve.b)
    prepare(layout, tables, frame, solve, near, count, state.press)
    sweep(layout, tables, solve, near, count, second_sweeps)
    keep_impulses(layout, solve, near, count, state.press)
    backward_all(layout, tables, solve.factor_joint, solve.factor_base, solve.y)
