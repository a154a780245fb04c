"""
Joints whose servo may saturate, in the original's world: motors of limited torque and soft stops.

A motor holds its rate at what the servo asks for with an impulse within +-torque * h. In the
original's engine (ODE), a joint that has reached a stop loses its motor: a one-sided and soft stop
holds it instead, and the motor is a constant torque. Either way a joint is in one of three modes,
of which the solve finds those that fit together by the active-set method: solve for given modes,
change those that the solution contradicts, solve again. The modes of the last step are where it
begins, and fit most of the time.

====  ================================  ============================================
mode  the joint                         is left if
====  ================================  ============================================
0     is held at `target`               that takes more than `highest`, or less than `lowest`
1     gives way, pushed by `highest`    its rate is above `target`
-1    gives way, pushed by `lowest`     its rate is below `target`
====  ================================  ============================================
"""

from __future__ import annotations

from w2b_sim.engines.batched.algebra import inlined
from w2b_sim.engines.batched.simd import both, fma, splat, vabs, where

UNBOUNDED = 1e30


@inlined
def soft_stops(layout, tables, state, frame, solve, erp_per_h, h):
    """
    Set targets and bounds of the motors by ODE's law.

    At a stop the motor is replaced by a constant torque of full strength towards the asked
    velocity, and the row by a one-sided one that gives way by the error correction.
    """
    zero = splat(layout, 0.0)
    for d in range(layout.dynamic):
        j = tables.dynamic_link[d] - 1
        limit = splat(layout, tables.torque[j] * h)
        angle, rate = state.angle[j], frame.rate[j]
        low = angle <= tables.lower[j]
        high = angle >= tables.upper[j]
        target = where(low, (tables.lower[j] - angle) * erp_per_h, rate)
        solve.target[d] = where(high, (tables.upper[j] - angle) * erp_per_h, target)
        solve.lowest[d] = where(low, 0.0, where(high, -UNBOUNDED, -limit))
        solve.highest[d] = where(low, UNBOUNDED, where(high, zero, limit))
        push_low = where(rate > 0.0, limit, -limit)
        push_high = where(rate >= 0.0, limit, -limit)
        solve.b[d] = solve.b[d] + where(low, push_low, where(high, push_high, zero))


@inlined
def recall_modes(layout, state, solve):
    """Begin with the last step's modes, but for a push that has no bound now."""
    for d in range(layout.dynamic):
        mode = state.mode[d]
        mode = where(both(mode > 0.5, solve.highest[d] > 0.5 * UNBOUNDED), 0.0, mode)
        solve.mode[d] = where(both(mode < -0.5, solve.lowest[d] < -0.5 * UNBOUNDED), 0.0, mode)


@inlined
def set_modes(layout, solve):
    """Set what the modes say: which joints give way, the held rates, the pushes (in solve.z)."""
    zero = splat(layout, 0.0)
    for d in range(layout.dynamic):
        mode = solve.mode[d]
        gives_way = vabs(mode) > 0.5
        solve.free[d] = where(gives_way, 1.0, zero)
        solve.held[d] = where(gives_way, zero, solve.target[d])
        solve.z[d] = where(gives_way, where(mode > 0.0, solve.highest[d], solve.lowest[d]), zero)
    for i in range(layout.dynamic, layout.slots):
        solve.held[i] = zero


@inlined
def subtract_normals(layout, tables, solve, near, count):
    """Take what the normal impulses do to the joints from solve.product."""
    for q in range(count):
        link = tables.contact_link[near[q]]
        for p in range(tables.chain_length[link]):
            d = tables.chain_of[link, p]
            solve.product[d] = fma(-solve.jacobian_z[q, p], solve.impulse[q], solve.product[d])


@inlined
def change_modes(layout, solve, velocity, undone):
    """
    Change the modes that the solution contradicts, in the lanes where `undone` is 1.

    `velocity` is the solution, `solve.product` the impulse that each joint needs for it, less
    solve.b. Returns 1 in the lanes where a mode was changed.
    """
    zero = undone * 0.0
    one = zero + 1.0
    changed = zero
    for d in range(layout.dynamic):
        mode, rate, target = solve.mode[d], velocity[d], solve.target[d]
        needed = solve.product[d] - solve.b[d]
        held = where(needed > solve.highest[d], one, where(needed < solve.lowest[d], -one, zero))
        pushed = where(rate > target, zero, one)
        pulled = where(rate < target, zero, -one)
        new = where(mode > 0.5, pushed, where(mode < -0.5, pulled, held))
        new = where(undone > 0.5, new, mode)
        changed = where(vabs(new - mode) > 0.5, one, changed)
        solve.mode[d] = new
    return changed
