"""The first genomes: an oscillator, entries of the recipe, and random numbers elsewhere."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from training.legs.drives import Limb, drives
from training.legs.parts import Entry
from training.legs.recipe import Recipe
from w2b_core import bodies
from w2b_core.network.leaky import step
from w2b_core.network.sharing import LOGISTIC, Sharing
from w2b_core.network.symmetry import Mirror, SignedPermutation, limbs_of

Array = NDArray[np.float64]

#: Until a command's hidden neurons are at rest; then over how many frames they are averaged.
SETTLING_FRAMES, MEAN_FRAMES = 60, 60


def first_genomes(recipe: Recipe, sharing: Sharing, rng: np.random.Generator, period_s: float
                  ) -> Array:
    """Return the recipe's number of first genomes (N, G)."""
    part = recipe.first
    genomes = np.zeros((part.tries, sharing.size))
    spread = part.spread.model_dump()
    for name, shared in sharing.blocks.items():
        free = rng.normal(scale=spread[name], size=(part.tries, shared.count))
        sharing.part(genomes, name)[:] = free + (part.leak if name in LOGISTIC else 0.0)
    _oscillate(recipe, sharing, genomes, period_s)
    limbs = drives(bodies.get(recipe.body))
    # What belongs to one swing keeps its phase together within a genome.
    shift = rng.uniform(-np.pi, np.pi, part.tries)
    for entry in _entries(recipe):
        _enter(entry, sharing, genomes, limbs[entry.of], rng, shift)
    for behaviour in part.stance:
        _stand(sharing, genomes, sharing.behaviours.index(behaviour))
    return genomes


def _entries(recipe: Recipe) -> list[Entry]:
    """
    Return the entries of the limbs that follow no other.

    A right leg without entries of its own, of a body without a left-right mirror, has those of the
    left one before it, mirrored: half a cycle apart, with left and right exchanged.
    """
    given = {entry.of for entry in recipe.first.entries}
    images = Mirror('left_right', {}, SignedPermutation((), ()), ()).behaviours(recipe.behaviours)
    other = {name: recipe.behaviours[images.place[number]]
             for number, name in enumerate(recipe.behaviours)}
    found = []
    for limb in sorted(_limbs_alone(recipe)):
        source = limb if limb in given else limb - limb % 2
        for entry in recipe.first.entries:
            if entry.of != source:
                continue
            if source == limb:
                found.append(entry)
            elif not isinstance(entry.joint, int):  # whose sign is known
                phase = entry.phase_rad and (entry.phase_rad[0] + np.pi,
                                             entry.phase_rad[1] + np.pi)
                found.append(entry.model_copy(update={
                    'of': limb, 'phase_rad': phase,
                    'behaviours': tuple(other[name] for name in entry.behaviours)}))
    return found


def _limbs_alone(recipe: Recipe) -> frozenset[int]:
    """Return the limbs that no mirror makes of one with a smaller number."""
    images = [mirror.limbs for mirror in recipe.mirrors()]
    alone: set[int] = set()
    known: set[int] = set()
    for limb in range(len(limbs_of(bodies.get(recipe.body)))):
        if limb in known:
            continue
        alone.add(limb)
        waiting = [limb]
        while waiting:
            now = waiting.pop()
            known.add(now)
            waiting += [image[now] for image in images if image[now] not in known]
    return frozenset(alone)


def _stand(sharing: Sharing, genomes: Array, behaviour: int) -> None:
    """Hold the motors at the stance under a behaviour, whatever the hidden neurons rest at."""
    network = sharing.network(genomes)
    drive = network.drive(np.eye(len(sharing.behaviours))[behaviour])
    senses, state = np.zeros(len(sharing.senses)), network.initial_state()
    pushed = []
    for frame in range(SETTLING_FRAMES + MEAN_FRAMES):
        if frame >= SETTLING_FRAMES:
            pushed.append((network.motor @ state.hidden[..., None])[..., 0])
        state = step(network, state, drive, senses)
    mean = np.mean(pushed, 0)
    for motor in range(mean.shape[1]):
        if sharing.blocks['motor_command'].index[motor, behaviour] >= 0:
            sharing.put(genomes, 'motor_command', motor, behaviour, -mean[:, motor])


def _oscillate(recipe: Recipe, sharing: Sharing, genomes: Array, period_s: float) -> None:
    """Make the first two neurons turn at the recipe's rhythm, and deaf to all others."""
    angle = 2 * np.pi * recipe.first.rhythm_hz * period_s
    turn = recipe.first.gain * np.array([[np.cos(angle), -np.sin(angle)],
                                         [np.sin(angle), np.cos(angle)]])
    for row in range(sharing.hidden.oscillating):
        for block in ('hidden', 'command', 'senses'):
            shared = sharing.blocks[block]
            for column in range(shared.index.shape[1]):
                if shared.index[row, column] >= 0:
                    inside = block == 'hidden' and row < 2 and column < 2
                    sharing.put(genomes, block, row, column, turn[row, column] if inside else 0.0)


def _enter(entry: Entry, sharing: Sharing, genomes: Array, limb: Limb,
           rng: np.random.Generator, shift: Array) -> None:
    value = rng.uniform(*entry.between, len(genomes))
    if entry.onto is not None:
        _put(entry, sharing, genomes, sharing.hidden.of(entry.of, entry.onto),
             ('hidden', 'command', 'senses'), value, rng, shift)
        return
    assert entry.joint is not None
    for row, share in limb.onto(entry.joint):
        _put(entry, sharing, genomes, row, ('motor', 'motor_command', 'motor_senses'),
             share * value, rng, shift)


def _put(entry: Entry, sharing: Sharing, genomes: Array, row: int, blocks: tuple[str, str, str],
         value: Array, rng: np.random.Generator, shift: Array) -> None:
    hidden = sharing.hidden
    if entry.phase_rad is not None:
        phase = shift + rng.uniform(*entry.phase_rad, len(genomes))
        sharing.put(genomes, blocks[0], row, 0, value * np.cos(phase))
        sharing.put(genomes, blocks[0], row, 1, value * np.sin(phase))
    elif entry.neuron is not None:
        sharing.put(genomes, blocks[0], row, hidden.of(entry.of, entry.neuron), value)
    elif entry.sense is not None:
        sharing.put(genomes, blocks[2], row, sharing.senses.index(entry.sense), value)
    for behaviour in entry.behaviours:
        sharing.put(genomes, blocks[1], row, sharing.behaviours.index(behaviour), value)
