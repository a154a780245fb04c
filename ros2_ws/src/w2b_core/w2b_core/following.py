"""Whether a body follows the word that the brain heard, and if not, why."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from w2b_core.body_status import BodyStatus
from w2b_core.shell import w2b_command

#: A body publishes its status every 0.2 s; one that was silent for this long counts as gone.
BODY_SILENT_S = 1.0
#: States of a body that do not end by themselves: somebody has to arm it or to let it go on.
SETTLED = frozenset({'PAUSED', 'DISARMED', 'FAULT', 'INACTIVE'})
#: A body that runs is discovered within this time after the brain began.
DISCOVERY_S = 4.0
NO_BODY = f'no body is there: start one with `{w2b_command("sim")}` or `{w2b_command("hardware")}`'


class Follows(Enum):
    """Whether a body follows; the values are those of `body_follows` in the answer to a command."""

    YES = 'true'
    PENDING = 'pending'
    NO = 'false'


@dataclass(frozen=True)
class Following:
    """Whether a body follows the last word; `reason` says why not, empty if it does."""

    follows: Follows
    reason: str
    body_state: str = 'none'

    def to_values(self) -> dict[str, str]:
        """Return it as values of the answer to a command."""
        return {'body_follows': self.follows.value, 'body_state': self.body_state,
                'why_not': self.reason}


class BodyWatch:
    """
    The last status of the body, as long as the body still sends it.

    Parameters
    ----------
    clock
        Monotonic seconds.

    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._began_s = clock()
        self._status: BodyStatus | None = None
        self._taken_at_s = float('-inf')

    def take(self, status: BodyStatus) -> None:
        """Remember a status."""
        self._status, self._taken_at_s = status, self._clock()

    @property
    def last(self) -> BodyStatus | None:
        """The last status, however old; None before the first."""
        return self._status

    @property
    def now(self) -> BodyStatus | None:
        """The last status, None if the body has been silent for too long."""
        silent_s = self._clock() - self._taken_at_s
        return None if silent_s > BODY_SILENT_S else self._status

    @property
    def state(self) -> str:
        """The body's state; none if it is silent."""
        return 'none' if self.now is None else self.now.state

    @property
    def paused(self) -> bool:
        """Whether the body is a paused simulation."""
        return self.state == 'PAUSED'

    def following(self, word_stamp_ns: int | None, *, there: bool, frames_fault: str) -> Following:
        """
        Return whether the body follows a word.

        Parameters
        ----------
        word_stamp_ns
            Stamp of the first target that follows the word; None if there was none yet.
        there
            Whether anything publishes on the body's status topic.
        frames_fault
            Why no sensor frames are answered; empty while they are.

        """
        status = self.now
        if status is None:
            if not there:
                young = self._clock() - self._began_s < DISCOVERY_S
                return Following(Follows.PENDING if young else Follows.NO, NO_BODY)
            if self._status is None:
                return Following(Follows.PENDING, 'the body has not said yet how it is')
            return Following(Follows.PENDING, 'the body does not say any more how it is')
        if status.state in SETTLED:
            todo = ('arm it, then say the word again' if status.needs_arming else
                    'let it go on with its service ~/pause')
            return Following(Follows.NO, f'the body {status.body} is {status.state} '
                             f'({status.reason}): {todo}', status.state)
        if frames_fault:
            return Following(Follows.NO, frames_fault, status.state)
        accepted_ns = status.accepted_stamp_ns
        accepted = (word_stamp_ns is not None and accepted_ns is not None
                    and accepted_ns >= word_stamp_ns)
        if accepted and status.follows:
            return Following(Follows.YES, '', status.state)
        why = 'its last target is too old' if accepted else \
            'it has accepted no target that follows the word'
        return Following(Follows.PENDING, f'the body {status.body} is {status.state} '
                         f'({status.reason}): {why}', status.state)
