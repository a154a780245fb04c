"""
How a vector of free numbers becomes a leaky network whose weights share the body's symmetry.

Every block of the network is a matrix that must not change under the body's mirrors: a synapse
and its mirror images hold the same number, up to a sign. The entries of one such *orbit* are one
element of the genome; an entry whose image is minus itself is zero. Without mirrors every entry is
free, and the genome is the blocks ravelled.

The hidden neurons are `oscillating` ones and `per_limb` for each limb. Under a mirror a limb's
neurons go to the limb's image. The oscillating ones change their sign if the mirror moves every
limb to another (a walker's trot: mirrored legs half a cycle apart), else they stay.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from w2b_core.bodies.model import Body
from w2b_core.network.leaky import BLOCK, BLOCKS, LEAST_LEAK, LeakyNetwork
from w2b_core.network.symmetry import Mirror, SignedPermutation, limbs_of

Array = NDArray[np.float64]
#: Blocks that have a range of their own are the logistic of a free number.
LOGISTIC = ('hidden_leak', 'motor_leak')
#: Blocks that are given, not evolved.
FIXED = ('rest',)
#: What the network starts from, one oscillating neuron at this and the others at 0.
REST = 0.5
#: Until neurons are taken to be at rest: a second of control periods.
RESTING_STEPS = 20


@dataclass(frozen=True)
class Hidden:
    """Hidden neurons: `oscillating` for the whole body, `per_limb` for each of `limbs` limbs."""

    oscillating: int
    per_limb: int
    limbs: int

    @property
    def count(self) -> int:
        """Number of hidden neurons, H."""
        return self.oscillating + self.per_limb * self.limbs

    def of(self, limb: int, number: int) -> int:
        """Return the index of a limb's neuron."""
        return self.oscillating + limb * self.per_limb + number


@dataclass(frozen=True)
class Shared:
    """
    How one block is made of a genome.

    `index` (R, C) says which element of the block's part of the genome an entry holds, -1 for
    zero; `sign` (R, C) with which sign; the part begins at `first` and has `count` elements.
    """

    index: NDArray[np.int64]
    sign: Array
    first: int
    count: int


class Sharing:
    """
    The map from genomes to networks.

    Parameters
    ----------
    body
        What is moved.
    behaviours, senses
        Of the command vector and of the sensor neurons, in order.
    mirrors
        Of the body, see `symmetry.find_mirrors`; none for free weights.
    oscillating, per_limb
        Counts of hidden neurons.
    direct
        Whether the oscillating neurons have synapses straight onto the motor neurons.
    begins
        The behaviour at whose rest the limbs' neurons begin, so that its first frames are as its
        later ones; none for neurons that begin at 0.

    Raises
    ------
    NotSymmetricError
        If a behaviour or sense has no image under a mirror.
    ValueError
        If `begins` is no behaviour.

    """

    def __init__(self, body: Body, behaviours: Sequence[str], senses: Sequence[str],
                 mirrors: Sequence[Mirror], *, oscillating: int = 2, per_limb: int = 3,
                 direct: bool = False, begins: str | None = None) -> None:
        limbs = limbs_of(body)
        if begins is not None and begins not in behaviours:
            raise ValueError(f'begins: expected one of {", ".join(behaviours)}, got {begins!r}')
        self.begins = begins
        self.hidden = Hidden(oscillating, per_limb, len(limbs))
        self.behaviours, self.senses = tuple(behaviours), tuple(senses)
        self.sizes = {'H': self.hidden.count, 'K': len(behaviours), 'S': len(senses),
                      'M': len(body.joints)}
        axes = {'H': [mirrored_hidden(mirror, self.hidden) for mirror in mirrors],
                'K': [mirror.behaviours(behaviours) for mirror in mirrors],
                'S': [mirror.senses(senses, body) for mirror in mirrors],
                'M': [mirror.joints for mirror in mirrors]}
        self.blocks: dict[str, Shared] = {}
        first = 0
        for block in BLOCKS:
            if block.name in FIXED:
                continue
            rows = axes[block.shape[0]]
            if block.name in LOGISTIC:  # a leak has no sign
                rows = [SignedPermutation(one.place, (1.0,) * len(one.place)) for one in rows]
            single = [SignedPermutation((0,), (1.0,))] * len(mirrors)
            columns = axes[block.shape[1]] if len(block.shape) == 2 else single
            shape = (self.sizes[block.shape[0]],
                     self.sizes[block.shape[1]] if len(block.shape) == 2 else 1)
            barred = np.zeros(shape, dtype=np.bool_)
            if block.name == 'motor' and not direct:
                barred[:, :oscillating] = True
            index, sign, count = orbits(rows, columns, shape, barred)
            self.blocks[block.name] = Shared(index, sign, first, count)
            first += count
        #: Number of elements of a genome.
        self.size = first

    def network(self, genomes: ArrayLike) -> LeakyNetwork:
        """Return the network of a genome (G,), or the networks of genomes (C, G)."""
        x = np.asarray(genomes, dtype=np.float64)
        if x.shape[-1:] != (self.size,):
            raise ValueError(f'genome: expected {self.size} numbers, got {x.shape}')
        arrays = {}
        for name, shared in self.blocks.items():
            value = np.zeros((*x.shape[:-1], *shared.index.shape))
            if shared.count:
                value = np.where(shared.index >= 0,
                                 x[..., shared.first + np.maximum(shared.index, 0)] * shared.sign,
                                 0.0)
            if len(BLOCK[name].shape) == 1:
                value = value[..., 0]
            if name in LOGISTIC:
                value = LEAST_LEAK + (1 - LEAST_LEAK) / (1 + np.exp(-value))
            arrays[name] = np.clip(value, BLOCK[name].low, BLOCK[name].high)
        rest = np.zeros((*x.shape[:-1], self.hidden.count))
        rest[..., 0] = REST
        if self.begins is not None:
            limbs = np.s_[self.hidden.oscillating:]
            rest[..., limbs] = _at_rest(
                arrays['hidden'][..., limbs, limbs], arrays['hidden_leak'][..., limbs],
                arrays['command'][..., limbs, self.behaviours.index(self.begins)])
        return LeakyNetwork(rest=rest, **arrays)

    def part(self, genome: Array, block: str) -> Array:
        """Return a view of a block's free numbers (..., count) in a genome (..., G)."""
        shared = self.blocks[block]
        return genome[..., shared.first:shared.first + shared.count]

    def put(self, genome: Array, block: str, row: int, column: int, value: ArrayLike) -> None:
        """
        Set one entry of a block, and with it its mirror images, in a genome (..., G).

        A leak is set before its logistic. ValueError if the symmetry forces the entry to zero.
        """
        shared = self.blocks[block]
        index = int(shared.index[row, column])
        if index < 0:
            raise ValueError(f'{block}[{row}, {column}]: the symmetry of the body forces it to 0')
        genome[..., shared.first + index] = np.asarray(value) * shared.sign[row, column]


