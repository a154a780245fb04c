"""The parts of a recipe and their defaults, each written once."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from training.configuration import Count, NotNegative, Positive, Share, Strict

Range = tuple[float, float]


class NetworkPart(Strict):
    """
    The network's size and symmetry.

    `symmetry`: `found` for every mirror that the body has, or the names of those to use (a body
    without them is refused), or none. `direct`: synapses from the oscillating neurons straight onto
    the motor neurons. `begins`: the behaviour at whose rest the limbs' neurons begin, else at 0.
    """

    oscillating: Annotated[int, Field(ge=2, le=20)] = 2
    per_limb: Annotated[int, Field(ge=1, le=20)] = 3
    symmetry: Literal['found'] | tuple[str, ...] = 'found'
    direct: bool = False
    begins: str | None = None


class Spread(Strict):
    """Standard deviations of a first genome's free numbers, by block, about zero."""

    hidden: NotNegative = 0.1
    command: NotNegative = 0.3
    senses: NotNegative = 0.05
    hidden_leak: NotNegative = 0.3
    motor: NotNegative = 0.15
    motor_command: NotNegative = 0.1
    motor_senses: NotNegative = 0.05
    motor_leak: NotNegative = 0.3


class Entry(Strict):
    """
    One synapse of a limb in a first genome, drawn from `between`; its mirrors follow.

    Onto neuron `onto` of limb number `of`, or onto its joint number `joint`, or onto all of its
    joints so that its foot goes forward (`swing`) or up (`lift`), see `drives`; from the oscillator
    (at the phase `phase_rad`), from neuron `neuron` of the limb, from behaviours or from a sense.
    """

    of: Annotated[int, Field(ge=0)] = 0
    onto: Annotated[int, Field(ge=0)] | None = None
    joint: Annotated[int, Field(ge=0)] | Literal['swing', 'lift'] | None = None
    phase_rad: Range | None = None
    neuron: Annotated[int, Field(ge=0)] | None = None
    behaviours: tuple[str, ...] = ()
    sense: str | None = None
    between: Range

    @model_validator(mode='after')
    def _one_of_each(self) -> Entry:
        if (self.onto is None) == (self.joint is None):
            raise ValueError('expected one of onto and joint')
        sources = (self.phase_rad is not None, self.neuron is not None, bool(self.behaviours),
                   self.sense is not None)
        if sum(sources) != 1:
            raise ValueError('expected one of phase_rad, neuron, behaviours and sense')
        if self.joint is not None and self.phase_rad is not None:
            raise ValueError('expected phase_rad onto a neuron, not onto a joint')
        return self


class FirstPart(Strict):
    """
    The first genomes: an oscillator, entries that are known to help, random numbers elsewhere.

    Entries of a limb that mirrors an earlier one are left out: they follow. A right leg without
    entries that follows none mirrors the left one before it. Under the behaviours of `stance` the
    command's own synapses onto the motors hold the body where it stands. `tries` are drawn, and
    the best one is where the search begins.
    """

    rhythm_hz: Positive = 1.6
    gain: Positive = 1.25
    leak: float = 1.5
    spread: Spread = Spread()
    entries: tuple[Entry, ...] = ()
    stance: tuple[str, ...] = ()
    tries: Count = 96
    seconds: Positive = 4.0


class Worlds(Strict):
    """
    What differs from one situation to the next: ranges, and in which share of them.

    `hard` is the share of situations in which everything differs; in the others each part does
    with its own probability. `dry_friction` replaces unbounded viscous friction, as the paper's
    world has it, by a coefficient and by contacts that act just before they are reached: what the
    judges, PyBullet and MuJoCo, have in its place.
    """

    dry_friction: Positive | None = None

    friction: Range = (0.4, 1.0)
    base_mass_scale: Range = (0.7, 1.3)
    servo_gain_scale: Range = (0.8, 1.2)
    servo_speed_scale: Range = (0.8, 1.2)
    servo_torque_scale: Range = (0.65, 1.25)
    command_late: Share = 0.4
    motor_noise_rad_s: Range = (0.0, 0.4)
    push_m_s: Range = (0.0, 0.015)
    joint_zero_rad: NotNegative = 0.09
    heading_offset_rad: NotNegative = 0.4
    gyro_bias_rad_s: NotNegative = 0.002
    gyro_noise_rad_s: NotNegative = 0.02
    gravity_noise: NotNegative = 0.02
    touch_flip_probability: Range = (0.0, 0.02)
    touch_gap_m: Range | None = None
    slip_m_per_n_s: Range | None = None
    gravity_scale: Range = (1.0, 1.0)
    height_m: Range = (0.0, 0.004)
    tilt_rad: NotNegative = 0.03
    probability: Share = 0.6
    hard: Share = 0.3


