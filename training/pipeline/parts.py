"""The parts of a recipe, each with its defaults, which are written here alone."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from training.configuration import Count, NotNegative, Positive, Seed, Strict, one_of
from training.evolution.optimisers import OPTIMISERS
from training.robust.config import RobustConfig
from training.robust.objective import AGGREGATES
from training.robust.settings import (
    Careful,
    Pretraining,
    Randomisation,
    Screening,
    Stage,
    Touch,
    Whole,
)

Name = Annotated[str, Field(pattern=r'^[a-z][a-z0-9_]{0,40}$')]


class Training(Strict):
    """What the evolution of every seed has in common, see `RobustConfig`."""

    world: str = ''
    population: Annotated[int, Field(ge=2, le=10_000)] = RobustConfig.population
    physics_steps: Whole = RobustConfig.physics_steps
    randomisation: Randomisation = Randomisation()
    move_noise: NotNegative = 0.02
    careful: Careful | None = Careful()
    touch: Touch = Touch()
    optimiser: Annotated[str, one_of(OPTIMISERS.names)] = RobustConfig.optimiser
    aggregate: Annotated[str, one_of(lambda: AGGREGATES)] = RobustConfig.aggregate


class Pretrain(Strict):
    """
    Hidden weights that sort the trained words, evolved without a body.

    `runs` runs of `plan`, of which `screening` keeps the best; newcomers of each seed's evolution
    are drawn from `of_a_run` of these (none: from all).
    """

    step: Literal['pretrain']
    name: Name = 'ears'
    runs: Count = 24
    plan: Pretraining = Pretraining(attempts=1, generations=800, moves=4, stops=20, bias=0.07)
    screening: Screening = Screening()
    of_a_run: Count | None = None


class Evolve(Strict):
    """
    Stages of each seed's evolution in drawn worlds.

    A later step of this kind goes on where the one before stopped. `discard_below`: a seed whose
    best earns less than this after the first, second ... of the stages is discarded.
    """

    step: Literal['evolve']
    name: Name
    stages: Annotated[tuple[Stage, ...], Field(min_length=1)]
    discard_below: tuple[float, ...] = ()


class Gate(Strict):
    """
    Trials of the `best` of each seed in an independent engine; the `keep` best go on.

    Attributes
    ----------
    words
        Under which words: the trained ones, or those of them that ask for a move.
    rank
        By `margin` (shortest way in units of the aim, less stop words not obeyed) or `way` (the
        shortest way alone).
    keep, of
        How many go on, of all or of each seed.
    starts, seed
        Slightly different starts, and the seed that they are drawn from.

    """

    step: Literal['gate']
    name: Name
    words: Literal['trained', 'moves'] = 'trained'
    best: Count = 1
    rank: Literal['margin', 'way'] = 'margin'
    keep: Count = 2
    of: Literal['all', 'seed'] = 'all'
    starts: Count = 2
    seed: Seed


class Choose(Strict):
    """
    Order the candidates in an independent engine, under trained and validation words.

    The `best` of each seed take part. Words obeyed come first, then the shorter of the two ways.
    `require`: candidates that do not obey every trained word are dropped; `keep`: how many go on
    (none: all).
    """

    step: Literal['choose']
    name: Name = 'choice'
    best: Count = 1
    starts: Count = 2
    seed: Seed
    require: bool = True
    keep: Count | None = None


class Examine(Strict):
    """
    The final table, the blind look under held-out words, and the champion's files.

    Candidates are tried in their order until one obeys every trained word from `starts` starts.

    Attributes
    ----------
    later_s, later_starts
        Where it is so much later is reported, from so many starts.
    cut_starts
        What it does without its sensors' synapses is reported, from so many starts (none: not).

    """

    step: Literal['examine']
    name: Name = 'final'
    starts: Count = 20
    seed: Seed = 0
    later_s: Positive = 60.0
    later_starts: Count = 5
    cut_starts: Count | None = None


Step = Annotated[Pretrain | Evolve | Gate | Choose | Examine, Field(discriminator='step')]
