"""
Storage of the solves with torque-limited joints, and the rows of the viscous one.

A motor of limited torque either holds its joint at the rate it asks for or pushes with all it has
(see `motors` for its modes). For given modes, held rates are known, x_held, and pushes are
impulses, so that only the rates of the joints that give way and the base's velocity are unknown:

    A_ff x_f = b_f + push_f - (A x_held)_f + (J^T impulses)_f

In place of a smaller matrix, the rows and columns of held joints are those of the unit matrix, lane
by lane. With A_ff = L L^T and z = L^T x, an impulse along row J changes z by (L^-1 J^T) impulse:
one forward substitution a row, and each visit of a row in a Gauss-Seidel sweep is two short scalar
products,

    velocity = row . z + J x_held + drive;   z += row * change of the impulse
"""

from __future__ import annotations

from w2b_sim.engines.batched.algebra import inlined
from w2b_sim.engines.batched.contacts import contact_rows
from w2b_sim.engines.batched.memory import row, structure
from w2b_sim.engines.batched.simd import fma, splat, vmax, where
from w2b_sim.engines.batched.tree import (
    base_of,
    factorise,
    forward_all,
    forward_row,
    multiply,
    row_add,
    row_dot,
    rows_product,
    set_base,
)

#: See `tree` for the forms of matrices and vectors; x, y, z are the world's axes.
Solve = structure('Solve', {
    'joint': ('dynamic', 'width'),   # momentum balance A, see `inertia`
    'base': (21,),
    'factor_joint': ('dynamic', 'width'),  # its Cholesky factor
    'factor_base': (21,),
    'b': ('slots',),
    'y': ('slots',),                 # the velocities found
    'z': ('slots',),                 # the same in Cholesky space, while sweeps run
    'target': ('dynamic',),          # rate that a motor holds if it can,
    'lowest': ('dynamic',),          # and the impulses it can do that with
    'highest': ('dynamic',),
    'row_x': ('contacts', 'width'),  # rows of the contacts in Cholesky space
    'row_y': ('contacts', 'width'),
    'row_z': ('contacts', 'width'),
    'impulse': ('contacts',),        # along z, x and y
    'slide_x': ('contacts',),
    'slide_y': ('contacts',),
    'leave': ('contacts',),          # least velocity along z
    'active': ('contacts',),         # 1 where the contact exists in this lane, else 0
    'inverse_x': ('contacts',),      # 1 / response to a unit impulse
    'inverse_y': ('contacts',),
    'inverse_z': ('contacts',),
    # of the viscous solve:
    'held': ('slots',),              # rates of the held joints, zero elsewhere
    'product': ('slots',),           # A times a vector
    'mode': ('dynamic',),            # see `motors`
    'free': ('dynamic',),            # 1 where the joint gives way
    'jacobian_x': ('contacts', 'width'),   # rows of the contacts in velocity space
    'jacobian_y': ('contacts', 'width'),
    'jacobian_z': ('contacts', 'width'),
    'missing': ('contacts',),        # `leave` less what is known of the velocity
    # of the dry friction solve:
    'motor': ('dynamic', 'width'),   # rows of the joints in Cholesky space
    'motor_impulse': ('dynamic',),
    'inverse': ('dynamic',),
    'limit': ('dynamic',),           # greatest impulse of the motor
    'cross_x': ('contacts',),        # velocity along x by a unit impulse along z
    'cross_y': ('contacts',),
    'taken': ('links',),             # slots of a leg that are taken, see `slots`
    'contact': ('contacts',),        # number of the contact in a slot, -1 for none
    'arm': ('contacts', 3),          # of the contact in a slot, see `Frame`
    'drive': ('contacts', 3),
    'level': ('contacts',),          # joints that move it
})


