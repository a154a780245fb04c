"""
What the servos' torques were: from the motors' impulses, or from the momentum that a step changed.

The impulse that a joint passes on is what changes the momentum of all that it moves, less what
gravity and the floor did. Its share about the hinge's axis is the servo's. That holds for every
joint, also those that the solve moves whatever it takes; where all are unknowns of the dry
friction solve it has found the motors' impulses already.
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
)
from w2b_sim.engines.batched.simd import vabs, vmin, where


@inlined
def keep_motion(layout, state, motion):
    """Copy the links' velocities and spins to `motion` (L, 6)."""
    for k in range(layout.links):
        for i in range(3):
            motion[k, i] = state.velocity[k, i]
            motion[k, 3 + i] = state.spin[k, i]


@inlined
def add_effort(layout, tables, state, frame, solve, before, wrench, near, found, impulse, slip, h,
               effort):
    """
    Add the magnitude of each servo's impulse in this step, N m s, to `effort` (J,).

    `before` (L, 6) is the links' motion before the step, `wrench` (L, 6) scratch; `impulse` is
    gravity and push times h, per unit of mass; `slip` as `friction.solve_contacts` takes it. What a
    stop bears beyond the servo's torque is not the servo's.
    """
    if layout.coulomb and layout.dynamic == layout.joints:
        for d in range(layout.dynamic):
            j = tables.dynamic_link[d] - 1
            effort[j] = effort[j] + vmin(vabs(state.motor[d]), solve.limit[d])
    else:
        _momentum(layout, tables, state, frame, before, wrench, impulse, h)
        for q in range(found):
            _contact(layout, tables, state, frame, wrench, near[q], slip)
        for step in range(layout.joints):
            k = layout.joints - step
            p = tables.parent[k]
            axis = rotate_row(frame.rotation, p, tables.axis, k)
            hinge = add(get3(frame.arm, p), rotate_row(frame.rotation, p, tables.anchor_parent, k))
            force = (wrench[k, 0], wrench[k, 1], wrench[k, 2])
            moment = sub((wrench[k, 3], wrench[k, 4], wrench[k, 5]), cross(hinge, force))
            limit = state.strength[0] * (tables.torque[k - 1] * h)
            effort[k - 1] = effort[k - 1] + vmin(vabs(dot(axis, moment)), limit)
            for i in range(6):
                wrench[p, i] = wrench[p, i] + wrench[k, i]


@inlined
def _momentum(layout, tables, state, frame, before, wrench, impulse, h):
    """Set each link's change of momentum, and of angular momentum about the base, by its joints."""
    for k in range(layout.links):
        was = (before[k, 3], before[k, 4], before[k, 5])
        moved = sub(get3(state.velocity, k), (before[k, 0], before[k, 1], before[k, 2]))
        turned = sub(get3(state.spin, k), was)
        linear = scale(sub(moved, impulse), was[0] * 0.0 + tables.mass[k])
        angular = add(cross(get3(frame.arm, k), linear),
                      scale(turned, was[0] * 0.0 + tables.inertia[k]))
        for i in range(2):
            if tables.inertia_along[k, i] != 0.0:
                n = rotate_row(frame.rotation, k, tables.inertia_axes, 2 * k + i)
                weighted = scale(n, was[0] * 0.0 + tables.inertia_along[k, i])
                angular = add_scaled(angular, weighted, dot(n, turned))
                angular = add_scaled(angular, cross(was, weighted), dot(n, was) * h)
        for i in range(3):
            wrench[k, i] = linear[i]
            wrench[k, 3 + i] = angular[i]


@inlined
def _contact(layout, tables, state, frame, wrench, c, slip):
    """Take the floor's impulse at contact c from its link's wrench."""
    link = tables.contact_link[c]
    arm = get3(frame.contact_arm, c)
    slide_x, slide_y = state.slide_x[c], state.slide_y[c]
    if not layout.coulomb:
        # Viscous friction is known from the velocity that the step ended with.
        lever = sub(arm, get3(frame.arm, link))
        speed = add(get3(state.velocity, link), cross(get3(state.spin, link), lever))
        drag = where(state.press_first[c] > 0.0, -slip, slip * 0.0)
        slide_x, slide_y = drag * speed[0], drag * speed[1]
    force = (slide_x, slide_y, state.press[c])
    moment = cross(arm, force)
    for i in range(3):
        wrench[link, i] = wrench[link, i] - force[i]
        wrench[link, 3 + i] = wrench[link, 3 + i] - moment[i]
