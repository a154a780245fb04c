"""
Momentum balance of the whole body: the matrix A and the vector b of the velocity solve.

One step of the original's engine finds velocities that satisfy the hinges and change the momentum
by the impulses of floor, servos and gravity. The hinges tie all velocities to the base's v, w and
to the rates of the dynamic joints (see `kinematics`), so the balance projected onto these unknowns
x is

    A x = b + J^T (contact and motor impulses)
    A = sum_k J_k^T M_k J_k,    b = sum_k J_k^T (M_k (old velocity_k - drive_k) + h force_k)

with the gyroscopic torque -w x I w taken at the old state. About the base's centre of mass, with
m the mass, s the first and I the second moment of all links, the momentum of rigid motion (v, w) is
p = m v + w x s, L = s x v + I w, which fills A in the order of
`contacts`. The column of a dynamic
joint is the momentum of all that it moves, turning at 1 rad/s.
"""

from __future__ import annotations

from w2b_sim.engines.batched.algebra import (
    add,
    add_scaled,
    cross,
    dot,
    get3,
    inlined,
    rotate_row,
    scale,
    sub,
    tri,
)
from w2b_sim.engines.batched.contacts import V_X, V_Y, V_Z, W_X, W_Y, W_Z
from w2b_sim.engines.batched.simd import fma, splat

#: Entries of a composite: m | s (3) | Ixx Iyy Izz Ixy Ixz Iyz | p (3) | L (3)
COMPOSITE = 16


@inlined
def compose(layout, tables, state, frame, composite, base_mass, impulse, h):
    """
    Sum up mass, moments and momentum: of the whole body in row 0 of `composite`.

    Where there are dynamic joints, row k has those of link k and all that it carries. `base_mass`
    scales the base's mass and inertia; `impulse` is gravity (and push) times h, per unit of mass,
    m/s.
    """
    zero = splat(layout, 0.0)
    rows = layout.links if layout.dynamic > 0 else 1
    for k in range(rows):
        for i in range(COMPOSITE):
            composite[k, i] = zero
    for step in range(layout.links):
        k = layout.links - 1 - step
        row = k if layout.dynamic > 0 else 0
        _add_link(layout, tables, state, frame, composite, k, row, base_mass, impulse, h)
        if layout.dynamic > 0 and k > 0:
            p = tables.parent[k]
            for i in range(COMPOSITE):
                composite[p, i] = composite[p, i] + composite[k, i]


@inlined
def _add_link(layout, tables, state, frame, composite, k, row, base_mass, impulse, h):
    """Add link k's mass, moments and momentum to a row of the composites."""
    one = splat(layout, 1.0)
    factor = base_mass if k == 0 else one
    mass = factor * tables.mass[k]
    common = factor * tables.inertia[k]
    arm = get3(frame.arm, k)
    spin = get3(state.spin, k)
    change = sub(spin, get3(frame.drive_spin, k))
    linear = scale(add(sub(get3(state.velocity, k), get3(frame.drive, k)), impulse), mass)
    angular = add(cross(arm, linear), scale(change, common))
    moment = scale(arm, mass)
    composite[row, 0] = composite[row, 0] + mass
    for i in range(3):
        composite[row, 1 + i] = composite[row, 1 + i] + moment[i]
        composite[row, 10 + i] = composite[row, 10 + i] + linear[i]
    ixx = fma(moment[1], arm[1], fma(moment[2], arm[2], common))
    iyy = fma(moment[0], arm[0], fma(moment[2], arm[2], common))
    izz = fma(moment[0], arm[0], fma(moment[1], arm[1], common))
    ixy, ixz, iyz = -(moment[0] * arm[1]), -(moment[0] * arm[2]), -(moment[1] * arm[2])
    for i in range(2):
        if tables.inertia_along[k, i] != 0.0:
            along = factor * tables.inertia_along[k, i]
            n = rotate_row(frame.rotation, k, tables.inertia_axes, 2 * k + i)
            weighted = scale(n, along)
            ixx = fma(weighted[0], n[0], ixx)
            iyy = fma(weighted[1], n[1], iyy)
            izz = fma(weighted[2], n[2], izz)
            ixy = fma(weighted[0], n[1], ixy)
            ixz = fma(weighted[0], n[2], ixz)
            iyz = fma(weighted[1], n[2], iyz)
            # The gyroscopic torque has no share of the common part: w x w = 0.
            angular = add_scaled(angular, weighted, dot(n, change))
            angular = add_scaled(angular, cross(spin, weighted), -(dot(n, spin) * h))
    composite[row, 4] = composite[row, 4] + ixx
    composite[row, 5] = composite[row, 5] + iyy
    composite[row, 6] = composite[row, 6] + izz
    composite[row, 7] = composite[row, 7] + ixy
    composite[row, 8] = composite[row, 8] + ixz
    composite[row, 9] = composite[row, 9] + iyz
    for i in range(3):
        composite[row, 13 + i] = composite[row, 13 + i] + angular[i]