@inlined
def contact_jacobians(layout, tables, frame, solve, near, count, erp_per_h, reach, per_gap):
    """
    Write the rows of the contacts and the least velocities of the normals.

    Below the floor: leave it by a share of the depth. Above it, within `reach`: approach no faster
    than the gap times `per_gap`.
    """
    for q in range(count):
        c = near[q]
        depth = frame.depth[c]
        solve.leave[q] = where(depth >= 0.0, depth * erp_per_h, depth * per_gap)
        solve.active[q] = where(depth >= -reach, 1.0, depth * 0.0)
        contact_rows(layout, tables, frame, c, row(solve.jacobian_x, q), row(solve.jacobian_y, q),
                     row(solve.jacobian_z, q))


@inlined
def eliminate(layout, tables, solve):
    """Factorise the balance of what gives way, from modes set by `motors.set_modes`."""
    multiply(layout, tables, solve.joint, solve.base, solve.held, solve.product)
    for d in range(layout.dynamic):
        link = tables.dynamic_link[d]
        free = solve.free[d]
        solve.factor_joint[d, 0] = where(free > 0.5, solve.joint[d, 0], 1.0)
        for p in range(1, tables.chain_length[link]):
            solve.factor_joint[d, p] = (
                solve.joint[d, p] * (free * solve.free[tables.chain_of[link, p]]))
        for i in range(6):
            solve.factor_joint[d, layout.chain + i] = solve.joint[d, layout.chain + i] * free
        # The push is there already.
        solve.z[d] = (solve.z[d] + (solve.b[d] - solve.product[d])) * free
    for i in range(21):
        solve.factor_base[i] = solve.base[i]
    for i in range(layout.dynamic, layout.unknowns):
        solve.z[i] = solve.b[i] - solve.product[i]
    solve.z[layout.unknowns] = splat(layout, 0.0)
    factorise(layout, tables, solve.factor_joint, solve.factor_base)
    forward_all(layout, tables, solve.factor_joint, solve.factor_base, solve.z)


@inlined
def load_normal(layout, tables, frame, solve, near, q, start):
    """Take the row of a normal into Cholesky space and apply the impulse of `start` along it."""
    c = near[q]
    known = frame.contact_drive[c, 2] + _load(layout, tables, solve, tables.contact_link[c],
                                              solve.jacobian_z, solve.row_z, q)
    solve.missing[q] = solve.leave[q] - known
    solve.inverse_z[q] = 1.0 / rows_product(layout, solve.row_z, solve.row_z, q)
    solve.impulse[q] = start[c] * solve.active[q]
    _apply(layout, tables, solve, tables.contact_link[c], solve.row_z, q, solve.impulse[q])


@inlined
def _load(layout, tables, solve, link, jacobian, rows, q):
    """Write row q in Cholesky space; return the velocity that the held joints give along it."""
    known = splat(layout, 0.0)
    length = tables.chain_length[link]
    for p in range(length):
        d = tables.chain_of[link, p]
        known = fma(jacobian[q, p], solve.held[d], known)
        rows[q, p] = jacobian[q, p] * solve.free[d]
    for p in range(length, layout.width):
        rows[q, p] = jacobian[q, p]
    forward_row(layout, tables, solve.factor_joint, solve.factor_base, link, row(rows, q))
    return known


@inlined
def _apply(layout, tables, solve, link, rows, q, impulse):
    """Apply an impulse along a row."""
    set_base(layout, solve.z, row_add(layout, tables, link, rows, q, impulse, solve.z,
                                      base_of(layout, solve.z)))


@inlined
def visit_normal(layout, tables, solve, link, q, base):
    """Visit the row of a normal; return the base's part of z."""
    velocity = row_dot(layout, tables, link, solve.row_z, q, solve.z, base)
    old = solve.impulse[q]
    new = vmax(fma(solve.missing[q] - velocity, solve.inverse_z[q], old), 0.0) * solve.active[q]
    solve.impulse[q] = new
    return row_add(layout, tables, link, solve.row_z, q, new - old, solve.z, base)
