"""
Contact with dry friction: Gauss-Seidel over normals and tangents together.

Each contact's friction impulse (f_x, f_y) opposes sliding, softened by force-dependent slip
(velocity + (slip / h) impulse = 0) and bounded by Coulomb's cone, |f| <= mu * normal impulse. An
infinite mu gives the original's unbounded viscous friction, solved in one stage.

About the centre of mass an impulse f at r changes v by f / m and w by I^-1 (r x f), and the
contact's velocity is v + w x r + drive. A visit to a contact needs the changes that the one before
has made, and the latency of that chain bounds the engine in this mode. To keep it short, the three
velocities are worked out at once, and what the new push does to the sliding is added by one product
(`slide_coupling`).
"""

from __future__ import annotations

from w2b_sim.engines.batched.algebra import get3, inlined
from w2b_sim.engines.batched.rigid import (
    NO_FLOOR,
    about_centre,
    keep_impulses,
    place_contacts,
    set_solution,
    take_impulses,
)
from w2b_sim.engines.batched.simd import any_lane, fma, vmax, vsqrt, where


@inlined
def solve_coulomb(layout, state, frame, composite, contacts, near, count, erp_per_h, slip_per_h,
                  friction, sweeps, reach, per_gap, solution):
    """Solve for the base's velocity of one step; it ends in `solution`."""
    inverse_mass, centre, p, angular, inertia = about_centre(composite)
    places = place_contacts(layout, frame, contacts, near, count, centre, erp_per_h, reach, per_gap)
    take_impulses(layout, contacts, near, count, places, state.press, contacts.impulse)
    take_impulses(layout, contacts, near, count, places, state.slide_x, contacts.slide_x)
    take_impulses(layout, contacts, near, count, places, state.slide_y, contacts.slide_y)
    ixx, iyy, izz, ixy, ixz, iyz = inertia
    # Inverse of I by cofactors.
    cxx, cyy, czz = fma(iyy, izz, -(iyz * iyz)), fma(ixx, izz, -(ixz * ixz)), \
        fma(ixx, iyy, -(ixy * ixy))
    cxy, cxz, cyz = fma(ixz, iyz, -(ixy * izz)), fma(ixy, iyz, -(ixz * iyy)), \
        fma(ixy, ixz, -(iyz * ixx))
    inverse = 1.0 / fma(ixx, cxx, fma(ixy, cxy, ixz * cxz))
    g = (cxx * inverse, cyy * inverse, czz * inverse, cxy * inverse, cxz * inverse, cyz * inverse)
    vx, vy, vz = p[0] * inverse_mass, p[1] * inverse_mass, p[2] * inverse_mass
    wx = fma(g[0], angular[0], fma(g[3], angular[1], g[4] * angular[2]))
    wy = fma(g[3], angular[0], fma(g[1], angular[1], g[5] * angular[2]))
    wz = fma(g[4], angular[0], fma(g[5], angular[1], g[2] * angular[2]))
    for q in range(places):
        x, y, z = contacts.arm[q, 0], contacts.arm[q, 1], contacts.arm[q, 2]
        normal, tangent_x, tangent_y = contacts.normal, contacts.tangent_x, contacts.tangent_y
        _answer(g, inverse_mass, 0.0, y, -x, z * 0.0, normal, q)
        _answer(g, inverse_mass, slip_per_h, z * 0.0, z, -y, tangent_x, q)
        _answer(g, inverse_mass, slip_per_h, -z, z * 0.0, x, tangent_y, q)
        # Where a place has no contact its tangents ask for nothing.
        here = contacts.target[q] > 0.1 * NO_FLOOR
        tangent_x[q, 3] = where(here, tangent_x[q, 3], 0.0)
        tangent_y[q, 3] = where(here, tangent_y[q, 3], 0.0)
        contacts.slide_coupling[q, 0] = fma(z, normal[q, 1], -(y * normal[q, 2]))
        contacts.slide_coupling[q, 1] = fma(x, normal[q, 2], -(z * normal[q, 0]))
        push, slide_x, slide_y = contacts.impulse[q], contacts.slide_x[q], contacts.slide_y[q]
        vx, vy = fma(inverse_mass, slide_x, vx), fma(inverse_mass, slide_y, vy)
        vz = fma(inverse_mass, push, vz)
        wx, wy, wz = _turned(contacts, q, push, slide_x, slide_y, wx, wy, wz)
    for _ in range(sweeps):
        for q in range(places):
            x, y, z = contacts.arm[q, 0], contacts.arm[q, 1], contacts.arm[q, 2]
            old = contacts.impulse[q]
            old_x, old_y = contacts.slide_x[q], contacts.slide_y[q]
            drive = get3(contacts.drive, q)
            missing = fma(x, wy, fma(-y, wx, contacts.target[q] - vz))
            speed_x = fma(z, wy, fma(-y, wz, fma(slip_per_h, old_x, drive[0] + vx)))
            speed_y = fma(x, wz, fma(-z, wx, fma(slip_per_h, old_y, drive[1] + vy)))
            push = vmax(missing * contacts.normal[q, 3], -old)
            speed_x = fma(contacts.slide_coupling[q, 0], push, speed_x)
            speed_y = fma(contacts.slide_coupling[q, 1], push, speed_y)
            new = old + push
            new_x = fma(-speed_x, contacts.tangent_x[q, 3], old_x)
            new_y = fma(-speed_y, contacts.tangent_y[q, 3], old_y)
            size = fma(new_x, new_x, new_y * new_y)
            bound = friction * new
            slides = size > bound * bound
            if any_lane(slides):
                share = where(slides, bound / vsqrt(size), 1.0)
                new_x, new_y = new_x * share, new_y * share
            contacts.impulse[q] = new
            contacts.slide_x[q] = new_x
            contacts.slide_y[q] = new_y
            slide_x, slide_y = new_x - old_x, new_y - old_y
            vx, vy = fma(inverse_mass, slide_x, vx), fma(inverse_mass, slide_y, vy)
            vz = fma(inverse_mass, push, vz)
            wx, wy, wz = _turned(contacts, q, push, slide_x, slide_y, wx, wy, wz)
    keep_impulses(layout, contacts, near, count, places, state.press, contacts.impulse)
    keep_impulses(layout, contacts, near, count, places, state.slide_x, contacts.slide_x)
    keep_impulses(layout, contacts, near, count, places, state.slide_y, contacts.slide_y)
    set_solution(solution, centre, (vx, vy, vz), (wx, wy, wz))


