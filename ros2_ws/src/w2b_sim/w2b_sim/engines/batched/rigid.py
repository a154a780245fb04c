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
from w2b_sim.engines.batched.simd import any_lane, both, fma, splat, where

#: Scratch of the solves, one entry a place: the n-th contact of each lane is in place n - 1.
Contacts = structure('Contacts', {
    'place': ('contacts',),        # of a sphere in the list, in each lane; -1 where it is far
    'arm': ('contacts', 3),        # from the centre of mass to the point that touches, m
    'drive': ('contacts', 3),      # known share of that point's velocity, m/s
    'target': ('contacts',),       # lowest velocity along z that the floor allows, m/s
    'impulse': ('contacts',),
    'slide_x': ('contacts',),
    'slide_y': ('contacts',),
    'normal': ('contacts', 4),     # how the body answers to a normal impulse
    'tangent_x': ('contacts', 4),
    'tangent_y': ('contacts', 4),
    'slide_coupling': ('contacts', 2),  # sliding velocity that a unit normal impulse gives
    'begin': ('contacts',),        # of the viscous solve, as are the next
    'missing': ('contacts',),
    'coupling': ('contact_pairs',),
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
def place_contacts(layout, frame, contacts, near, count, centre, erp_per_h, reach, per_gap):
    """
    Give each lane's contacts the first places, set their arms, drives and targets; return how many.

    Below the floor: leave it by a share of the depth. Above it, within `reach`: approach no faster
    than the gap times `per_gap`. Robots in neighbouring lanes stand on different spheres: of the
    spheres in the list a lane has about half, and the solves visit as many places as the lane with
    the most contacts needs. A lane's own order stays, so its neighbours change no bit.
    """
    filled = splat(layout, 0.0)
    places = 0
    for q in range(count):
        c = near[q]
        depth = frame.depth[c]
        here = depth >= -reach
        if any_lane(both(here, filled >= places)):
            _clear(layout, contacts, places)
            places += 1
        place = where(here, filled, -1.0)
        contacts.place[q] = place
        drive = get3(frame.contact_drive, c)
        target = where(depth >= 0.0, depth * erp_per_h, depth * per_gap) - drive[2]
        arm = sub(get3(frame.contact_arm, c), centre)
        for n in range(places):
            mine = place == n
            for i in range(3):
                contacts.arm[n, i] = where(mine, arm[i], contacts.arm[n, i])
                contacts.drive[n, i] = where(mine, drive[i], contacts.drive[n, i])
            contacts.target[n] = where(mine, target, contacts.target[n])
        filled = where(here, filled + 1.0, filled)
    return places


@inlined
def _clear(layout, contacts, n):
    """Make a place one without contact, in all lanes."""
    for i in range(3):
        contacts.arm[n, i] = splat(layout, 0.0)
        contacts.drive[n, i] = splat(layout, 0.0)
    contacts.target[n] = splat(layout, NO_FLOOR)


@inlined
def take_impulses(layout, contacts, near, count, places, kept, impulses):
    """Copy the impulses of the spheres in the list to their places; 0 where there is no contact."""
    for n in range(places):
        impulses[n] = splat(layout, 0.0)
    for q in range(count):
        for n in range(min(q + 1, places)):
            impulses[n] = where(contacts.place[q] == n, kept[near[q]], impulses[n])


@inlined
def keep_impulses(layout, contacts, near, count, places, kept, impulses):
    """Copy impulses back to the spheres, for the next step's solve to start from."""
    for q in range(count):
        found = splat(layout, 0.0)
        for n in range(min(q + 1, places)):
            found = where(contacts.place[q] == n, impulses[n], found)
        kept[near[q]] = found


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