def _at_rest(weights: Array, leak: Array, drive: Array) -> Array:
    """Return where neurons (..., N) are after `RESTING_STEPS` of a constant drive (..., N)."""
    state = np.zeros(drive.shape)
    for _ in range(RESTING_STEPS):
        asked = np.tanh(np.matmul(weights, state[..., None])[..., 0] + drive)
        state = state + leak * (asked - state)
    return state


def orbits(rows: Sequence[SignedPermutation], columns: Sequence[SignedPermutation],
           shape: tuple[int, int], barred: NDArray[np.bool_] | None = None
           ) -> tuple[NDArray[np.int64], Array, int]:
    """
    Return which entries of a matrix (R, C) are the same number.

    Parameters
    ----------
    rows, columns
        The generators of the symmetry: how each permutes rows and columns.
    shape
        Of the matrix.
    barred
        Entries that are zero, with their images.

    Returns
    -------
    index (R, C), sign (R, C), count
        Entry = sign * number[index]; -1 for entries that are zero.

    """
    index, sign = np.full(shape, -1), np.zeros(shape)
    seen = np.zeros(shape, dtype=np.bool_)
    count = 0
    for start in np.ndindex(*shape):
        if seen[start]:
            continue
        orbit, free = _orbit(start, rows, columns)
        if barred is not None and any(barred[entry] for entry in orbit):
            free = False
        for entry, factor in orbit.items():
            seen[entry] = True
            if free:
                index[entry], sign[entry] = count, factor
        count += free
    return index, sign, count


def _orbit(start: tuple[int, ...], rows: Sequence[SignedPermutation],
           columns: Sequence[SignedPermutation]) -> tuple[dict[tuple[int, ...], float], bool]:
    """Return the images of an entry with their signs, and whether no image contradicts another."""
    orbit = {start: 1.0}
    waiting, free = [start], True
    while waiting:
        row, column = entry = waiting.pop()
        for by_row, by_column in zip(rows, columns, strict=True):
            image = (by_row.place[row], by_column.place[column])
            factor = orbit[entry] * by_row.sign[row] * by_column.sign[column]
            if image not in orbit:
                orbit[image] = factor
                waiting.append(image)
            elif orbit[image] != factor:
                free = False
    return orbit, free


def mirrored_hidden(mirror: Mirror, hidden: Hidden) -> SignedPermutation:
    """Return the mirror of the hidden neurons."""
    moves_all = all(image != limb for limb, image in enumerate(mirror.limbs))
    sign = -1.0 if moves_all else 1.0
    place = [*range(hidden.oscillating),
             *(hidden.of(image, number) for image in mirror.limbs
               for number in range(hidden.per_limb))]
    return SignedPermutation(tuple(place), (sign,) * hidden.oscillating
                             + (1.0,) * (hidden.per_limb * hidden.limbs))
