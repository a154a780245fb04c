"""
The momentum balance of a body whose joints are all kinematic, about its centre of mass.

The servos move the links whatever it takes, so the body is rigid but for a motion that is known
(`drive`): only the velocity (v, w) of its centre of mass remains to be found. There A falls apart,
p = m v and L = I w, which makes the solves below short.
"""

from __future__ import annotations

from w2b_sim.engines.batched.algebra import add_scaled, cross, get3, inlined, sub
from w2b_sim.engines.batched.contacts import V_X, V_Y, V_Z, W_X, W_Y, W_Z
from w2b_sim.engines.batched.memory import structure
from w2b_sim.engines.batched.simd import fma, where

#: Scratch of the solves, one entry a contact in the list; see the solves for units.
Contacts = structure('Contacts', {
    'arm': ('contacts', 3),        # from the centre of mass to the point that touches, m
    'target': ('contacts',),       # lowest velocity along z that the floor allows, m/s
    'impulse': ('contacts',),
    'begin': ('contacts',),        # of the viscous solve
    'missing': ('contacts',),
    'coupling': ('contact_pairs',),
    'normal': ('contacts', 4),     # how the body answers to a normal impulse
    'tangent_x': ('contacts', 4),
    'tangent_y': ('contacts', 4),
})

#: Stands for a floor far below, in the lanes that have no contact.
NO_FLOOR = -1e30


@inlined
def about_centre(composite):
    """
    Return (1 / m, centre, p, L, I) about the centre of mass; I as xx, yy, zz, xy, xz, yz.

    With s the first moment about the base, c = s / m, L_c = L - c x p, and Steiner's theorem for I.
    """
    m = composite[0, 0]
    inverse_mass = 1.0 / m
    s = (composite[0, 1], composite[0, 2], composite[0, 3])
    x, y, z = s[0] * inverse_mass, s[1] * inverse_mass, s[2] * inverse_mass
    p = (composite[0, 10], composite[0, 11], composite[0, 12])
    angular = sub((composite[0, 13], composite[0, 14], composite[0, 15]), cross((x, y, z), p))
    sx, sy, sz = x * s[0], y * s[1], z * s[2]
    inertia = (composite[0, 4] - (sy + sz), composite[0, 5] - (sx + sz),
               composite[0, 6] - (sx + sy), fma(x, s[1], composite[0, 7]),
               fma(x, s[2], composite[0, 8]), fma(y, s[2], composite[0, 9]))
    return inverse_mass, (x, y, z), p, angular, inertia


@inlined
def set_contacts(layout, frame, contacts, near, count, centre, erp_per_h, reach, per_gap):
    """
    Set arms and targets of the contacts.

    Below the floor: leave it by a share of the depth. Above it, within `reach`: approach no faster
    than the gap times `per_gap`.
    """
    for q in range(count):
        c = near[q]
        depth = frame.depth[c]
        leave = where(depth >= 0.0, depth * erp_per_h, depth * per_gap)
        contacts.target[q] = where(depth >= -reach, leave - frame.contact_drive[c, 2], NO_FLOOR)
        for i in range(3):
            contacts.arm[q, i] = frame.contact_arm[c, i] - centre[i]


@inlined
def set_solution(solution, centre, v, w):
    """Write the base's velocity, which the centre of mass's gives, in the order of `tree`."""
    v = add_scaled(v, cross(w, centre), -1.0)
    solution[V_X] = v[0]
    solution[V_Y] = v[1]
    solution[V_Z] = v[2]
    solution[W_X] = w[0]
    solution[W_Y] = w[1]
    solution[W_Z] = w[2]


@inlined
def drive_of(frame, c):
    """Return the known share of contact c's velocity."""
    return get3(frame.contact_drive, c)