@inlined
def fill_base(layout, composite, solve):
    """Write the base's part of A and b from the whole body's composite."""
    zero = splat(layout, 0.0)
    a, b, first = solve.base, solve.b, layout.dynamic
    m, sx, sy, sz = composite[0, 0], composite[0, 1], composite[0, 2], composite[0, 3]
    for i in range(21):
        a[i] = zero
    a[tri(V_X, V_X)] = m
    a[tri(V_Y, V_Y)] = m
    a[tri(V_Z, V_Z)] = m
    a[tri(W_Z, V_X)] = -sy
    a[tri(W_Z, V_Y)] = sx
    a[tri(W_X, V_Y)] = -sz
    a[tri(W_X, V_Z)] = sy
    a[tri(W_Y, V_X)] = sz
    a[tri(W_Y, V_Z)] = -sx
    a[tri(W_X, W_X)] = composite[0, 4]
    a[tri(W_Y, W_Y)] = composite[0, 5]
    a[tri(W_Z, W_Z)] = composite[0, 6]
    a[tri(W_Y, W_X)] = composite[0, 7]
    a[tri(W_X, W_Z)] = composite[0, 8]
    a[tri(W_Y, W_Z)] = composite[0, 9]
    b[first + V_X] = composite[0, 10]
    b[first + V_Y] = composite[0, 11]
    b[first + V_Z] = composite[0, 12]
    b[first + W_X] = composite[0, 13]
    b[first + W_Y] = composite[0, 14]
    b[first + W_Z] = composite[0, 15]


@inlined
def fill_joints(layout, tables, frame, composite, solve):
    """Write the dynamic joints' part: momentum of what each moves, as the joints inside see it."""
    for d in range(layout.dynamic):
        link = tables.dynamic_link[d]
        axis = get3(frame.axis, link)
        # Turning about the hinge moves the reference point (the base's centre of mass) as well.
        v = cross(get3(frame.hinge, link), axis)
        s = (composite[link, 1], composite[link, 2], composite[link, 3])
        p = add(scale(v, composite[link, 0]), cross(axis, s))
        row_x = (composite[link, 4], composite[link, 7], composite[link, 8])
        row_y = (composite[link, 7], composite[link, 5], composite[link, 9])
        row_z = (composite[link, 8], composite[link, 9], composite[link, 6])
        angular = add(cross(s, v), (dot(row_x, axis), dot(row_y, axis), dot(row_z, axis)))
        for place in range(tables.chain_length[link]):
            turned = tables.dynamic_link[tables.chain_of[link, place]]
            u = get3(frame.axis, turned)
            solve.joint[d, place] = dot(u, angular) + dot(cross(get3(frame.hinge, turned), u), p)
        base = layout.chain
        solve.joint[d, base + V_X] = p[0]
        solve.joint[d, base + V_Y] = p[1]
        solve.joint[d, base + V_Z] = p[2]
        solve.joint[d, base + W_X] = angular[0]
        solve.joint[d, base + W_Y] = angular[1]
        solve.joint[d, base + W_Z] = angular[2]
        solve.b[d] = (
            dot(axis, (composite[link, 13], composite[link, 14], composite[link, 15]))
            + dot(v, (composite[link, 10], composite[link, 11], composite[link, 12])))
