"""
The momentum balance of a tree of links: storage, Cholesky factor and solves that keep its zeros.

Unknowns: the rates of the dynamic joints, those far from the base first, then the base's velocity
in the order v_x, v_y, w_z, v_z, w_x, w_y (`BASE`). Two joints share an entry of the matrix only if
one hangs on the other, and eliminating the outer joints first keeps it so: the factor's column of a
joint has entries for the joints between it and the base, and for the base.

The matrix is stored as that: `joint[d]` holds, for dynamic joint d, the entries with the joints of
its chain (itself first, then towards the base, at most `layout.chain` of them), then those with
the base; `base` is a packed lower triangle. A vector that belongs to one link (a row of a contact)
has the same form, (chain, base), and `chain_of[link]` lists the joints; a full vector has all
joints, then the base, then one place that is always zero, which fills up short chains.
"""

from __future__ import annotations

from w2b_sim.engines.batched.algebra import inlined, tri
from w2b_sim.engines.batched.simd import fma, vsqrt

BASE = 6


@inlined
def factorise(layout, tables, joint, base):
    """Replace the matrix by its factor, A = L L^T; the diagonal then holds 1 / L_ii."""
    for d in range(layout.dynamic):
        link = tables.dynamic_link[d]
        length = tables.chain_length[link]
        inverse = 1.0 / vsqrt(joint[d, 0])
        joint[d, 0] = inverse
        for p in range(1, length):
            joint[d, p] = joint[d, p] * inverse
        for i in range(BASE):
            joint[d, layout.chain + i] = joint[d, layout.chain + i] * inverse
        for p in range(1, length):
            outer = tables.chain_of[link, p]
            factor = -joint[d, p]
            for q in range(p, length):
                joint[outer, q - p] = fma(factor, joint[d, q], joint[outer, q - p])
            for i in range(BASE):
                joint[outer, layout.chain + i] = fma(factor, joint[d, layout.chain + i],
                                                     joint[outer, layout.chain + i])
        for i in range(BASE):
            factor = -joint[d, layout.chain + i]
            for j in range(i + 1):
                base[tri(i, j)] = fma(factor, joint[d, layout.chain + j], base[tri(i, j)])
    for j in range(BASE):
        diagonal = base[tri(j, j)]
        for k in range(j):
            diagonal = fma(-base[tri(j, k)], base[tri(j, k)], diagonal)
        diagonal = 1.0 / vsqrt(diagonal)
        base[tri(j, j)] = diagonal
        for i in range(j + 1, BASE):
            total = base[tri(i, j)]
            for k in range(j):
                total = fma(-base[tri(i, k)], base[tri(j, k)], total)
            base[tri(i, j)] = total * diagonal


@inlined
def forward_row(layout, tables, joint, base, link, row):
    """Replace a link's vector by L^-1 times it."""
    length = tables.chain_length[link]
    for p in range(length):
        d = tables.chain_of[link, p]
        value = row[p] * joint[d, 0]
        row[p] = value
        for q in range(p + 1, length):
            row[q] = fma(-joint[d, q - p], value, row[q])
        for i in range(BASE):
            row[layout.chain + i] = fma(-joint[d, layout.chain + i], value, row[layout.chain + i])
    for i in range(BASE):
        total = row[layout.chain + i]
        for k in range(i):
            total = fma(-base[tri(i, k)], row[layout.chain + k], total)
        row[layout.chain + i] = total * base[tri(i, i)]


@inlined
def forward_all(layout, tables, joint, base, x):
    """Replace a full vector by L^-1 times it."""
    for d in range(layout.dynamic):
        link = tables.dynamic_link[d]
        value = x[d] * joint[d, 0]
        x[d] = value
        for p in range(1, tables.chain_length[link]):
            outer = tables.chain_of[link, p]
            x[outer] = fma(-joint[d, p], value, x[outer])
        for i in range(BASE):
            x[layout.dynamic + i] = fma(-joint[d, layout.chain + i], value, x[layout.dynamic + i])
    for i in range(BASE):
        total = x[layout.dynamic + i]
        for k in range(i):
            total = fma(-base[tri(i, k)], x[layout.dynamic + k], total)
        x[layout.dynamic + i] = total * base[tri(i, i)]