class Term(Strict):
    """A fault: none up to `free`, full from `full` on, with a weight in the exponent."""

    free: float = 0.0
    full: float
    weight: NotNegative

    @model_validator(mode='after')
    def _ordered(self) -> Term:
        if not self.full > self.free:
            raise ValueError(f'expected full above free, {self.free}, got {self.full}')
        return self


Terms = dict[str, Term]
#: What a term may name, see `scores.Scores.figures`.
FIGURES = ('rhythm_hz', 'fastest_joint_hz', 'at_speed_limit', 'torque_share', 'tilt', 'lowered',
           'heading_error_rad', 'across_share', 'wobble_rad', 'displacement_m',
           'displacement_lengths', 'excess', 'drift_m', 'drift_lengths', 'joint_speed_rad_s',
           'height_change', 'height_share')
#: Of every behaviour that moves.
_SERVOS: Terms = {
    'rhythm_hz': Term(free=1.6, full=3.6, weight=0.4),
    'fastest_joint_hz': Term(free=1.8, full=2.6, weight=1.0),
    'at_speed_limit': Term(free=0.02, full=0.15, weight=1.0),
    'torque_share': Term(full=1.0, weight=0.45),
    'tilt': Term(full=0.1, weight=0.3),
    'lowered': Term(free=0.25, full=0.6, weight=0.4)}


class Aims(Strict):
    """
    What a behaviour earns: progress times exp(-faults).

    A behaviour is a walk, a turn, a stand or a sit: by its course, and `sit` by its name, unless
    `kinds` says otherwise. Progress is the speed (after a second: a lunge is no walk) as a share of
    the aim, at most 1; of a stand or a sit it is 1.
    """

    walk_body_lengths_s: Positive = 1.4
    turn_rad_s: Positive = 0.23
    kinds: dict[str, Literal['walk', 'turn', 'stand', 'sit']] = {}
    walk: Terms = {**_SERVOS, 'heading_error_rad': Term(full=0.3, weight=0.75),
                   'across_share': Term(full=0.25, weight=0.45),
                   'wobble_rad': Term(full=0.3, weight=0.3),
                   'excess': Term(free=0.05, full=0.5, weight=0.5)}
    turn: Terms = {**_SERVOS, 'displacement_m': Term(full=0.12, weight=0.9),
                   'excess': Term(free=0.1, full=0.6, weight=1.0)}
    stand: Terms = {'drift_m': Term(full=0.04, weight=1.0),
                    'joint_speed_rad_s': Term(full=0.5, weight=0.6),
                    'wobble_rad': Term(full=0.3, weight=0.4),
                    'height_change': Term(free=0.1, full=0.4, weight=1.0),
                    'torque_share': Term(full=0.5, weight=0.3)}
    sit: Terms = {'drift_m': Term(full=0.04, weight=1.0),
                  'joint_speed_rad_s': Term(full=0.5, weight=0.6),
                  'wobble_rad': Term(full=0.3, weight=0.4),
                  'height_share': Term(free=0.35, full=0.8, weight=1.0),
                  'torque_share': Term(full=0.25, weight=1.0)}
    worst_weight: Share = 0.4
    fallen_up: float = 0.7

    @field_validator('walk', 'turn', 'stand', 'sit')
    @classmethod
    def _known_figures(cls, terms: Terms) -> Terms:
        for name in terms:
            if name not in FIGURES:
                raise ValueError(f'expected terms among {", ".join(FIGURES)}, got {name!r}')
        return terms


class Stage(Strict):
    """
    One stage of the curriculum.

    Attributes
    ----------
    generations
        Of each seed in this stage.
    phases
        Seconds of each command: one for single commands, more for sequences of commands.
    sequences
        Drawn anew each generation, of all that do not mirror one another; none for all of them.
    situations
        Worlds that every candidate meets, drawn anew each generation.
    physics_steps
        In a control period: fewer are faster, and less true.
    blend
        Up to this share of other commands is mixed into half of the commands.
    keep
        Seeds that go on after this stage.
    sigma
        Step size to begin with; none to go on as before.

    """

    name: str
    generations: Count
    phases: tuple[Positive, ...] = (4.0,)
    sequences: Count | None = None
    situations: Count = 2
    physics_steps: Count = 10
    blend: Share = 0.2
    keep: Count = 1
    sigma: Positive | None = None


class Drop(Strict):
    """Seeds that are dropped after a stage whatever their rank: those that stand or vibrate."""

    walk_below_body_lengths_s: NotNegative = 0.3
    fastest_joint_above_hz: Positive = 3.0
