"""
Momentum balance of the whole body: the matrix A and the vector b of the velocity solve.

One step of the original's engine finds velocities that satisfy the hinges and change the momentum by
the impulses of floor, servos and gravity. The hinges tie all velocities to the base's v, w and to
the rates of the dynamic joints (see `kinematics`), so the balance projected onto these unknowns x is

    A x = b + J^T (contact and motor impulses)
    A = sum_k J_k^T M_k J_k,    b = sum_k J_k^T (M_k (old velocity_k - drive_k) + h force_k)

with the gyroscopic torque -w x I w taken at the old state. About the base's centre of mass, with
m the mass, s the first and I the second moment of all links, the momentum of rigid motion (v, w) is
p = m v + w x s, L = s x v + I w, which fills A in the order of `contacts`. The column of a dynamic
joint is the momentum of all that it moves, turning at 1 rad/s.
"""

from __future__ import annotations

from w2b_sim.engines.batched.algebra import add, add_scaled, cross, dot, get3, inlined, rotate, \
    scale, sub, tri
from w2b_sim.engines.batched.simd import fma, splat

#: Entries of a composite: m | s (3) | Ixx Iyy Izz Ixy Ixz Iyz | p (3) | L (3)
COMPOSITE = 16


@inlined
def balance(layout, tables, state, frame, composite, base_mass, impulse, h, a, b):
    """
    Fill A (packed lower triangle) and b.

    `composite` is scratch, (L or 1, COMPOSITE); `base_mass` scales the base's mass and inertia;
    `impulse` is gravity (and push) times h, per unit of mass, m/s.
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
    _fill_base(layout, composite, a, b)
    if layout.dynamic > 0:
        _fill_joints(layout, tables, frame, composite, a, b)


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
            n = rotate(frame.rotation, k, tables.inertia_axes[k, i])
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
def _fill_base(layout, composite, a, b):
    """Write the base's rows of A and b from the whole body's composite."""
    zero = splat(layout, 0.0)
    vz, wx, wy = 3 + layout.dynamic, 4 + layout.dynamic, 5 + layout.dynamic
    m, sx, sy, sz = composite[0, 0], composite[0, 1], composite[0, 2], composite[0, 3]
    a[tri(0, 0)] = m
    a[tri(1, 0)] = zero
    a[tri(1, 1)] = m
    a[tri(2, 0)] = -sy
    a[tri(2, 1)] = sx
    a[tri(2, 2)] = composite[0, 6]
    a[tri(vz, 0)] = zero
    a[tri(vz, 1)] = zero
    a[tri(vz, 2)] = zero
    a[tri(vz, vz)] = m
    a[tri(wx, 0)] = zero
    a[tri(wx, 1)] = -sz
    a[tri(wx, 2)] = composite[0, 8]
    a[tri(wx, vz)] = sy
    a[tri(wx, wx)] = composite[0, 4]
    a[tri(wy, 0)] = sz
    a[tri(wy, 1)] = zero
    a[tri(wy, 2)] = composite[0, 9]
    a[tri(wy, vz)] = -sx
    a[tri(wy, wx)] = composite[0, 7]
    a[tri(wy, wy)] = composite[0, 5]
    b[0] = composite[0, 10]
    b[1] = composite[0, 11]
    b[2] = composite[0, 15]
    b[vz] = composite[0, 12]
    b[wx] = composite[0, 13]
    b[wy] = composite[0, 14]


@inlined
def _fill_joints(layout, tables, frame, composite, a, b):
    """Write the dynamic joints' rows: spatial momentum of what each moves, seen by the others."""
    vz, wx, wy = 3 + layout.dynamic, 4 + layout.dynamic, 5 + layout.dynamic
    zero = splat(layout, 0.0)
    for d in range(layout.dynamic):
        link = tables.dynamic_joint[d] + 1
        axis = get3(frame.axis, link)
        # Turning about the hinge moves the reference point (the base's centre of mass) as well.
        v = cross(get3(frame.hinge, link), axis)
        m = composite[link, 0]
        s = (composite[link, 1], composite[link, 2], composite[link, 3])
        p = add(scale(v, m), cross(axis, s))
        row_x = (composite[link, 4], composite[link, 7], composite[link, 8])
        row_y = (composite[link, 7], composite[link, 5], composite[link, 9])
        row_z = (composite[link, 8], composite[link, 9], composite[link, 6])
        angular = add(cross(s, v), (dot(row_x, axis), dot(row_y, axis), dot(row_z, axis)))
        a[tri(3 + d, 0)] = p[0]
        a[tri(3 + d, 1)] = p[1]
        a[tri(3 + d, 2)] = angular[2]
        a[tri(vz, 3 + d)] = p[2]
        a[tri(wx, 3 + d)] = angular[0]
        a[tri(wy, 3 + d)] = angular[1]
        b[3 + d] = (dot(axis, (composite[link, 13], composite[link, 14], composite[link, 15]))
                    + dot(v, (composite[link, 10], composite[link, 11], composite[link, 12])))
        for e in range(d + 1):
            other = tables.dynamic_joint[e] + 1
            # Of two joints on one chain the earlier one sees the later one's momentum.
            if tables.moves[other - 1, link] != 0:
                u = get3(frame.axis, other)
                a[tri(3 + d, 3 + e)] = dot(u, angular) + dot(cross(get3(frame.hinge, other), u), p)
            else:
                a[tri(3 + d, 3 + e)] = zero
