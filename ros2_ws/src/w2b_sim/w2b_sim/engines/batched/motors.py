"""
Rows of the joints whose servo may saturate: motors of limited torque, and the joints' stops.

A motor holds its rate at what the servo asks for with an impulse within +-torque * h. For the stops
there are two laws. In the original's engine (ODE), a joint that has reached a stop loses its motor:
the row becomes the stop, one-sided and soft, and the motor a constant torque. Bullet, the reference
of worlds with dry friction, keeps the motor and adds a hard stop, which acts before it is reached.
"""

from __future__ import annotations

from w2b_sim.engines.batched.algebra import inlined
from w2b_sim.engines.batched.memory import row
from w2b_sim.engines.batched.rows import visit_normal
from w2b_sim.engines.batched.simd import fma, splat, vmax, vmin, where
from w2b_sim.engines.batched.tree import row_add, row_dot

UNBOUNDED = 1e30


@inlined
def soft_stop_targets(layout, tables, state, frame, solve, count, erp_per_h, h):
    """
    Set targets and bounds of the motor rows, which follow the `count` rows of contacts: ODE's law.

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
        solve.target[count + d] = where(high, (tables.upper[j] - angle) * erp_per_h, target)
        solve.lowest[d] = where(low, 0.0, where(high, -UNBOUNDED, -limit))
        solve.highest[d] = where(low, UNBOUNDED, where(high, zero, limit))
        solve.active[count + d] = splat(layout, 1.0)
        push_low = where(rate > 0.0, limit, -limit)
        push_high = where(rate >= 0.0, limit, -limit)
        solve.b[d] = solve.b[d] + where(low, push_low, where(high, push_high, zero))


@inlined
def hard_stop_targets(layout, tables, state, frame, solve, count, erp, h):
    """
    Set targets and bounds of the motor rows: Bullet's law.

    A stop allows no more than the rate that reaches it in this step, and takes back a share `erp`
    of what the joint is beyond it.
    """
    for d in range(layout.dynamic):
        j = tables.dynamic_link[d] - 1
        solve.target[count + d] = frame.rate[j]
        solve.lowest[d] = splat(layout, -(tables.torque[j] * h))
        solve.highest[d] = splat(layout, tables.torque[j] * h)
        solve.active[count + d] = splat(layout, 1.0)
        low = (tables.lower[j] - state.angle[j]) / h
        high = (tables.upper[j] - state.angle[j]) / h
        solve.stop_low[d] = where(low > 0.0, low * erp, low)
        solve.stop_high[d] = where(high < 0.0, high * erp, high)


@inlined
def start_stops(layout, tables, state, solve, count):
    """Apply the stops' impulses of the last step."""
    for d in range(layout.dynamic):
        solve.stop[d] = state.stop[d]
        row_add(layout, tables, tables.dynamic_link[d], row(solve.rows, count + d),
                state.stop[d], solve.y)


@inlined
def visit_motor(layout, tables, solve, count, d):
    """Visit the row of a motor."""
    q, link = count + d, tables.dynamic_link[d]
    missing = -row_dot(layout, tables, link, row(solve.rows, q), solve.y, -solve.target[q])
    old = solve.impulse[q]
    new = vmin(vmax(fma(missing, solve.inverse[q], old), solve.lowest[d]), solve.highest[d])
    solve.impulse[q] = new
    row_add(layout, tables, link, row(solve.rows, q), new - old, solve.y)


@inlined
def visit_motor_and_stop(layout, tables, state, solve, count, d):
    """Visit the row of a motor, then the stop, which acts along the same row."""
    q, link = count + d, tables.dynamic_link[d]
    inverse = solve.inverse[q]
    rate = row_dot(layout, tables, link, row(solve.rows, q), solve.y, splat(layout, 0.0))
    old, old_stop = solve.impulse[q], solve.stop[d]
    new = fma(solve.target[q] - rate, inverse, old)
    new = vmin(vmax(new, solve.lowest[d]), solve.highest[d])
    # Impulse that brings the rate, as it is without the stop, to the stop's bounds.
    free = fma(rate, inverse, (new - old) - old_stop)
    stop = (vmax(fma(solve.stop_low[d], inverse, -free), 0.0)
            + vmin(fma(solve.stop_high[d], inverse, -free), 0.0))
    solve.impulse[q] = new
    solve.stop[d] = stop
    state.stop[d] = stop
    row_add(layout, tables, link, row(solve.rows, q), (new - old) + (stop - old_stop),
            solve.y)


@inlined
def sweep(layout, tables, solve, near, count, sweeps):
    """Visit motors and normals in turn, `sweeps` times."""
    for _ in range(sweeps):
        for d in range(layout.dynamic):
            visit_motor(layout, tables, solve, count, d)
        for q in range(count):
            visit_normal(layout, tables, solve, near, q)
