"""The settings of training in drawn worlds, each with its default, which is written here alone."""

from __future__ import annotations

from dataclasses import fields
from typing import Annotated

from pydantic import Field
from pydantic.dataclasses import dataclass

from training.configuration import STRICT, Count, NotNegative, Positive, Share, one_line

Whole = Annotated[int, Field(ge=0, le=100_000)]


@one_line('randomisation')
@dataclass(frozen=True, config=STRICT)
class Randomisation:
    """
    Which means of robust training are in use; the others' parts stay as the world has them.

    Attributes
    ----------
    friction
        Dry friction of coefficient 0.5 to 4 (earth: 0.5 to 1.2), in one of eight unbounded, with
        viscous slip of 0.5 to 10 mm/s per newton (earth: up to 1).
    contact
        Error reduction of contacts from 0.1 to 0.4; in half of the situations they act just before
        they are reached, as Bullet's do, instead of just after, as the original's.
    bodies
        Base mass and gravity 10 to 20 % lighter or heavier.
    servos
        Gain 20 % lower or higher; in most situations noise of up to 0.6 rad/s on each joint's rate:
        PyBullet's motors miss a rate by that much when legs push against one another.
    pushes
        In half of the scenarios, random pushes of up to 1 cm/s every step.
    sensors
        Touch from 0 to 3 mm above the floor, in a third delayed, in half with up to 2 % flipped.
    starts
        Up to 3 mm above the floor, tilted up to 0.6 degrees, turned up to 1.2 degrees.
    vectors
        Half of the stop scenarios hear a mixture of two stop words; half of all hear noise on top.

    """

    friction: bool = True
    contact: bool = True
    bodies: bool = True
    servos: bool = True
    pushes: bool = True
    sensors: bool = True
    starts: bool = True
    vectors: bool = True

    @classmethod
    def only(cls, *names: str) -> Randomisation:
        """Return the randomisation that uses the named means alone (ValueError if unknown)."""
        known = [field.name for field in fields(cls)]
        for name in names:
            if name not in known:
                raise ValueError(f'means: expected some of {", ".join(known)}, got {name!r}')
        return cls(**{name: name in names for name in known})


@one_line('pretraining')
@dataclass(frozen=True, config=STRICT)
class Pretraining:
    """
    How hidden weights are evolved without a body.

    `attempts` independent runs of `generations` each; situations are drawn anew every `redraw`
    generations, `moves` a direction and `stops`. No attempts: no pretraining. Half of the
    situations put a constant input on each hidden neuron, drawn from N(0, `bias`), as touch will.
    """

    attempts: Whole = 6
    generations: Count = 500
    redraw: Count = 25
    population: Annotated[int, Field(ge=2, le=10_000)] = 50
    moves: Count = 4
    stops: Count = 10
    bias: NotNegative = 0.0


@one_line('screening')
@dataclass(frozen=True, config=STRICT)
class Screening:
    """
    Which hidden weights sort words well enough to begin with.

    Attributes
    ----------
    rest, rhythm
        Swing of the hidden neurons below which they rest, and above which they have a rhythm.
    contrast
        Least distance between the means of the two directions' rhythms.
    noisy
        Noisy versions of each word.
    keep, alike
        How many are kept, and how many of one run at most: those of one run are much alike.

    """

    rest: Positive = 0.03
    rhythm: Positive = 0.3
    contrast: NotNegative = 0.5
    noisy: Count = 16
    keep: Count = 10
    alike: Count = 3


@one_line('careful')
@dataclass(frozen=True, config=STRICT)
class Careful:
    """
    Mutation that does not unlearn words.

    Attributes
    ----------
    hidden_share
        Share of the children whose hidden weights may change at all.
    tolerance
        A child may sort this much worse than its parent, in words.
    rhythm_weight
        What the directions count beside one stop signal: the weaker rhythm, and the distance
        between the two.

    """

    hidden_share: Share = 0.3
    tolerance: NotNegative = 0.05
    rhythm_weight: NotNegative = 4.0


@one_line('touch')
@dataclass(frozen=True, config=STRICT)
class Touch:
    """
    How touch synapses come into use in a stage with touch that follows one without.

    Attributes
    ----------
    growing
        Part of the stage's generations over which they grow to their full size.
    sizes
        Standard deviations of the synapses to begin with.
    best
        How many of the best individuals go on, in many copies.

    """

    growing: Annotated[float, Field(gt=0, le=1)] = 0.7
    sizes: Annotated[tuple[Positive, ...], Field(min_length=1)] = (0.02, 0.04, 0.08)
    best: Count = 5


@one_line('stage')
@dataclass(frozen=True, config=STRICT)
class Stage:
    """
    A part of training in drawn worlds.

    Attributes
    ----------
    generations
        How long it is.
    moves, stops
        Situations a direction, and for standing still.
    redraw
        Situations are drawn anew every so many generations (0: never, so that small gains are not
        lost in the luck of the draw).
    touch
        Whether touch sensors are felt; else they read 0.
    clip_m
        Progress counts up to it, extrapolated to the whole.
    vectors
        Whether words may be varied.
    length
        Share of the world's steps that each situation lasts.
    stray_weight, free_stray_m
        What straying under a stop word costs for each metre, beyond which distance: bodies settle
        when they are set down.

    """

    generations: Count
    moves: Count
    stops: Count
    redraw: Whole
    touch: bool
    clip_m: Positive
    vectors: bool = True
    length: Positive = 1.0
    stray_weight: NotNegative = 1.5
    free_stray_m: NotNegative = 0.05
