"""
Scenarios: what a controller may meet, drawn at random, for the robust training mode.

A controller that lives off one exact friction law, floor or start dies in the next simulator and on
the next table. Each named means of `Randomisation` widens one of those; the ranges were chosen so
that what survives them survives PyBullet, whose friction (dry, bounded) and touch (read within
2 mm) differ from the original's.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import log, radians
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from training.evolution.treatments import Words
from training.robust.settings import Randomisation
from w2b_core.behaviours import BEHAVIOURS
from w2b_core.hearing.english import STOP as REST
from w2b_sim.worlds import World

if TYPE_CHECKING:
    from w2b_sim.engines.batched import Variations

Array = NDArray[np.float64]

FORWARD, STOP, BACKWARD = 1, 0, -1
#: Standard deviation of the noise on each element of a vector, at most; a typical element of a
#: vector of norm 2.9 in 300 dimensions is 0.17. What is nearly a stop word should stop; what is
#: not quite a move word need not move.
STOP_NOISE, MOVE_NOISE = 0.05, 0.01
#: In the order in which situations are drawn.
DIRECTIONS = (FORWARD, BACKWARD, STOP)


def direction_of(behaviour: str) -> int:
    """
    Return which way a behaviour walks: `FORWARD`, `BACKWARD`, or `STOP` for standing still.

    Raises
    ------
    ValueError
        If it does something else, which drawn worlds do not reward.

    """
    known = BEHAVIOURS.get(behaviour)
    if behaviour == REST or (known.moves and known.course.along):
        return int(known.course.along)
    raise ValueError(f'expected behaviours that walk, or {REST}, got {behaviour!r}')


def by_direction(words: Words, vectors: Mapping[str, ArrayLike]) -> dict[int, Array]:
    """Return direction -> vectors (W, T) of the (word, behaviour) pairs that ask for it."""
    return {direction: np.array([np.asarray(vectors[word], dtype=np.float64)
                                 for word, behaviour in words
                                 if direction_of(behaviour) == direction])
            for direction in DIRECTIONS}


def check_directions(words: Words) -> None:
    """Raise ValueError unless each direction has a word that asks for it."""
    asked = {direction_of(behaviour) for _word, behaviour in words}
    for direction in DIRECTIONS:
        if direction not in asked:
            name = REST if direction == STOP else next(
                name for name in BEHAVIOURS if BEHAVIOURS.get(name).course.along == direction)
            raise ValueError(f'words: expected at least one for each direction, got none for '
                             f'{name!r}')


@dataclass(frozen=True)
class Scenario:
    """
    R situations that every controller of a generation meets.

    Attributes
    ----------
    signals: shape (R, T)
        The word heard.
    directions: shape (R,)
        `FORWARD`, `STOP` or `BACKWARD`: what it asks for.
    variations
        Name of a field of `Variations` -> values (R,).
    contact_soon: shape (R,)
        Whether contacts act just before they are reached.

    """

    signals: Array
    directions: NDArray[np.int64]
    variations: dict[str, Array]
    contact_soon: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.directions)

    def take(self, indices: NDArray[np.int64]) -> Scenario:
        """Return the situations at `indices`."""
        return Scenario(self.signals[indices], self.directions[indices],
                        {name: values[indices] for name, values in self.variations.items()},
                        self.contact_soon[indices])

    def engine_variations(self) -> Variations:
        """Return the variations as the batched engine takes them, for one start a situation."""
        from w2b_sim.engines.batched import Variations

        columns: dict[str, Any] = {name: values[:, None]
                                   for name, values in self.variations.items()}
        return Variations(**columns)


def draw(rng: np.random.Generator, words: Mapping[int, Array], world: World,
         randomisation: Randomisation, *, moves: int, stops: int,
         move_noise: float = MOVE_NOISE) -> Scenario:
    """
    Draw `moves` situations for each direction and `stops` for standing still.

    Parameters
    ----------
    rng
        Everything is drawn from it.
    words
        Direction -> vectors (W, T) of the words that ask for it.
    world
        Nominal; the friction's ranges depend on it.
    randomisation
        The means in use.
    moves, stops
        Counts of situations; every word of a direction takes its turn.
    move_noise
        Standard deviation of the noise on each element of a move word's vector, at most.

    """
    signals, directions = [], []
    for direction, count in zip(DIRECTIONS, (moves, moves, stops), strict=True):
        vectors = words[direction]
        order = rng.permutation(len(vectors))
        for turn in range(count):
            vector = vectors[order[turn % len(vectors)]]
            if direction == STOP and randomisation.vectors and turn % 2 and len(vectors) > 1:
                vector = _mixture(rng, vectors)
            signals.append(vector)
            directions.append(direction)
    heard = np.array(signals)
    if randomisation.vectors:
        noise = rng.choice([0.0, 0.4, 1.0], len(heard), p=[0.5, 0.25, 0.25])
        noise = noise * np.where(np.array(directions) == STOP, STOP_NOISE, move_noise)
        heard = heard + noise[:, None] * rng.standard_normal(heard.shape)
    variations = _variations(rng, len(heard), world, randomisation)
    return Scenario(heard, np.array(directions), variations,
                    variations.pop('contact_soon', np.zeros(len(heard))) > 0)


def _mixture(rng: np.random.Generator, vectors: Array) -> Array:
    """A point between two vectors, drawn out to their mean norm: a synonym nobody has listed."""
    first, second = rng.choice(len(vectors), 2, replace=False)
    share = rng.random()
    mixed: Array = share * vectors[first] + (1 - share) * vectors[second]
    norm = np.linalg.norm(vectors[[first, second]], axis=1).mean()
    return mixed * (norm / np.linalg.norm(mixed))


def _variations(rng: np.random.Generator, count: int, world: World,
                randomisation: Randomisation) -> dict[str, Array]:
    """Draw every means, used or not, so that leaving one out changes no other."""
    def uniform(low: float, high: float) -> Array:
        return rng.uniform(low, high, count)

    def sometimes(share: float) -> Array:
        return (rng.random(count) < share).astype(np.float64)

    dry = world.friction is not None
    friction = uniform(0.5, 1.2) if dry else np.where(
        sometimes(0.12) > 0, np.inf, np.exp(uniform(log(0.5), log(4.0))))
    slip = uniform(0.0, 1e-3) if dry else np.exp(uniform(log(5e-4), log(1e-2)))
    drawn = {
        'friction': {'friction': friction, 'slip_m_per_n_s': slip},
        'contact': {'erp': uniform(0.1, 0.4), 'contact_soon': sometimes(0.5)},
        'bodies': {'gravity_m_s2': world.gravity_m_s2 * uniform(0.9, 1.1),
                   'base_mass_scale': uniform(0.8, 1.2)},
        'servos': {'servo_gain_scale': uniform(0.8, 1.2),
                   'motor_noise_rad_s': uniform(0.0, 0.6) * sometimes(0.7)},
        'pushes': {'push_m_s': uniform(0.0, 0.01) * sometimes(0.5)},
        'sensors': {'touch_gap_m': uniform(1e-6, 0.003), 'touch_delay': sometimes(0.3),
                    'touch_flip_probability': uniform(0.0, 0.02) * sometimes(0.5)},
        'starts': {'height_m': uniform(0.0, 0.003),
                   'roll_rad': uniform(-radians(0.6), radians(0.6)),
                   'pitch_rad': uniform(-radians(0.6), radians(0.6)),
                   'yaw_rad': uniform(-radians(1.2), radians(1.2))},
    }
    used = {'seed': rng.integers(0, 2**31, count).astype(np.float64)}
    for means, values in drawn.items():
        if getattr(randomisation, means):
            used.update(values)
    return used
