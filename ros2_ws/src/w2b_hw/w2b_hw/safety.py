"""
Whether the servos may be driven, and where to: a pure state machine, time comes in as a number.

    DISARMED --arm--> ARMING --all energised--> ACTIVE <--target-- HOLD (no target for 150 ms)
        ^                |                         |                 |
        +-- targets stop +                         +---> PARK <------+ (500 ms, or asked to)
        +------------------------- parked ---------------+
    any state --fault--> FAULT --arm--> ARMING
    ACTIVE, HOLD, PARK --fallen, picked up--> HOLD, then DISARMED; no target leads back

There is no position feedback, so the first pulse of a servo is a jump: servos are energised one at
a time, at the park pose. PARK always ends in DISARMED, and nothing but `arm` leads out of DISARMED
or FAULT.

Entering ARMING, PARK, DISARMED or FAULT begins a new *epoch*: what was said in an earlier one moves
nothing any more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

Pose = tuple[float, ...]


class State(Enum):
    """States of the machine; servos are off in DISARMED and FAULT."""

    DISARMED = 'DISARMED'
    ARMING = 'ARMING'
    ACTIVE = 'ACTIVE'
    HOLD = 'HOLD'
    PARK = 'PARK'
    FAULT = 'FAULT'


#: Times are sums of floats: what is due within a microsecond is due.
_CLOCK_S = 1e-6
DRIVEN = frozenset({State.ARMING, State.ACTIVE, State.HOLD, State.PARK})
#: Entering one of these begins a new epoch.
_EPOCH_BEGINS = frozenset({State.DISARMED, State.ARMING, State.PARK, State.FAULT})


@dataclass(frozen=True)
class Limits:
    """
    What may never be exceeded.

    Attributes
    ----------
    lower_rad, upper_rad, park_rad: one for each joint
        Limits, and the pose that servos are energised at and parked in.
    slew_rad_s, park_slew_rad_s
        Fastest change of a commanded angle; that of parking.
    hold_after_s, park_after_s
        Age of the last target at which the pose is held, and parking begins.
    let_go_after_s
        How long the pose is held when the robot fell or was picked up, before the servos are turned
        off.
    park_at_most_s
        After which parking ends even if the pose was not reached.
    stand_slew_rad_s, stand_s
        Of a robot that lost its sense of balance in mid-walk: how fast it parks, and how long it
        then stands before it relaxes.
    energise_every_s
        Time between one servo and the next.
    stall_after_s
        A control loop that was silent for longer has lost touch: fault.
    duty_budget_s, duty_recovery
        Seconds of driven time before the servos must cool, and how many of them come back in a
        second of rest.

    """

    lower_rad: Pose
    upper_rad: Pose
    park_rad: Pose
    slew_rad_s: float = 5.0
    park_slew_rad_s: float = 1.0
    hold_after_s: float = 0.150
    park_after_s: float = 0.500
    let_go_after_s: float = 1.0
    park_at_most_s: float = 2.0
    stand_slew_rad_s: float = 3.0
    stand_s: float = 1.0
    energise_every_s: float = 0.1
    stall_after_s: float = 0.25
    duty_budget_s: float = 600.0
    duty_recovery: float = 0.5

    def __post_init__(self) -> None:
        """Check lengths and order (ValueError)."""
        if not len(self.lower_rad) == len(self.upper_rad) == len(self.park_rad) > 0:
            raise ValueError('lower_rad, upper_rad, park_rad: expected one value for each joint')
        if not all(low <= park <= high for low, park, high
                   in zip(self.lower_rad, self.park_rad, self.upper_rad, strict=True)):
            raise ValueError('park_rad: expected a pose within the limits')
        if not 0 < self.hold_after_s < self.park_after_s:
            raise ValueError('hold_after_s, park_after_s: expected 0 < hold < park')


@dataclass(frozen=True)
class Command:
    """What to send: a pose, and which joints are driven (the others are off)."""

    state: State
    position_rad: Pose
    energised: tuple[bool, ...]


class Safety:
    """
    The state machine. `now_s` is any clock that only goes forward.

    Parameters
    ----------
    limits
        What may never be exceeded.
    session
        Begins the names of the epochs: another one for each process, so that an epoch of before a
        restart is never taken for one of after it.

    """

    def __init__(self, limits: Limits, session: str = 'session') -> None:
        self.limits = limits
        self._session = session
        self._epochs = 0
        self.state = State.DISARMED
        #: Why the machine is in its state: a sentence for a person.
        self.reason = 'not armed yet'
        self.duty_used_s = 0.0
        self._target: Pose | None = None
        self._target_at_s = float('-inf')
        self._position = limits.park_rad
        self._energised = 0
        self._energised_at_s = float('-inf')
        self._parking_since_s = 0.0
        self._standing = False
        self._let_go_at_s: float | None = None
        self._stepped_at_s: float | None = None
        self._unconfirmed = False

    # -- inputs

    @property
    def epoch(self) -> str:
        """Name of the epoch: changes whenever what was said before counts no more."""
        return f'{self._session}.{self._epochs}'

    def take_target(self, position_rad: Sequence[float], now_s: float,
                    word_epoch: str | None = None) -> Pose:
        """
        Take a new target pose; return it as clamped to the limits.

        `word_epoch` is the epoch in which the word was said that the target follows; None if it
        follows no word. A target of a word of another epoch shows that the brain is alive, and
        moves nothing: the pose that is commanded now is returned.

        Raises
        ------
        ValueError
            If it has another number of joints, or a value is not finite.

        """
        limits = self.limits
        if len(position_rad) != len(limits.park_rad):
            raise ValueError(f'target: expected {len(limits.park_rad)} joints, '
                             f'got {len(position_rad)}')
        if not all(abs(value) < float('inf') for value in position_rad):
            raise ValueError(f'target: expected finite angles, got {list(position_rad)}')
        self._target_at_s = now_s
        if word_epoch not in (None, self.epoch):
            return self._position
        self._target = _clamped(position_rad, limits)
        return self._target

    def arm(self, now_s: float) -> str | None:
        """Start energising the servos; return None, or why not."""
        if self.state in DRIVEN:
            return f'already {self.state.value}'
        if self._age_s(now_s) >= self.limits.hold_after_s:
            return 'no fresh targets: start the brain first'
        if self.duty_used_s > 0.9 * self.limits.duty_budget_s:
            rest_s = (self.duty_used_s - 0.9 * self.limits.duty_budget_s) \
                / self.limits.duty_recovery
            return f'the servos must cool for another {rest_s:.0f} s'
        self._enter(State.ARMING, 'energising the servos one by one')
        # What was wanted before is not what is wanted now.
        self._target = None
        self._position = self.limits.park_rad
        self._energised = 0
        self._energised_at_s = float('-inf')
        self._unconfirmed = False
        self._stepped_at_s = now_s
        return None

    def stand(self, reason: str, now_s: float) -> None:
        """Go to the park pose at once, stand there for a while, then relax."""
        self.park(reason, now_s)
        self._standing = self.state is State.PARK

    def park(self, reason: str, now_s: float) -> None:
        """Go to the park pose, then relax; nothing happens where the servos are off."""
        self._standing = False
        if self.state is State.ARMING:
            self._relax(State.DISARMED, reason)
        elif self.state in (State.ACTIVE, State.HOLD) and self._let_go_at_s is None:
            self._enter(State.PARK, reason)
            self._parking_since_s = now_s

    def let_go(self, reason: str, now_s: float) -> None:
        """Hold the pose whatever the targets, then turn off: the robot fell or was picked up."""
        if self.state is State.ARMING:
            self._relax(State.DISARMED, reason)
        elif self.state in DRIVEN and self._let_go_at_s is None:
            # Parking would move legs in somebody's hands.
            self._epochs += 1
            self._enter(State.HOLD, reason)
            self._let_go_at_s = now_s + self.limits.let_go_after_s

    def fault(self, reason: str) -> None:
        """Turn everything off, from any state; the first reason stays."""
        if self.state is not State.FAULT:
            self._relax(State.FAULT, reason)

    def relax(self, reason: str) -> None:
        """Turn everything off; a fault stays a fault."""
        if self.state in DRIVEN:
            self._relax(State.DISARMED, reason)

    def confirm(self) -> None:
        """Note that the last command reached the servos."""
        self._unconfirmed = False

    # -- time

    def due_s(self) -> float:
        """Return when the machine next leaves its state by itself."""
        if self._let_go_at_s is not None:
            return self._let_go_at_s
        after_s = {State.ARMING: self.limits.hold_after_s, State.ACTIVE: self.limits.hold_after_s,
                   State.HOLD: self.limits.park_after_s}.get(self.state, float('inf'))
        return self._target_at_s + after_s

    def step(self, now_s: float) -> Command:
        """
        Return what to send now.

        Call `confirm` when it was sent. A command that is not confirmed may have reached some
        servos and not others; it is repeated, so that no servo ever moves two steps at once.
        """
        elapsed_s = 0.0 if self._stepped_at_s is None else now_s - self._stepped_at_s
        self._stepped_at_s = now_s
        self._count_duty(elapsed_s)
        if self.state in DRIVEN:
            if not 0.0 <= elapsed_s <= self.limits.stall_after_s:
                self.fault(f'the control loop was silent for {elapsed_s:.2f} s')
            elif self.duty_used_s >= self.limits.duty_budget_s:
                self.park('the duty budget is used up: the servos must cool', now_s)
        if self.state in DRIVEN:
            self._watch_target(now_s)
        if self.state in DRIVEN and not self._unconfirmed:
            self._move(elapsed_s, now_s)
            self._unconfirmed = True
        count = len(self._position)
        driven = self._energised if self.state in DRIVEN else 0
        return Command(self.state, self._position,
                       tuple(joint < driven for joint in range(count)))

    def _watch_target(self, now_s: float) -> None:
        age_s, limits = self._age_s(now_s), self.limits
        if self._let_go_at_s is not None:
            if now_s >= self._let_go_at_s - _CLOCK_S:
                self._relax(State.DISARMED, f'{self.reason}; held and relaxed')
            return
        fresh = age_s < limits.hold_after_s
        if self.state is State.ARMING and not fresh:
            self._relax(State.DISARMED, 'targets stopped while arming')
        elif self.state in (State.ACTIVE, State.HOLD) and age_s >= limits.park_after_s:
            self.park(f'no target for {limits.park_after_s * 1e3:.0f} ms', now_s)
        elif self.state is State.ACTIVE and not fresh:
            self._enter(State.HOLD, f'no target for {limits.hold_after_s * 1e3:.0f} ms')
        elif self.state is State.HOLD and fresh:
            self._enter(State.ACTIVE, 'targets flow again')

    def _move(self, elapsed_s: float, now_s: float) -> None:
        limits = self.limits
        if self.state is State.ARMING:
            if now_s - self._energised_at_s < limits.energise_every_s - _CLOCK_S:
                return
            if self._energised == len(self._position):
                self._enter(State.ACTIVE, 'following targets')
                return
            self._energised += 1
            self._energised_at_s = now_s
        elif self.state is State.ACTIVE and self._target is not None:
            self._position = _towards(self._position, self._target,
                                      limits.slew_rad_s * elapsed_s)
        elif self.state is State.PARK:
            slew = limits.stand_slew_rad_s if self._standing else limits.park_slew_rad_s
            self._position = _towards(self._position, limits.park_rad, slew * elapsed_s)
            parked_s = now_s - self._parking_since_s
            if ((self._position == limits.park_rad
                 and (not self._standing or parked_s >= limits.stand_s))
                    or parked_s >= limits.park_at_most_s):
                self._relax(State.DISARMED, f'{self.reason}; parked and relaxed')

    def _count_duty(self, elapsed_s: float) -> None:
        elapsed_s = max(elapsed_s, 0.0)
        if self.state in DRIVEN:
            self.duty_used_s += elapsed_s
        else:
            self.duty_used_s = max(0.0, self.duty_used_s - self.limits.duty_recovery * elapsed_s)

    def _age_s(self, now_s: float) -> float:
        return now_s - self._target_at_s + _CLOCK_S

    def _enter(self, state: State, reason: str) -> None:
        self._epochs += state in _EPOCH_BEGINS
        self.state, self.reason = state, reason

    def _relax(self, state: State, reason: str) -> None:
        self._enter(state, reason)
        self._let_go_at_s = None
        # A target is good for one arming: what was wanted before is not what is wanted after.
        self._target, self._target_at_s = None, float('-inf')
        # Where the joints are now is not known; they will be energised here.
        self._position = self.limits.park_rad


def _clamped(position_rad: Sequence[float], limits: Limits) -> Pose:
    return tuple(min(max(float(value), low), high) for value, low, high
                 in zip(position_rad, limits.lower_rad, limits.upper_rad, strict=True))


def _towards(position: Pose, goal: Pose, most: float) -> Pose:
    return tuple(there if abs(there - here) <= most else here + most * (1 if there > here else -1)
                 for here, there in zip(position, goal, strict=True))
