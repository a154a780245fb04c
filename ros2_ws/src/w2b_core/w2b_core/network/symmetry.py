"""
The mirror symmetry of a body, found from its geometry.

A mirror (y -> -y: `left_right`, or x -> -x: `fore_aft`) is a symmetry of a body if it maps every
link onto a link of the same extents and every joint onto a joint of the same servo and limits, in
the rest pose. A joint's rotation is a pseudovector: with a mirrored axis of the opposite direction
the mirrored angle has the opposite sign. The plane of `left_right` lies midway between the hips,
that of `fore_aft` at the base's centre of mass, which decides how a robot leans.

Places and extents must agree to a hundredth of the body length, as drawings do, the base's to a
tenth, masses within what training randomises: a battery that sits beside the middle changes the
weights by little, and a symmetric network walks it as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from w2b_core.behaviours import course_of
from w2b_core.bodies.model import Body, Joint, Link
from w2b_core.bodies.points import spheres
from w2b_core.senses import AXES, split

#: Factors of x, y and z.
MIRRORS = {'left_right': (1.0, -1.0, 1.0), 'fore_aft': (-1.0, 1.0, 1.0)}
#: Places and extents that differ by less of the body length are the same.
TOLERANCE = 0.01
#: The base's own: it touches nothing while the robot walks.
BASE_TOLERANCE = 0.1
#: Axes that are parallel to so much, as 1 - cosine: about half a degree.
AXIS_TOLERANCE = 5e-5
#: A centre of mass may lie off its mirrored place by so much: a battery is where it fits.
CENTRE_TOLERANCE_M = 0.02
#: Masses of two links that mirror each other may differ by this share of the heavier.
MASS_TOLERANCE = 0.2


class NotSymmetricError(ValueError):
    """A mirror is no symmetry of a body; the message says which part has no image."""


@dataclass(frozen=True)
class SignedPermutation:
    """Element i goes to `place[i]`, with the sign `sign[i]`."""

    place: tuple[int, ...]
    sign: tuple[float, ...]

    def apply(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the image (..., N) of values (..., N)."""
        image = np.empty_like(values)
        image[..., list(self.place)] = values * np.array(self.sign)
        return image


@dataclass(frozen=True)
class Mirror:
    """
    A mirror symmetry of a body.

    Attributes
    ----------
    name
        One of `MIRRORS`.
    links
        Link -> its image.
    joints
        Of the joints, in motor order, with the sign of the angle.
    limbs
        Image of each limb, see `limbs_of`.

    """

    name: str
    links: dict[str, str]
    joints: SignedPermutation
    limbs: tuple[int, ...]

    def senses(self, senses: Sequence[str], body: Body) -> SignedPermutation:
        """Return the mirror of a network's senses (NotSymmetricError if one has no image)."""
        images = [self._sense(sense, body) for sense in senses]
        return _positions('sense', senses, images, self.name)

    def behaviours(self, behaviours: Sequence[str]) -> SignedPermutation:
        """
        Return the mirror of behaviours: left for right, or forward for backward.

        A behaviour that goes nowhere is its own image (NotSymmetricError if one has none).
        """
        x, y, _z = MIRRORS[self.name]
        courses = {behaviour: course_of(behaviour) for behaviour in behaviours}
        images = []
        for behaviour, course in courses.items():
            wanted = (course.along * x, course.turn * x * y)
            alike = [other for other, found in courses.items() if found == wanted]
            if behaviour in alike or not any(wanted):
                alike = [behaviour]
            if not alike:
                raise NotSymmetricError(
                    f'{self.name}: expected a behaviour that mirrors {behaviour!r} among '
                    f'{", ".join(behaviours)}, found none; add it or train without the mirror')
            images.append((alike[0], 1.0))
        return _positions('behaviour', behaviours, images, self.name)

    def _sense(self, sense: str, body: Body) -> tuple[str, float]:
        kind, source = split(sense)
        x, y, z = MIRRORS[self.name]
        match kind:
            case 'touch':
                return f'touch:{self.links[source]}', 1.0
            case 'position' | 'motor':
                names = [joint.name for joint in body.joints]
                index = names.index(source)
                return f'{kind}:{names[self.joints.place[index]]}', self.joints.sign[index]
            case 'gravity':
                return sense, (x, y, z)[AXES.index(source)]
            case 'steer':
                return sense, x * y * x  # the direction along x changes its sign with x
        return sense, x * y


def limbs_of(body: Body) -> tuple[tuple[int, ...], ...]:
    """Return the body's limbs: the joints of each branch of the base, in motor order."""
    branch = {body.links[0].name: -1}
    limbs: list[list[int]] = []
    for number, joint in enumerate(body.joints):
        limb = branch[joint.parent]
        if limb < 0:
            limb = len(limbs)
            limbs.append([])
        limbs[limb].append(number)
        branch[joint.child] = limb
    return tuple(tuple(limb) for limb in limbs)


def find_mirrors(body: Body) -> tuple[Mirror, ...]:
    """Return the mirror symmetries that a body has, none or more of `MIRRORS`."""
    found = []
    for name in MIRRORS:
        try:
            found.append(find_mirror(body, name))
        except NotSymmetricError:
            continue
    return tuple(found)


