"""
The original's contact: unbounded friction with force-dependent slip, solved in its two stages.

Force-dependent slip makes friction viscous: tangential velocity = -slip * force, so the impulse
-(h / slip) * velocity is linear in the unknowns and needs no iteration. But the original's solver
(ODE's dWorldStep) gives it only to contacts that press when there is no friction yet, because it
fixes the friction bounds from the normal impulses it has found by then. Hence two stages: normals
without friction; then those that press get their slip, and the normals are solved again.

With weights w = h / slip of the contacts that press, at (x, y, z) from the centre of mass, the six
equations of the second stage (the first: all w = 0) read

    (m + W) v_x            - W_y w_z            + W_z w_y = p_x - drag        W   = sum w
              (m + W) v_y  + W_x w_z - W_z w_x            = p_y - drag        W_i = sum w i
    -W_y v_x  + W_x v_y + (I_zz + W_rr) w_z + (I_xz - W_xz) w_x + (I_yz - W_yz) w_y = L_z - drag
               -W_z v_y + (I_xz - W_xz) w_z + (I_xx + W_zz) w_x +  I_xy w_y          = L_x + ...
     W_z v_x            + (I_yz - W_yz) w_z +  I_xy w_x         + (I_yy + W_zz) w_y  = L_y + ...
    m v_z                                                                            = p_z + ...

where the dots are the floor's normal impulses: they act on v_z, w_x, w_y alone. Eliminating v_x,
v_y and then w_z leaves a 2 x 2 matrix for (w_x, w_y), whose inverse, with 1 / m, answers to a
normal impulse at (x, y): (v_z, w_x, w_y) += G (1, y, -x). Projected Gauss-Seidel runs on these
three.
"""

from __future__ import annotations

from w2b_sim.engines.batched.algebra import get3, inlined
from w2b_sim.engines.batched.contacts import CONTACT_GAP_M
from w2b_sim.engines.batched.rigid import (
    about_centre,
    keep_impulses,
    place_contacts,
    set_solution,
    take_impulses,
)
from w2b_sim.engines.batched.simd import fma, splat, vmax, where

#: Of Gauss-Seidel: the same solution, and after 4 + 6 sweeps a third of the error of 1.0.
OVER_RELAXATION = 1.2


@inlined
def solve_viscous(layout, state, frame, composite, contacts, near, count, erp_per_h, h_per_slip,
                  first_sweeps, second_sweeps, solution):
    """Solve for the base's velocity of one step; it ends in `solution`."""
    inverse_mass, centre, p, angular, inertia = about_centre(composite)
    places = place_contacts(layout, frame, contacts, near, count, centre, erp_per_h,
                            CONTACT_GAP_M, 0.0)
    zero = splat(layout, 0.0)
    w, wx, wy, wz = zero, zero, zero, zero
    wrr, wxz, wyz, wzz = zero, zero, zero, zero
    px, py, lx, ly, lz = p[0], p[1], angular[0], angular[1], angular[2]
    if places > 0:
        take_impulses(layout, contacts, near, count, places, state.press_first, contacts.begin)
        _stage(contacts, places, first_sweeps, composite[0, 0], inverse_mass, inertia,
               (w, wx, wy, wz, wrr, wxz, wyz, wzz), (px, py, p[2], lx, ly, lz))
        keep_impulses(layout, contacts, near, count, places, state.press_first, contacts.begin)
    for q in range(places):
        weight = where(contacts.impulse[q] > 0.0, h_per_slip, zero)
        x, y, z = contacts.arm[q, 0], contacts.arm[q, 1], contacts.arm[q, 2]
        drive = get3(contacts.drive, q)
        ax, ay, az = weight * x, weight * y, weight * z
        w, wx, wy, wz = w + weight, wx + ax, wy + ay, wz + az
        wrr = fma(ax, x, fma(ay, y, wrr))
        wxz, wyz, wzz = fma(ax, z, wxz), fma(ay, z, wyz), fma(az, z, wzz)
        # The known share of the sliding velocity drags too.
        px, py = fma(-weight, drive[0], px), fma(-weight, drive[1], py)
        lx, ly = fma(az, drive[1], lx), fma(-az, drive[0], ly)
        lz = fma(ay, drive[0], fma(-ax, drive[1], lz))
    take_impulses(layout, contacts, near, count, places, state.press, contacts.begin)
    velocity, spin = _stage(contacts, places, second_sweeps, composite[0, 0], inverse_mass, inertia,
                            (w, wx, wy, wz, wrr, wxz, wyz, wzz), (px, py, p[2], lx, ly, lz))
    keep_impulses(layout, contacts, near, count, places, state.press, contacts.begin)
    set_solution(solution, centre, velocity, spin)


