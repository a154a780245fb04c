"""From the solved velocities to the next pose: semi-implicit Euler, link by link."""

from __future__ import annotations

from w2b_sim.engines.batched.algebra import add, add_scaled, cross, get3, inlined, set3
from w2b_sim.engines.batched.contacts import V_X, V_Y, V_Z, W_X, W_Y, W_Z
from w2b_sim.engines.batched.functions import inverse_root
from w2b_sim.engines.batched.simd import fma, splat


@inlined
def integrate(layout, tables, state, frame, motion, solution, h):
    """
    Give every link its velocity and move it for h.

    `solution` holds the unknowns in the order of `tree`; `motion` is scratch, (L, 6): what the
    dynamic joints add to a link's motion, as velocity at the base's centre of mass and spin.
    """
    zero = splat(layout, 0.0)
    first = layout.dynamic
    base = (solution[first + V_X], solution[first + V_Y], solution[first + V_Z])
    base_spin = (solution[first + W_X], solution[first + W_Y], solution[first + W_Z])
    for i in range(6):
        motion[0, i] = zero
    for k in range(layout.links):
        if layout.dynamic > 0 and k > 0:
            _joint_motion(layout, tables, frame, motion, solution, k)
        velocity, spin = base, base_spin
        if layout.dynamic > 0:
            velocity = add(velocity, (motion[k, 0], motion[k, 1], motion[k, 2]))
            spin = add(spin, (motion[k, 3], motion[k, 4], motion[k, 5]))
        velocity = add(add(velocity, cross(spin, get3(frame.arm, k))), get3(frame.drive, k))
        spin = add(spin, get3(frame.drive_spin, k))
        set3(state.velocity, k, velocity)
        set3(state.spin, k, spin)
        turn(state, k, spin, h)
        if k == 0:
            for i in range(3):
                state.place[i] = fma(velocity[i], h, state.place[i])
        else:
            for i in range(3):
                state.offset[k, i] = fma(velocity[i] - base[i], h, state.offset[k, i])


@inlined
def _joint_motion(layout, tables, frame, motion, solution, k):
    """Hand the parent's share of the dynamic joints' motion on to link k, with its own joint's."""
    p = tables.parent[k]
    v = (motion[p, 0], motion[p, 1], motion[p, 2])
    w = (motion[p, 3], motion[p, 4], motion[p, 5])
    d = tables.dynamic[k - 1]
    if d >= 0:
        axis = get3(frame.axis, k)
        v = add_scaled(v, cross(get3(frame.hinge, k), axis), solution[d])
        w = add_scaled(w, axis, solution[d])
    for i in range(3):
        motion[k, i] = v[i]
        motion[k, 3 + i] = w[i]


@inlined
def turn(state, k, spin, h):
    """Turn link k: q += (h / 2) (0, w) q, then to unit length."""
    x, y, z = spin[0] * (0.5 * h), spin[1] * (0.5 * h), spin[2] * (0.5 * h)
    q0, q1, q2, q3 = state.turn[k, 0], state.turn[k, 1], state.turn[k, 2], state.turn[k, 3]
    a0 = fma(-x, q1, fma(-y, q2, fma(-z, q3, q0)))
    a1 = fma(x, q0, fma(y, q3, fma(-z, q2, q1)))
    a2 = fma(-x, q3, fma(y, q0, fma(z, q1, q2)))
    a3 = fma(x, q2, fma(-y, q1, fma(z, q0, q3)))
    shrink = inverse_root(fma(a0, a0, fma(a1, a1, fma(a2, a2, a3 * a3))))
    state.turn[k, 0] = a0 * shrink
    state.turn[k, 1] = a1 * shrink
    state.turn[k, 2] = a2 * shrink
    state.turn[k, 3] = a3 * shrink