def find_mirror(body: Body, name: str) -> Mirror:
    """
    Return a mirror symmetry of a body.

    Raises
    ------
    NotSymmetricError
        If a link or joint has no image.
    ValueError
        If there is no mirror of this name.

    """
    if name not in MIRRORS:
        raise ValueError(f'mirror: expected one of {", ".join(MIRRORS)}, got {name!r}')
    factors = np.array(MIRRORS[name])
    origins = _origins(body, name)
    base = body.links[0]
    links = {base.name: base.name}
    _expect_same(body, name, base, base, factors, origins, BASE_TOLERANCE)
    place, sign = [], []
    names = [joint.name for joint in body.joints]
    for joint in body.joints:
        image, same = _image(body, name, joint, links, factors, origins)
        links[joint.child] = image.child
        place.append(names.index(image.name))
        sign.append(same)
    limbs = limbs_of(body)
    owner = {joint: number for number, limb in enumerate(limbs) for joint in limb}
    return Mirror(name, links, SignedPermutation(tuple(place), tuple(sign)),
                  tuple(owner[place[limb[0]]] for limb in limbs))


def _origins(body: Body, name: str) -> dict[str, NDArray[np.float64]]:
    """Return where each link's frame is in the rest pose, from the plane of a mirror."""
    base = body.links[0].name
    hips = [joint.origin_m for joint in body.joints if joint.parent == base]
    origins = {base: np.zeros(3)}
    if name == 'left_right' and hips:
        origins[base] = -np.mean(hips, axis=0) * (0.0, 1.0, 0.0)
    for joint in body.joints:
        origins[joint.child] = origins[joint.parent] + np.asarray(joint.origin_m)
    return origins


def _image(body: Body, name: str, joint: Joint, links: dict[str, str],
           factors: NDArray[np.float64], origins: dict[str, NDArray[np.float64]]
           ) -> tuple[Joint, float]:
    """Return the joint that mirrors `joint` and the sign of its angle."""
    reasons = []
    for other in body.joints:
        if other.parent != links[joint.parent] or np.abs(
                origins[other.child] - factors * origins[joint.child]).max() > (
                    TOLERANCE * body.length_m):
            continue
        # A mirror turns a pseudovector into minus its mirror image.
        axis = -factors * np.asarray(joint.axis) / np.linalg.norm(joint.axis)
        along = float(axis @ np.asarray(other.axis) / np.linalg.norm(other.axis))
        if abs(abs(along) - 1) > AXIS_TOLERANCE:
            reasons.append(f'the axis of {other.name} is another')
            continue
        same = float(np.sign(along))
        reason = _servo_differs(joint, other, same)
        if reason is None:
            _expect_same(body, name, body.link(joint.child), body.link(other.child), factors,
                         origins)
            return other, same
        reasons.append(reason)
    raise NotSymmetricError(f'{body.name} has no mirror {name}: joint {joint.name} has no image'
                            + (f' ({"; ".join(reasons)})' if reasons else ''))


def _servo_differs(joint: Joint, other: Joint, sign: float) -> str | None:
    lower, upper = ((joint.lower_rad, joint.upper_rad) if sign > 0
                    else (-joint.upper_rad, -joint.lower_rad))
    if not np.allclose((lower, upper), (other.lower_rad, other.upper_rad), atol=1e-6):
        return f'{other.name} has other limits'
    up, down = joint.servo.max_speed_up_rad_s, joint.servo.max_speed_down_rad_s
    # The simulated hobby servos of the paper are slower in one direction than in the other.
    speeds = (up, down) if sign > 0 else (down, up)
    mirrored = (joint.servo.gain_per_s, joint.servo.max_torque_nm, *speeds)
    theirs = (other.servo.gain_per_s, other.servo.max_torque_nm, other.servo.max_speed_up_rad_s,
              other.servo.max_speed_down_rad_s)
    return None if mirrored == theirs else f'{other.name} has another servo'


def _expect_same(body: Body, name: str, link: Link, other: Link, factors: NDArray[np.float64],
                 origins: dict[str, NDArray[np.float64]], tolerance: float = TOLERANCE) -> None:
    """Raise NotSymmetricError unless `other` has the mirrored extents and about the mass."""
    centres = [origins[of.name] + np.asarray(of.centre_m) for of in (link, other)]
    mirrored = factors * _extents(link, centres[0])
    differs = np.abs(np.sort(mirrored, axis=0) - _extents(other, centres[1])).max()
    if (np.abs(centres[1] - factors * centres[0]).max() > CENTRE_TOLERANCE_M
            or differs > tolerance * body.length_m):
        raise NotSymmetricError(f'{body.name} has no mirror {name}: expected link {other.name} '
                                f'to be the image of {link.name}, its shape or place differs')
    heavier = max(link.mass_kg, other.mass_kg)
    if abs(link.mass_kg - other.mass_kg) > MASS_TOLERANCE * heavier:
        raise NotSymmetricError(
            f'{body.name} has no mirror {name}: links {link.name} and {other.name} weigh '
            f'{link.mass_kg} and {other.mass_kg} kg, more than {MASS_TOLERANCE:.0%} apart')


def _extents(link: Link, centre: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the lowest and highest coordinates (2, 3) of a link whose centre of mass is there."""
    points = spheres(link)
    return np.array([np.min([place - radius for place, radius in points], axis=0),
                     np.max([place + radius for place, radius in points], axis=0)]) + centre


def _positions(what: str, names: Sequence[str], images: Sequence[tuple[str, float]],
               mirror: str) -> SignedPermutation:
    for name, (image, _sign) in zip(names, images, strict=True):
        if image not in names:
            raise NotSymmetricError(f'{mirror}: {what} {name!r} mirrors to {image!r}, '
                                    f'which is not among {", ".join(names)}')
    return SignedPermutation(tuple(list(names).index(image) for image, _sign in images),
                             tuple(sign for _image, sign in images))