@inlined
def _stage(contacts, count, sweeps, mass, inverse_mass, inertia, slip, b):
    """
    Solve one stage; return v and w of the centre of mass.

    `slip` are the sums W, W_x, W_y, W_z, W_rr, W_xz, W_yz, W_zz; `b` the right side p_x, p_y, p_z,
    L_x, L_y, L_z. `contacts.begin` has the normal impulses to start from, N s, and receives those
    found.
    """
    w, wx, wy, wz, wrr, wxz, wyz, wzz = slip
    ixx, iyy, izz, ixy, ixz, iyz = inertia
    px, py, pz, lx, ly, lz = b
    inverse_a = 1.0 / (mass + w)
    # Eliminate v_x and v_y from the rows of w_z, w_x, w_y.
    tx, ty, tz = wx * inverse_a, wy * inverse_a, wz * inverse_a
    k = fma(-wx, tx, fma(-wy, ty, izz + wrr))
    cx = fma(wx, tz, ixz - wxz)
    cy = fma(wy, tz, iyz - wyz)
    share = fma(-wz, tz, wzz)
    lz = fma(ty, px, fma(-tx, py, lz))
    lx = fma(tz, py, lx)
    ly = fma(-tz, px, ly)
    # Eliminate w_z.
    inverse_k = 1.0 / k
    ex, ey = cx * inverse_k, cy * inverse_k
    sxx = fma(-cx, ex, ixx + share)
    syy = fma(-cy, ey, iyy + share)
    sxy = fma(-cx, ey, ixy)
    lx = fma(-ex, lz, lx)
    ly = fma(-ey, lz, ly)
    # Invert what is left of w_x and w_y.
    inverse_det = 1.0 / fma(sxx, syy, -(sxy * sxy))
    gxx, gyy, gxy = syy * inverse_det, sxx * inverse_det, -(sxy * inverse_det)
    vz = pz * inverse_mass
    spin_x = fma(gxx, lx, gxy * ly)
    spin_y = fma(gxy, lx, gyy * ly)
    vz, spin_x, spin_y = _push(contacts, count, sweeps, inverse_mass, gxx, gxy, gyy, vz, spin_x,
                               spin_y)
    spin_z = fma(-ex, spin_x, fma(-ey, spin_y, lz * inverse_k))
    vx = fma(ty, spin_z, fma(-tz, spin_y, px * inverse_a))
    vy = fma(-tx, spin_z, fma(tz, spin_x, py * inverse_a))
    return (vx, vy, vz), (spin_x, spin_y, spin_z)


@inlined
def _push(contacts, count, sweeps, inverse_mass, gxx, gxy, gyy, vz, wx, wy):
    """
    Find the normal impulses by projected Gauss-Seidel; return v_z, w_x, w_y with them.

    Each visit needs the change that the one before has made, and the latency of that chain bounds
    the engine. To keep it short the sweeps run on what is missing at each contact, `missing`, m/s:

    - `impulse` is in units of the velocity it gives its own contact, m/s; a change of it changes
      the body's velocity by `normal` times it, and `missing` of contact j by `coupling[q, j]`;
    - over-relaxation is in both: `missing` is what to change the impulse by;
    - what is missing at the next contact is worked out first, and at all others meanwhile.

    A place without contact in a lane is visited without any effect: how many the neighbours have
    changes no bit.
    """
    z, x_spin, y_spin = vz, wx, wy
    for q in range(count):
        x, y = contacts.arm[q, 0], contacts.arm[q, 1]
        gx = fma(gxx, y, -(gxy * x))
        gy = fma(gxy, y, -(gyy * x))
        own = fma(y, gx, fma(-x, gy, inverse_mass))
        inverse = 1.0 / own
        impulse = contacts.begin[q]
        contacts.normal[q, 0] = inverse_mass * inverse
        contacts.normal[q, 1] = gx * inverse
        contacts.normal[q, 2] = gy * inverse
        contacts.normal[q, 3] = inverse
        contacts.impulse[q] = impulse * own
        z = fma(inverse_mass, impulse, z)
        x_spin, y_spin = fma(gx, impulse, x_spin), fma(gy, impulse, y_spin)
    for q in range(count):
        ly, lx = contacts.arm[q, 1] * -OVER_RELAXATION, contacts.arm[q, 0] * OVER_RELAXATION
        contacts.missing[q] = fma(lx, y_spin, fma(
            ly, x_spin, OVER_RELAXATION * (contacts.target[q] - z)))
        for p in range(count):
            contacts.coupling[p * count + q] = fma(lx, contacts.normal[p, 2], fma(
                ly, contacts.normal[p, 1], -OVER_RELAXATION * contacts.normal[p, 0]))
    missing = vz
    if count > 0:
        missing = contacts.missing[0]
    for _ in range(sweeps):
        for q in range(count):
            following = q + 1 if q + 1 < count else 0
            change = vmax(missing, -contacts.impulse[q])
            missing = fma(contacts.coupling[q * count + following], change,
                          contacts.missing[following])
            contacts.impulse[q] = contacts.impulse[q] + change
            for p in range(count):
                contacts.missing[p] = fma(contacts.coupling[q * count + p], change,
                                          contacts.missing[p])
    for q in range(count):
        impulse = contacts.impulse[q]
        vz = fma(contacts.normal[q, 0], impulse, vz)
        wx = fma(contacts.normal[q, 1], impulse, wx)
        wy = fma(contacts.normal[q, 2], impulse, wy)
        contacts.begin[q] = impulse * contacts.normal[q, 3]
    return vz, wx, wy
