"""
Where the links are, and how they move when the servos turn the hinges.

Every link keeps a pose of its own, as in the original's engine (ODE), where a hinge is a constraint
that each step restores in part. With a_p and a_c the hinge seen from the parent's and the child's
centre of mass (turned into world axes), u the axis and rate the servo's velocity, the constraint
on the velocities of link k and its parent p reads

    w_k = w_p + u rate - (erp / h) u x u_k        u_k: the axis as the child has it
    v_k = v_p + w_p x a_p - w_k x a_c - (erp / h) gap

so all velocities follow from the base's (v, w): link k moves as if rigidly joined to the base at
the lever `arm` r_k = r_p + a_p - a_c, plus what the same recursion gives with the base at rest:
`drive` and `drive_spin`. The gaps telescope along the chain, so that the correction is that of
(offset - arm), the place where a link is against the one where its hinges put it.
"""

from __future__ import annotations

from w2b_sim.engines.batched.algebra import (
    add,
    add_scaled,
    cross,
    get3,
    inlined,
    rotate_row,
    scale,
    set3,
    sub,
)
from w2b_sim.engines.batched.functions import hinge_angle
from w2b_sim.engines.batched.simd import fma


@inlined
def rotations(layout, state, frame):
    """Work out every link's rotation matrix from its quaternion."""
    for k in range(layout.links):
        w, x, y, z = state.turn[k, 0], state.turn[k, 1], state.turn[k, 2], state.turn[k, 3]
        x2, y2, z2 = x + x, y + y, z + z
        xx, yy, zz = x * x2, y * y2, z * z2
        frame.rotation[k, 0] = 1.0 - (yy + zz)
        frame.rotation[k, 1] = fma(x, y2, -(w * z2))
        frame.rotation[k, 2] = fma(x, z2, w * y2)
        frame.rotation[k, 3] = fma(x, y2, w * z2)
        frame.rotation[k, 4] = 1.0 - (xx + zz)
        frame.rotation[k, 5] = fma(y, z2, -(w * x2))
        frame.rotation[k, 6] = fma(x, z2, -(w * y2))
        frame.rotation[k, 7] = fma(y, z2, w * x2)
        frame.rotation[k, 8] = 1.0 - (xx + yy)


@inlined
def hinge_angles(layout, tables, state):
    """
    Measure the hinge angles from the links' quaternions.

    The child's orientation in the parent's frame is (cos(angle / 2), u sin(angle / 2)).
    """
    for k in range(1, layout.links):
        p = tables.parent[k]
        a0, a1, a2, a3 = state.turn[p, 0], state.turn[p, 1], state.turn[p, 2], state.turn[p, 3]
        b0, b1, b2, b3 = state.turn[k, 0], state.turn[k, 1], state.turn[k, 2], state.turn[k, 3]
        cosine = fma(a3, b3, fma(a2, b2, fma(a1, b1, a0 * b0)))
        x = fma(a0, b1, -(b0 * a1)) - fma(a2, b3, -(a3 * b2))
        y = fma(a0, b2, -(b0 * a2)) - fma(a3, b1, -(a1 * b3))
        z = fma(a0, b3, -(b0 * a3)) - fma(a1, b2, -(a2 * b1))
        sine = fma(tables.axis[k, 2], z, fma(tables.axis[k, 1], y, tables.axis[k, 0] * x))
        state.angle[k - 1] = hinge_angle(sine, cosine)


@inlined
def drives(layout, tables, state, frame, erp_per_h):
    """
    Work out levers and drives of all links from the rotations and the servos' rates.

    A joint whose rate is an unknown of the solve (`dynamic`) adds nothing here.
    """
    for k in range(1, layout.links):
        p = tables.parent[k]
        axis = rotate_row(frame.rotation, p, tables.axis, k)
        parent_arm = rotate_row(frame.rotation, p, tables.anchor_parent, k)
        child_arm = rotate_row(frame.rotation, k, tables.anchor_child, k)
        own_axis = rotate_row(frame.rotation, k, tables.axis, k)
        parent_spin = get3(frame.drive_spin, p)
        spin = sub(parent_spin, scale(cross(axis, own_axis), erp_per_h))
        if tables.dynamic[k - 1] < 0:
            spin = add_scaled(spin, axis, frame.rate[k - 1])
        hinge = add(get3(frame.arm, p), parent_arm)
        arm = sub(hinge, child_arm)
        # The gap of this hinge alone: what the link is off, less what its parent is off already.
        off = sub(sub(get3(state.offset, k), get3(state.offset, p)),
                  sub(arm, get3(frame.arm, p)))
        velocity = add(get3(frame.drive, p), cross(parent_spin, parent_arm))
        velocity = sub(velocity, cross(spin, child_arm))
        if layout.dynamic > 0:
            set3(frame.axis, k, axis)
            set3(frame.hinge, k, hinge)
        set3(frame.arm, k, arm)
        set3(frame.drive_spin, k, spin)
        set3(frame.drive, k, sub(velocity, scale(off, erp_per_h)))
