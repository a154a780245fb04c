"""
The rows of the contact solve in Cholesky space, and projected Gauss-Seidel over them.

With A = L L^T and y = L^T x, the unknowns x answer to an impulse along row J by
x += A^-1 J^T impulse, that is y += (L^-1 J^T) impulse: one forward substitution a row and step, and
each visit of a row in a sweep is two short scalar products,

    velocity = row . y;   change = bounded(impulse + (target - velocity) / |row|^2) - impulse;
    y += row * change

A normal may push (impulse >= 0) and keeps its velocity at or above `target`; a motor holds its rate
at `target` with an impulse within +-torque * h. Normals and motors have zeros in the first three
places (see `contacts`), which the sweeps skip.
"""

from __future__ import annotations

from w2b_sim.engines.batched.algebra import forward_solve, inlined
from w2b_sim.engines.batched.contacts import normal_row, touching
from w2b_sim.engines.batched.memory import row, structure
from w2b_sim.engines.batched.simd import both, fma, splat, vmax, vmin, where

#: Rows: those of the contacts near the floor first, then the dynamic joints'.
Solve = structure('Solve', {
    'a': ('triangle',),              # momentum balance, see `inertia`
    'factor': ('triangle',),         # its Cholesky factor
    'b': ('unknowns',),
    'y': ('unknowns',),
    'rows': ('rows', 'unknowns'),    # in Cholesky space
    'inverse': ('rows',),            # 1 / |row|^2
    'target': ('rows',),
    'active': ('rows',),             # 1 where the contact exists in this lane, else 0
    'impulse': ('rows',),
    'lowest': ('rows',),             # bounds of the impulse, motors only
    'highest': ('rows',),
    'row_x': ('contacts', 'unknowns'),  # the tangents'
    'row_y': ('contacts', 'unknowns'),
    'inverse_x': ('contacts',),
    'inverse_y': ('contacts',),
})

UNBOUNDED = 1e30


@inlined
def motor_bounds(layout, tables, state, frame, solve, count, first_row, erp_per_h, h):
    """
    Set targets and bounds of the motor rows, which follow the `count` rows of contacts.

    Between its stops a joint has its motor. At a stop the original's engine (ODE) replaces the
    motor by a constant torque of full strength towards the asked velocity, and the row by a
    one-sided one that gives way at most by the error correction.
    """
    for d in range(layout.dynamic):
        joint = tables.dynamic_joint[d]
        place = first_row + d
        limit = splat(layout, tables.torque[joint] * h)
        angle, rate = state.angle[joint], frame.rate[joint]
        low = angle <= tables.lower[joint]
        high = angle >= tables.upper[joint]
        zero = splat(layout, 0.0)
        target = where(low, (tables.lower[joint] - angle) * erp_per_h, rate)
        solve.target[place] = where(high, (tables.upper[joint] - angle) * erp_per_h, target)
        solve.lowest[place] = where(low, 0.0, where(high, -UNBOUNDED, -limit))
        solve.highest[place] = where(low, UNBOUNDED, where(high, zero, limit))
        solve.active[place] = splat(layout, 1.0)
        push = where(rate > 0.0, limit, -limit)
        push_high = where(rate >= 0.0, limit, -limit)
        push = where(low, push, where(high, push_high, zero))
        solve.b[3 + d] = solve.b[3 + d] + push


@inlined
def contact_targets(layout, state, frame, solve, near, count, erp_per_h):
    """Set the targets of the normals: to leave the floor by a share of the depth."""
    for q in range(count):
        c = near[q]
        solve.active[q] = touching(frame.depth[c])
        solve.target[q] = fma(vmax(frame.depth[c], 0.0), erp_per_h, -frame.contact_drive[c, 2])


@inlined
def load_rows(layout, tables, frame, solve, near, count, start):
    """Build the rows for the present factor and apply the impulses of `start` to y."""
    n = layout.unknowns
    for q in range(count + layout.dynamic):
        if q < count:
            place = near[q]
            normal_row(layout, tables, frame, place, row(solve.rows, q))
        else:
            place = layout.contacts + q - count
            for i in range(n):
                solve.rows[q, i] = splat(layout, 0.0)
            solve.rows[q, 3 + q - count] = splat(layout, 1.0)
        forward_solve(3, n, solve.factor, row(solve.rows, q))
        length = solve.rows[q, 3] * solve.rows[q, 3]
        for i in range(4, n):
            length = fma(solve.rows[q, i], solve.rows[q, i], length)
        solve.inverse[q] = 1.0 / length
        impulse = start[place] * solve.active[q]
        solve.impulse[q] = impulse
        for i in range(3, n):
            solve.y[i] = fma(solve.rows[q, i], impulse, solve.y[i])


@inlined
def keep_impulses(layout, solve, near, count, start):
    """Keep the impulses for the next step's solve to start from."""
    for q in range(count):
        start[near[q]] = solve.impulse[q]
    for d in range(layout.dynamic):
        start[layout.contacts + d] = solve.impulse[count + d]


@inlined
def sweep(layout, solve, count, sweeps):
    """Visit normals and motors in turn, `sweeps` times."""
    if layout.dynamic == 0:
        _sweep_normals(layout, solve, count, sweeps)
    else:
        _sweep_all(layout, solve, count, sweeps)


@inlined
def _sweep_normals(layout, solve, count, sweeps):
    """Sweep with the three unknowns that normals act on in registers."""
    y0, y1, y2 = solve.y[3], solve.y[4], solve.y[5]
    for _ in range(sweeps):
        for q in range(count):
            r0, r1, r2 = solve.rows[q, 3], solve.rows[q, 4], solve.rows[q, 5]
            velocity = fma(r2, y2, fma(r1, y1, r0 * y0))
            old = solve.impulse[q]
            new = vmax(fma(solve.target[q] - velocity, solve.inverse[q], old), 0.0)
            new = new * solve.active[q]
            change = new - old
            solve.impulse[q] = new
            y0, y1, y2 = fma(r0, change, y0), fma(r1, change, y1), fma(r2, change, y2)
    solve.y[3] = y0
    solve.y[4] = y1
    solve.y[5] = y2


@inlined
def _sweep_all(layout, solve, count, sweeps):
    n = layout.unknowns
    for _ in range(sweeps):
        for q in range(count + layout.dynamic):
            visit(layout, solve, count, q, n)


@inlined
def visit(layout, solve, count, q, n):
    """Visit one row, of a normal or of a motor."""
    velocity = solve.rows[q, 3] * solve.y[3]
    for i in range(4, n):
        velocity = fma(solve.rows[q, i], solve.y[i], velocity)
    old = solve.impulse[q]
    new = fma(solve.target[q] - velocity, solve.inverse[q], old)
    if q < count:
        new = vmax(new, 0.0) * solve.active[q]
    else:
        new = vmin(vmax(new, solve.lowest[q]), solve.highest[q])
    change = new - old
    solve.impulse[q] = new
    for i in range(3, n):
        solve.y[i] = fma(solve.rows[q, i], change, solve.y[i])
