"""
What a body says of itself, and how targets say which of its epochs their word is from.

A body (simulated or physical) publishes a `BodyStatus` on the latched topic `body_status`. Its
`epoch` changes whenever what was said before counts no more: the body was armed, stopped, parked,
relaxed, faulted or started again. A brain forgets its word when the epoch changes, and marks each
of its targets with the epoch that the word was said in (a fencing token), so that the body itself
refuses to move on a word said before.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from w2b_core.status import Level, Status

TOPIC = 'body_status'
#: A target follows while it is younger than this many frames.
FRESH_PERIODS = 3
#: Begins the `header.frame_id` of targets that follow a word; its epoch comes behind it.
WORD_MARK = 'word@'
#: Of targets that hold the body still: no word was said, or none that counts.
STANDING_MARK = 'standing'
_EPOCH = re.compile(r'[0-9A-Za-z_.-]{1,64}')


class BodyStatusError(ValueError):
    """A status that is none of a body; one line says what is wrong."""


@dataclass(frozen=True)
class BodyStatus:
    """
    The state of a body.

    Attributes
    ----------
    body
        Its name, as in the controller file.
    state, reason
        State of its safety machine (`ACTIVE`, `DISARMED`, ...) or of its simulation (`RUNNING`,
        `PAUSED`), and a sentence for a person.
    follows
        Whether targets move it: armed and not paused, and the last target was accepted within
        `FRESH_PERIODS` periods.
    epoch, epoch_age_s
        Changes whenever what was said before counts no more; how long it had lasted when this was
        published.
    needs_arming
        Whether it has to be armed before it moves; a simulation need not.
    accepted_stamp_ns
        Stamp of the last accepted target, None before the first.

    """

    body: str
    state: str
    reason: str
    follows: bool
    epoch: str
    needs_arming: bool
    accepted_stamp_ns: int | None = None
    epoch_age_s: float = 0.0

    def to_status(self, node: str) -> Status:
        """Return it as a status of the node `node`: OK only while the body follows."""
        stamp = self.accepted_stamp_ns
        return Status(Level.OK if self.follows else Level.WARN, f'{node}: body',
                      f'{self.state}: {self.reason}', {
                          'body': self.body, 'state': self.state, 'reason': self.reason,
                          'follows': _text(self.follows), 'epoch': self.epoch,
                          'epoch_age_s': f'{self.epoch_age_s:.3f}',
                          'needs_arming': _text(self.needs_arming),
                          'accepted_stamp_ns': 'none' if stamp is None else str(stamp)})

    @classmethod
    def from_values(cls, values: Mapping[str, str]) -> BodyStatus:
        """
        Return the state that a status's values hold.

        Raises
        ------
        BodyStatusError
            If a value is missing or is not of its kind.

        """
        def of(key: str) -> str:
            if key not in values:
                raise BodyStatusError(f'{TOPIC}: expected a value {key!r}, '
                                      f'got {", ".join(sorted(values)[:8]) or "none"}')
            return values[key]

        def flag(key: str) -> bool:
            if of(key) not in ('true', 'false'):
                raise BodyStatusError(f'{TOPIC}: {key}: expected true or false, '
                                      f'got {of(key)[:40]!r}')
            return of(key) == 'true'

        if _EPOCH.fullmatch(of('epoch')) is None:
            raise BodyStatusError(f'{TOPIC}: epoch: expected letters and digits, '
                                  f'got {of("epoch")[:40]!r}')
        stamp = of('accepted_stamp_ns')
        if stamp != 'none' and not re.fullmatch(r'-?\d{1,19}', stamp, re.ASCII):
            raise BodyStatusError(f'{TOPIC}: accepted_stamp_ns: expected nanoseconds or none, '
                                  f'got {stamp[:40]!r}')
        if not re.fullmatch(r'\d{1,12}(\.\d{1,9})?', of('epoch_age_s'), re.ASCII):
            raise BodyStatusError(f'{TOPIC}: epoch_age_s: expected seconds, '
                                  f'got {of("epoch_age_s")[:40]!r}')
        return cls(of('body'), of('state'), of('reason'), flag('follows'), of('epoch'),
                   flag('needs_arming'), None if stamp == 'none' else int(stamp),
                   float(of('epoch_age_s')))


def mark(epoch: str | None) -> str:
    """
    Return the mark of targets: of a word said in an epoch, or of a body that stands (None).

    A word that was said before the body's state was known has the empty epoch.
    """
    return STANDING_MARK if epoch is None else f'{WORD_MARK}{epoch}'


def marked_epoch(text: str) -> str | None:
    """Return the epoch of the word that targets with this mark follow; None if they follow none."""
    return text.removeprefix(WORD_MARK) if text.startswith(WORD_MARK) else None


def _text(value: bool) -> str:
    return 'true' if value else 'false'