@inlined
def backward_all(layout, tables, joint, base, x):
    """Replace a full vector by L^-T times it."""
    for step in range(BASE):
        i = BASE - 1 - step
        total = x[layout.dynamic + i]
        for k in range(i + 1, BASE):
            total = fma(-base[tri(k, i)], x[layout.dynamic + k], total)
        x[layout.dynamic + i] = total * base[tri(i, i)]
    for step in range(layout.dynamic):
        d = layout.dynamic - 1 - step
        link = tables.dynamic_link[d]
        total = x[d]
        for p in range(1, tables.chain_length[link]):
            total = fma(-joint[d, p], x[tables.chain_of[link, p]], total)
        for i in range(BASE):
            total = fma(-joint[d, layout.chain + i], x[layout.dynamic + i], total)
        x[d] = total * joint[d, 0]


@inlined
def multiply(layout, tables, joint, base, x, product):
    """Set `product` to the matrix times x, both full vectors."""
    first = layout.dynamic
    for i in range(BASE):
        total = base[tri(i, i)] * x[first + i]
        for k in range(i):
            total = fma(base[tri(i, k)], x[first + k], total)
        for k in range(i + 1, BASE):
            total = fma(base[tri(k, i)], x[first + k], total)
        product[first + i] = total
    for d in range(layout.dynamic):
        product[d] = joint[d, 0] * x[d]
    for d in range(layout.dynamic):
        link = tables.dynamic_link[d]
        total = product[d]
        for p in range(1, tables.chain_length[link]):
            outer = tables.chain_of[link, p]
            total = fma(joint[d, p], x[outer], total)
            product[outer] = fma(joint[d, p], x[d], product[outer])
        for i in range(BASE):
            total = fma(joint[d, layout.chain + i], x[first + i], total)
            product[first + i] = fma(joint[d, layout.chain + i], x[d], product[first + i])
        product[d] = total


@inlined
def base_of(layout, x):
    """Return the base's part of a full vector as a tuple, which stays in registers."""
    first = layout.dynamic
    return x[first], x[first + 1], x[first + 2], x[first + 3], x[first + 4], x[first + 5]


@inlined
def set_base(layout, x, base):
    """Write the base's part of a full vector."""
    for i in range(BASE):
        x[layout.dynamic + i] = base[i]


@inlined
def row_dot(layout, tables, link, rows, q, x, base):
    """
    Return the product of row q, a link's vector, with a full one, in three short chains.

    The full vector's part of the joints is in `x`, the base's in `base`.
    """
    c = layout.chain
    linear = fma(rows[q, c + 2], base[2], fma(rows[q, c + 1], base[1], rows[q, c] * base[0]))
    turning = fma(rows[q, c + 5], base[5], fma(rows[q, c + 4], base[4], rows[q, c + 3] * base[3]))
    joints = rows[q, 0] * x[tables.chain_of[link, 0]]
    for p in range(1, layout.chain):
        joints = fma(rows[q, p], x[tables.chain_of[link, p]], joints)
    return (linear + turning) + joints


@inlined
def row_add(layout, tables, link, rows, q, factor, x, base):
    """Add factor times row q, a link's vector, to a full one; return the base's part."""
    for p in range(layout.chain):
        place = tables.chain_of[link, p]
        x[place] = fma(rows[q, p], factor, x[place])
    c = layout.chain
    return (fma(rows[q, c], factor, base[0]), fma(rows[q, c + 1], factor, base[1]),
            fma(rows[q, c + 2], factor, base[2]), fma(rows[q, c + 3], factor, base[3]),
            fma(rows[q, c + 4], factor, base[4]), fma(rows[q, c + 5], factor, base[5]))


@inlined
def rows_product(layout, left, right, q):
    """Return the product of rows q of two tables, vectors of the same link."""
    total = left[q, 0] * right[q, 0]
    for i in range(1, layout.width):
        total = fma(left[q, i], right[q, i], total)
    return total


@inlined
def rank_one(layout, tables, joint, base, link, row, weight):
    """Add weight * row row^T, row a link's vector, to the matrix."""
    length = tables.chain_length[link]
    for p in range(length):
        d = tables.chain_of[link, p]
        weighted = weight * row[p]
        for q in range(p, length):
            joint[d, q - p] = fma(weighted, row[q], joint[d, q - p])
        for i in range(BASE):
            joint[d, layout.chain + i] = fma(weighted, row[layout.chain + i],
                                             joint[d, layout.chain + i])
    for i in range(BASE):
        weighted = weight * row[layout.chain + i]
        for j in range(i + 1):
            base[tri(i, j)] = fma(weighted, row[layout.chain + j], base[tri(i, j)])
