"""
The rows of the contact solve in Cholesky space, and projected Gauss-Seidel over them.

With A = L L^T and y = L^T x, the unknowns x answer to an impulse along row J by
x += A^-1 J^T impulse, that is y += (L^-1 J^T) impulse: one forward substitution a row and step, and
each visit of a row in a sweep is two short scalar products,

    velocity = row . y;   change = bounded(impulse + (target - velocity) / |row|^2) - impulse;
    y += row * change

A normal may push (impulse >= 0) and keeps its velocity at or above `target`; a motor holds its rate
at `target` with an impulse within +-torque * h.
"""

from __future__ import annotations

from w2b_sim.engines.batched.algebra import inlined
from w2b_sim.engines.batched.contacts import contact_rows
from w2b_sim.engines.batched.memory import row, structure
from w2b_sim.engines.batched.simd import fma, splat, vmax, where
from w2b_sim.engines.batched.tree import (
    factorise,
    forward_all,
    forward_row,
    row_add,
    row_dot,
    row_length,
)

#: Rows: those of the contacts near the floor first, then the dynamic joints'. See `tree` for the
#: forms of matrices and vectors.
Solve = structure('Solve', {
    'joint': ('dynamic', 'width'),   # momentum balance A, see `inertia`
    'base': (21,),
    'factor_joint': ('dynamic', 'width'),  # its Cholesky factor
    'factor_base': (21,),
    'b': ('slots',),
    'y': ('slots',),
    'rows': ('rows', 'width'),       # in Cholesky space
    'inverse': ('rows',),            # 1 / |row|^2
    'target': ('rows',),
    'active': ('rows',),             # 1 where the contact exists in this lane, else 0
    'impulse': ('rows',),
    'lowest': ('dynamic',),          # bounds of the motors' impulses
    'highest': ('dynamic',),
    'stop_low': ('dynamic',),        # rates that hard stops leave, and their impulses
    'stop_high': ('dynamic',),
    'stop': ('dynamic',),
    'row_x': ('contacts', 'width'),  # the tangents'
    'row_y': ('contacts', 'width'),
    'inverse_x': ('contacts',),
    'inverse_y': ('contacts',),
})


@inlined
def contact_targets(layout, frame, solve, near, count, erp_per_h, reach, per_gap):
    """
    Set the targets of the normals.

    Below the floor: leave it by a share of the depth. Above it, within `reach`: approach no faster
    than the gap times `per_gap`.
    """
    for q in range(count):
        c = near[q]
        depth = frame.depth[c]
        leave = where(depth >= 0.0, depth * erp_per_h, depth * per_gap)
        solve.active[q] = where(depth >= -reach, 1.0, depth * 0.0)
        solve.target[q] = leave - frame.contact_drive[c, 2]


@inlined
def prepare(layout, tables, frame, solve, near, count, start):
    """
    Factorise the balance, build the rows of normals and motors, apply the impulses `start`.

    Targets, bounds and `active` of the rows are set already.
    """
    for d in range(layout.dynamic):
        for i in range(layout.width):
            solve.factor_joint[d, i] = solve.joint[d, i]
    for i in range(21):
        solve.factor_base[i] = solve.base[i]
    solve.b[layout.unknowns] = splat(layout, 0.0)
    for i in range(layout.slots):
        solve.y[i] = solve.b[i]
    factorise(layout, tables, solve.factor_joint, solve.factor_base)
    forward_all(layout, tables, solve.factor_joint, solve.factor_base, solve.y)
    for q in range(count):
        contact_rows(layout, tables, frame, near[q], row(solve.row_x, q), row(solve.row_y, q),
                     row(solve.rows, q))
        _load(layout, tables, solve, tables.contact_link[near[q]], q, start[near[q]])
    for d in range(layout.dynamic):
        for i in range(layout.width):
            solve.rows[count + d, i] = splat(layout, 0.0)
        solve.rows[count + d, 0] = splat(layout, 1.0)
        _load(layout, tables, solve, tables.dynamic_link[d], count + d,
              start[layout.contacts + d])


@inlined
def _load(layout, tables, solve, link, q, impulse):
    """Take row q of a link into Cholesky space and apply an impulse along it."""
    forward_row(layout, tables, solve.factor_joint, solve.factor_base, link, row(solve.rows, q))
    solve.inverse[q] = 1.0 / row_length(layout, tables, link, row(solve.rows, q))
    solve.impulse[q] = impulse * solve.active[q]
    row_add(layout, tables, link, row(solve.rows, q), solve.impulse[q], solve.y)


@inlined
def keep_impulses(layout, solve, near, count, start):
    """Keep the impulses for the next step's solve to start from."""
    for q in range(count):
        start[near[q]] = solve.impulse[q]
    for d in range(layout.dynamic):
        start[layout.contacts + d] = solve.impulse[count + d]


@inlined
def visit_normal(layout, tables, solve, near, q):
    """Visit the row of a normal."""
    link = tables.contact_link[near[q]]
    missing = -row_dot(layout, tables, link, row(solve.rows, q), solve.y, -solve.target[q])
    old = solve.impulse[q]
    new = vmax(fma(missing, solve.inverse[q], old), 0.0) * solve.active[q]
    solve.impulse[q] = new
    row_add(layout, tables, link, row(solve.rows, q), new - old, solve.y)
