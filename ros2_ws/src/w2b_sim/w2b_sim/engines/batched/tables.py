"""A body and a world as the arrays that the compiled kernel reads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from w2b_core.bodies.inertia import link_inertia
from w2b_core.bodies.model import Body, Joint, Link
from w2b_core.bodies.points import spheres
from w2b_core.senses import AXES
from w2b_sim.engines.batched.supported import (
    LEAKY_SENSES,
    SENSOR_KINDS,
    refuse_what_is_not_modelled,
)
from w2b_sim.worlds import World

UNKNOWNS_OF_BASE = 6
#: A servo this many times as strong as the greatest torque it can be asked for never saturates.
TORQUE_MARGIN = 3.0


class Tables(NamedTuple):
    """
    Arrays of one body. Link 0 is the base, joint j moves link j + 1, parents come first.

    Lengths in m, masses in kg; vectors in the axes of their link, or of the parent link for
    `axis` and `anchor_parent` (from the parent's centre of mass to the hinge). `anchor_child`
    points from the link's centre of mass to its hinge; `rest` (L, 3) from the base's centre to
    the link's in the rest pose. A link's inertia tensor is `inertia` * 1 + sum over two axes n
    of `inertia_along` * n n^T, n in the rows 2 k and 2 k + 1 of `inertia_axes`.

    Spheres `contact_first[k]` to `contact_first[k + 1]` - 1 belong to link k, no point of which is
    farther than `extent[k]` from its centre of mass; `contact_offset` points from there to a
    sphere's centre. Vectors that are rotated have a fourth entry, see `algebra.rotate_row`.
    `dynamic` (J,) numbers the joints that are unknowns of the solve, outer ones
    first, -1 for others; `dynamic_link` lists the links they move. `chain_of` (L, chain) lists, for
    each link, the `chain_length` dynamic joints that move it, outer ones first (see `tree`).
    `leaf` (L,) is an outermost link that each link carries, itself if it carries none; slots
    `slot_first[leaf]`... have room for the contacts of all links with that leaf, `slot_leaf` (C,)
    (see `slots`).
    """

    parent: NDArray[np.int64]
    axis: NDArray[Any]
    anchor_parent: NDArray[Any]
    anchor_child: NDArray[Any]
    rest: NDArray[Any]
    mass: NDArray[Any]
    inertia: NDArray[Any]
    inertia_along: NDArray[Any]
    inertia_axes: NDArray[Any]
    lower: NDArray[Any]
    upper: NDArray[Any]
    gain: NDArray[Any]
    speed_up: NDArray[Any]
    speed_down: NDArray[Any]
    torque: NDArray[Any]
    time_constant: NDArray[Any]
    dynamic: NDArray[np.int64]
    dynamic_link: NDArray[np.int64]
    chain_of: NDArray[np.int64]
    chain_length: NDArray[np.int64]
    leaf: NDArray[np.int64]
    slot_first: NDArray[np.int64]
    slot_leaf: NDArray[np.int64]
    extent: NDArray[Any]
    contact_first: NDArray[np.int64]
    contact_link: NDArray[np.int64]
    contact_offset: NDArray[Any]
    contact_radius: NDArray[Any]
    contact_touch: NDArray[np.int64]
    sensor_kind: NDArray[np.int64]
    sensor_source: NDArray[np.int64]


@dataclass(frozen=True)
class CompiledBody:
    """A body's tables in double precision and what they leave out."""

    tables: Tables
    touch_links: tuple[str, ...]
    height_m: float
    hidden: int

    def cast(self, dtype: Any) -> Tables:
        """Return the tables with numbers of the precision `dtype`."""
        return Tables(*(np.ascontiguousarray(
            array, dtype if array.dtype == np.float64 else np.int64) for array in self.tables))


def compile_body(body: Body, world: World, joints: str = 'auto', *, leaky: bool = False
                 ) -> CompiledBody:
    """
    Return the kernel's arrays of a body.

    Parameters
    ----------
    body, world
        What moves, and where.
    joints
        `kinematic`: every joint follows its servo's velocity exactly. `dynamic`: every joint's
        rate is an unknown of the solve, driven by at most the servo's torque. `auto`: dynamic
        where the servo may saturate (`servo_saturates`).
    leaky
        Whether leaky networks are to run, which know more senses.

    Raises
    ------
    UnsupportedBodyError
        If the body is not a tree of boxes, capsules and spheres on hinges with `Servo`s and
        sensors of known kinds: the message names the part and the reason.

    """
    if joints not in ('auto', 'kinematic', 'dynamic'):
        raise ValueError(f'joints: expected auto, kinematic or dynamic, got {joints!r}')
    refuse_what_is_not_modelled(body, LEAKY_SENSES if leaky else SENSOR_KINDS)
    links = [body.links[0], *(body.link(joint.child) for joint in body.joints)]
    number = {link.name: k for k, link in enumerate(links)}
    centres = np.array([link.centre_m for link in links], dtype=np.float64)
    parent = np.array([-1] + [number[joint.parent] for joint in body.joints])
    origins = np.zeros((len(links), 3))
    for k, joint in enumerate(body.joints, 1):
        origins[k] = origins[parent[k]] + np.asarray(joint.origin_m)
    rest = origins + centres
    anchor_parent = np.zeros((len(links), 3))
    anchor_parent[1:] = origins[1:] - rest[parent[1:]]
    axis = np.zeros((len(links), 3))
    axis[1:] = [_unit(joint.axis) for joint in body.joints]
    touch_links = tuple(dict.fromkeys(
        sensor.removeprefix('touch:') for sensor in body.sensors if sensor.startswith('touch:')))
    moves = _moves(parent)
    contact = _contacts(links, touch_links)
    dynamic = np.array([joint.lower_rad < joint.upper_rad and (
        joints == 'dynamic' or (joints == 'auto' and servo_saturates(
            joint, links, rest, origins, moves[k], world)))
        for k, joint in enumerate(body.joints)], dtype=bool)
    parts: list[Any] = [
        parent, _with_column(axis), _with_column(anchor_parent), _with_column(-centres),
        rest - rest[0],
        np.array([link.mass_kg for link in links]),
        *_inertias(links),
        *(np.array(values, dtype=np.float64) for values in zip(*(
            (joint.lower_rad, joint.upper_rad, joint.servo.gain_per_s,
             joint.servo.max_speed_up_rad_s, joint.servo.max_speed_down_rad_s,
             joint.servo.max_torque_nm, joint.time_constant) for joint in body.joints),
            strict=True)),
        *_chains(parent, dynamic),
        *_slots(parent, contact[2]),
        *contact,
        *_sensors(body, touch_links)]
    return CompiledBody(Tables(*parts), touch_links, body.height_m + float(centres[0, 2]),
                        body.hidden_neurons)


def servo_saturates(joint: Joint, links: Sequence[Link], rest: NDArray[np.float64],
                    origins: NDArray[np.float64], moved: NDArray[np.int64], world: World) -> bool:
    """
    Return whether a servo may meet its torque limit, on the safe side.

    The greatest torque it is asked for is taken as the sum of two: to reverse the lighter of the
    two halves of the body that it joins from its full speed (at least 1 rad/s) within one physics
    step, and to hold the weight of the whole body by that half's longest lever. Servos below
    `TORQUE_MARGIN` times that may saturate: contacts couple the joints and add to it.
    """
    k = [link.name for link in links].index(joint.child)
    masses = np.array([link.mass_kg for link in links])
    lever = np.linalg.norm(rest - origins[k], axis=1)
    inertia = masses * lever**2 + [np.trace(link_inertia(link)) / 2 for link in links]
    child = inertia[moved.astype(bool)].sum()
    others = inertia[~moved.astype(bool)].sum()
    reduced = child * others / (child + others)
    speed = max(1.0, joint.servo.max_speed_up_rad_s)
    reach = min(lever[moved.astype(bool)].max(), lever[~moved.astype(bool)].max())
    asked = (2 * speed * reduced / world.physics_step_s
             + masses.sum() * abs(world.gravity_m_s2) * reach)
    return bool(joint.servo.max_torque_nm < TORQUE_MARGIN * asked)


def _unit(vector: Sequence[float]) -> NDArray[np.float64]:
    unit: NDArray[np.float64] = np.asarray(vector, dtype=np.float64)
    return unit / np.linalg.norm(unit)


def _moves(parent: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return (J, L): 1 where joint j moves link k."""
    moves = np.zeros((len(parent) - 1, len(parent)), dtype=np.int64)
    for k in range(1, len(parent)):
        moves[:, k] = moves[:, parent[k]]
        moves[k - 1, k] = 1
    return moves


def _chains(parent: NDArray[np.int64], dynamic: NDArray[np.bool_]
            ) -> tuple[NDArray[np.int64], ...]:
    """Return numbers of the dynamic joints, their links, each link's joints and their count."""
    links = 1 + np.flatnonzero(dynamic)[::-1]
    number = np.full(len(dynamic), -1)
    number[links - 1] = np.arange(len(links))
    chains: list[list[int]] = [[]]
    for k in range(1, len(parent)):
        own = [int(number[k - 1])] if dynamic[k - 1] else []
        chains.append(own + chains[parent[k]])
    longest = max(map(len, chains))
    padded = np.full((len(parent), max(1, longest)), len(links) + UNKNOWNS_OF_BASE)
    for k, chain in enumerate(chains):
        padded[k, :len(chain)] = chain
    return number, links, padded, np.array([len(chain) for chain in chains])


def _slots(parent: NDArray[np.int64], contact_link: NDArray[np.int64]
           ) -> tuple[NDArray[np.int64], ...]:
    """Return each link's leaf, each leaf's first slot (for any link), and the slots' leaves."""
    leaf = np.arange(len(parent))
    for k in range(len(parent) - 1, 0, -1):
        leaf[parent[k]] = leaf[k]
    slot_leaf = np.sort(leaf[contact_link])
    return leaf, np.searchsorted(slot_leaf, np.arange(len(parent))), slot_leaf


def _inertias(links: Sequence[Link]) -> tuple[NDArray[np.float64], ...]:
    """Write each inertia tensor as a * 1 + b n n^T + c m m^T, c = 0 for the usual shapes."""
    common, along, axes = [], [], []
    for link in links:
        values, vectors = np.linalg.eigh(link_inertia(link))
        # The middle value is the common one; where two agree (capsules) one axis remains.
        common.append(values[1])
        along.append(values[[0, 2]] - values[1])
        axes.append(vectors[:, [0, 2]].T)
        if abs(along[-1][0]) < 1e-12 * values[1]:
            along[-1], axes[-1] = along[-1][::-1], axes[-1][::-1]
        along[-1] = np.where(np.abs(along[-1]) < 1e-12 * values[1], 0.0, along[-1])
    return np.array(common), np.array(along), _with_column(np.array(axes).reshape(-1, 3))


def _with_column(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (N, 4): the vectors and the number of their only element that is not zero, or -1."""
    tiny = 1e-12 * np.abs(vectors).max(axis=1, initial=1.0, keepdims=True)
    vectors = np.where(np.abs(vectors) < tiny, 0.0, vectors)
    single = np.count_nonzero(vectors, axis=1) <= 1
    column = np.where(single, np.abs(vectors).argmax(axis=1), -1.0)
    return np.column_stack([vectors, column])


def _contacts(links: Sequence[Link], touch_links: tuple[str, ...]
              ) -> tuple[NDArray[Any], ...]:
    """
    Return the spheres that can meet the floor, link by link.

    Extent of each link, number of its first sphere, and the spheres' links, offsets, radii and
    touch sensors.
    """
    found: list[tuple[int, NDArray[np.float64], float, int]] = []
    for k, link in enumerate(links):
        touch = touch_links.index(link.name) if link.name in touch_links else -1
        found += [(k, offset, radius, touch) for offset, radius in spheres(link)]
    link_numbers, offsets, radii, touches = zip(*found, strict=True)
    numbers, radius = np.array(link_numbers), np.array(radii, dtype=np.float64)
    reach = np.linalg.norm(offsets, axis=1) + radius
    extent = np.array([reach[numbers == k].max() for k in range(len(links))])
    return (extent, np.searchsorted(numbers, np.arange(len(links) + 1)), numbers,
            _with_column(np.array(offsets)), radius, np.array(touches))


def _sensors(body: Body, touch_links: tuple[str, ...]
             ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    joints = [joint.name for joint in body.joints]
    kinds, sources = [], []
    for sensor in body.sensors:
        kind, _colon, source = sensor.partition(':')
        kinds.append(LEAKY_SENSES[kind])
        among = {'touch': touch_links, 'gravity': AXES, 'position': joints, 'motor': joints}
        sources.append(list(among[kind]).index(source) if source else 0)
    return np.array(kinds, dtype=np.int64), np.array(sources, dtype=np.int64)
