"""The original's contact (see `viscous`) of bodies with torque-limited joints."""

from __future__ import annotations

from w2b_sim.engines.batched.algebra import inlined
from w2b_sim.engines.batched.contacts import CONTACT_GAP_M
from w2b_sim.engines.batched.inertia import fill_base, fill_joints
from w2b_sim.engines.batched.memory import row
from w2b_sim.engines.batched.motors import (
    change_modes,
    recall_modes,
    set_modes,
    soft_stops,
    subtract_normals,
)
from w2b_sim.engines.batched.rows import contact_jacobians, eliminate, load_normal, visit_normal
from w2b_sim.engines.batched.simd import any_lane, splat, where
from w2b_sim.engines.batched.tree import (
    backward_all,
    base_of,
    multiply,
    rank_one,
    set_base,
)

#: Solves of a stage, at most. A lane whose modes fit after one keeps that solution.
ROUNDS = 4


@inlined
def solve_viscous_tree(layout, tables, state, frame, composite, solve, near, count, erp_per_h,
                       h_per_slip, h, first_sweeps, second_sweeps):
    """Solve for the velocities of one step; they end in solve.y."""
    fill_base(layout, composite, solve)
    fill_joints(layout, tables, frame, composite, solve)
    soft_stops(layout, tables, state, frame, solve, erp_per_h, h)
    contact_jacobians(layout, tables, frame, solve, near, count, erp_per_h, CONTACT_GAP_M, 0.0)
    if count > 0:
        recall_modes(layout, state, solve)
        _stage(layout, tables, frame, solve, near, count, state.press_first, first_sweeps)
    zero = splat(layout, 0.0)
    for q in range(count):
        c = near[q]
        link = tables.contact_link[c]
        weight = where(state.press_first[c] > 0.0, h_per_slip, zero)
        for i in range(2):
            jacobian = row(solve.jacobian_x, q) if i == 0 else row(solve.jacobian_y, q)
            rank_one(layout, tables, solve.joint, solve.base, link, jacobian, weight)
            drag = -(weight * frame.contact_drive[c, i])
            for p in range(tables.chain_length[link]):
                d = tables.chain_of[link, p]
                solve.b[d] = solve.b[d] + jacobian[p] * drag
            for k in range(6):
                place = layout.dynamic + k
                solve.b[place] = solve.b[place] + jacobian[layout.chain + k] * drag
    recall_modes(layout, state, solve)
    _stage(layout, tables, frame, solve, near, count, state.press, second_sweeps)
    for d in range(layout.dynamic):
        state.mode[d] = solve.mode[d]


@inlined
def _stage(layout, tables, frame, solve, near, count, press, sweeps):
    """
    Solve one stage: velocities to solve.y, modes to solve.mode, normal impulses to `press` (C,).

    `press` has the impulses to start from.
    """
    undone = splat(layout, 1.0)
    for _round in range(ROUNDS):
        set_modes(layout, solve)
        eliminate(layout, tables, solve)
        for q in range(count):
            load_normal(layout, tables, frame, solve, near, q, press)
        base = base_of(layout, solve.z)
        for _ in range(sweeps):
            for q in range(count):
                base = visit_normal(layout, tables, solve, tables.contact_link[near[q]], q, base)
        set_base(layout, solve.z, base)
        backward_all(layout, tables, solve.factor_joint, solve.factor_base, solve.z)
        for i in range(layout.unknowns):
            solve.z[i] = solve.z[i] + solve.held[i]
            solve.y[i] = where(undone > 0.5, solve.z[i], solve.y[i])
        for q in range(count):
            press[near[q]] = where(undone > 0.5, solve.impulse[q], press[near[q]])
        multiply(layout, tables, solve.joint, solve.base, solve.z, solve.product)
        subtract_normals(layout, tables, solve, near, count)
        undone = change_modes(layout, solve, solve.z, undone)
        if not any_lane(undone > 0.5):
            break