@inlined
def _answer(g, inverse_mass, softness, tx, ty, tz, row, q):
    """
    Write the change of w by a unit impulse with torque t, and 1 / the change of its own velocity.

    A soft row gives way by `softness` times its impulse.
    """
    wx = fma(g[0], tx, fma(g[3], ty, g[4] * tz))
    wy = fma(g[3], tx, fma(g[1], ty, g[5] * tz))
    wz = fma(g[4], tx, fma(g[5], ty, g[2] * tz))
    row[q, 0] = wx
    row[q, 1] = wy
    row[q, 2] = wz
    row[q, 3] = 1.0 / (fma(tx, wx, fma(ty, wy, fma(tz, wz, inverse_mass))) + softness)


@inlined
def _turned(contacts, q, push, slide_x, slide_y, wx, wy, wz):
    """Return w after impulses along z, x and y at contact q."""
    normal, tangent_x, tangent_y = contacts.normal, contacts.tangent_x, contacts.tangent_y
    wx = fma(tangent_x[q, 0], slide_x, fma(tangent_y[q, 0], slide_y, fma(normal[q, 0], push, wx)))
    wy = fma(tangent_x[q, 1], slide_x, fma(tangent_y[q, 1], slide_y, fma(normal[q, 1], push, wy)))
    wz = fma(tangent_x[q, 2], slide_x, fma(tangent_y[q, 2], slide_y, fma(normal[q, 2], push, wz)))
    return wx, wy, wz
