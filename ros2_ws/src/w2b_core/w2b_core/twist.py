"""
Velocities as behaviours: what a joystick, a keyboard or navigation asks for, with a deadman.

A robot of ours has one speed forward and one backward, and turns on the spot. Of a velocity the
larger share counts: forward or backward, or a turn. A velocity lasts no longer than a timeout. Like
a word, it moves nothing that began anew after it (see `body_status`): a stick that is held since
before must be let go first.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import isfinite

from w2b_core.controller.model import Controller
from w2b_core.status import Level, Status

#: Smaller shares of the full speed are none: sticks are never quite in the middle.
DEAD_SHARE = 0.1
#: To take over the other share must be larger by this factor: no gait starts twice a second.
TAKE_OVER = 1.2
STOP, FORWARD, BACKWARD, LEFT, RIGHT = 'stop', 'forward', 'backward', 'left', 'right'
#: A refusal is shown for this long.
SHOWN_S = 5.0


class TwistRefusedError(ValueError):
    """A velocity that is not followed; one line says what was expected, what came, what to do."""


@dataclass(frozen=True)
class Velocity:
    """
    A velocity of the base in its own frame (REP-103).

    `linear_m_s` is forward, left, up; `angular_rad_s` about these axes: the last turns left.
    """

    linear_m_s: Sequence[float]
    angular_rad_s: Sequence[float]


@dataclass(frozen=True)
class Full:
    """Speed forward in m/s and turn in rad/s that count as full."""

    speed_m_s: float
    turn_rad_s: float


def behaviour_of(velocity: Velocity, full: Full, before: str = STOP) -> str:
    """
    Return the behaviour that a velocity asks for.

    Parameters
    ----------
    velocity
        What is asked for.
    full
        What the shares are of.
    before
        The behaviour so far: it is kept while the shares are nearly equal.

    Raises
    ------
    TwistRefusedError
        If a number is not finite, or it asks for what no behaviour does.

    """
    forward, aside, up = velocity.linear_m_s
    roll, pitch, turn = velocity.angular_rad_s
    numbers = (*velocity.linear_m_s, *velocity.angular_rad_s)
    if not all(map(isfinite, numbers)):
        raise TwistRefusedError(f'expected finite numbers, got {", ".join(map(str, numbers))}')
    for name, value, limit, unit in (
            ('linear.y', aside, full.speed_m_s, 'm/s'), ('linear.z', up, full.speed_m_s, 'm/s'),
            ('angular.x', roll, full.turn_rad_s, 'rad/s'),
            ('angular.y', pitch, full.turn_rad_s, 'rad/s')):
        if abs(value) > DEAD_SHARE * limit:
            raise TwistRefusedError(f'expected linear.x and angular.z only, got {name} {value:g} '
                                    f'{unit}: no behaviour does this')
    straight, turning = abs(forward) / full.speed_m_s, abs(turn) / full.turn_rad_s
    if max(straight, turning) < DEAD_SHARE:
        return STOP
    if before in (FORWARD, BACKWARD):
        straight *= TAKE_OVER
    elif before in (LEFT, RIGHT):
        turning *= TAKE_OVER
    if straight >= turning:
        return FORWARD if forward > 0 else BACKWARD
    return LEFT if turn > 0 else RIGHT


class TwistDriver:
    """
    Decides which velocities are followed, and for how long.

    Parameters
    ----------
    words
        Behaviour -> the word that asks for it, of the behaviours that the controller knows.
    full, timeout_s
        See `Full`; how long a velocity lasts.
    clock
        Monotonic seconds.

    """

    def __init__(self, words: dict[str, str], full: Full, timeout_s: float,
                 clock: Callable[[], float]) -> None:
        self._words, self._full, self._timeout_s, self._clock = words, full, timeout_s, clock
        self._behaviour = ''
        self._came_at_s = float('-inf')
        self._refusal, self._refused_at_s = '', float('-inf')
        self._blocked, self._blocked_at_s = 'the brain began', clock()

    def configure(self, full: Full, timeout_s: float) -> None:
        """Take other parameters, see the class."""
        self._full, self._timeout_s = full, timeout_s

    @property
    def driving(self) -> bool:
        """Whether a velocity moves the robot."""
        return self._behaviour not in ('', STOP)

    def take(self, velocity: Velocity) -> str:
        """
        Take a velocity that has come; return the word to hear now.

        It is empty while the same behaviour goes on.

        Raises
        ------
        TwistRefusedError
            If it is not followed: a robot that it drove so far has to stand.

        """
        now_s = self._clock()
        quiet_s = now_s - max(self._came_at_s, self._blocked_at_s)
        self._came_at_s = now_s
        try:
            behaviour = behaviour_of(velocity, self._full, self._behaviour)
            if self._blocked and (behaviour == STOP or quiet_s > self._timeout_s):
                self._blocked = ''
            if self._blocked:
                raise TwistRefusedError(f'{self._blocked} since: let go first, with a Twist of '
                                        f'zero or none for {self._timeout_s:g} s')
            if behaviour != STOP and behaviour not in self._words:
                raise TwistRefusedError(f'expected one of {", ".join(self._words)}, which the '
                                        f'controller knows, got a Twist that asks for {behaviour}')
        except TwistRefusedError as error:
            self._behaviour = ''
            self._refusal, self._refused_at_s = str(error), now_s
            raise
        # Without a word for it, `stop` is to stand, as after the deadman.
        if behaviour == self._behaviour or (behaviour == STOP and not self.driving):
            return ''
        self._behaviour = behaviour
        return self._words.get(behaviour, '')

    def expired(self) -> str:
        """Return, once, why the robot has to stand: velocities ended without a zero; else ''."""
        if not self.driving or self._clock() - self._came_at_s <= self._timeout_s:
            return ''
        self._behaviour = ''
        return f'no Twist came for {self._timeout_s:g} s'

    def block(self, reason: str) -> bool:
        """Follow nothing that is held since before; return whether a velocity moved the robot."""
        moved, self._behaviour = self.driving, ''
        self._blocked, self._blocked_at_s = reason, self._clock()
        return moved

    def status(self, publishers: int) -> Status:
        """Return how it is; `publishers`: how many nodes publish velocities."""
        now_s, name = self._clock(), 'brain: cmd_vel'
        flows = now_s - self._came_at_s <= self._timeout_s
        if now_s - self._refused_at_s < SHOWN_S:
            return Status(Level.WARN, name, f'refused: {self._refusal}')
        if publishers > 1:
            return Status(Level.WARN, name, f'{publishers} nodes publish Twists: let twist_mux '
                          'choose, or stop all but one')
        doing = self._behaviour or 'nothing'
        return Status(Level.OK, name, f'Twists come: {doing}' if flows else 'no Twist comes')


def words_of(controller: Controller) -> dict[str, str]:
    """Return behaviour -> a word that the controller was trained to follow with it."""
    if controller.behaviours:
        return {name: name for name in controller.behaviours}
    return {word.behaviour: word.word for word in reversed(controller.words)}
