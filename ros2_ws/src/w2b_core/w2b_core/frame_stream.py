"""Which sensor frames are new, by their stamps: the brain has no clock of its own."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum

#: A frame further ahead than this is no successor while frames flow.
LARGEST_LEAP_PERIODS = 100
#: What the first frame may take beyond the timeout: nodes have to find each other, and a body that
#: waits for targets sends its frame but twice a second.
FIRST_FRAME_S = 1.0


class Verdict(Enum):
    """What a frame's stamp makes it."""

    NEXT = 'the next frame'
    REPEATED = 'the last frame again: the answer to it was lost'
    STALE = 'older than the last frame'
    LEAP = 'far ahead of the last frame'
    RESTARTED = 'the first frame of a stream that starts over'


class FrameStream:
    """
    Judges the stamps of frames in the order of their arrival.

    While frames flow, a stamp has to grow, and not by more than `LARGEST_LEAP_PERIODS`. After
    `timeout_s` without an accepted frame the stream counts as lost; then the next frame is
    accepted: as the next one if its stamp is later, else as the start of another stream, such as
    that of a simulation that was started again.
    """

    def __init__(self, period_s: float, timeout_s: float, clock: Callable[[], float]) -> None:
        self._leap_ns = round(LARGEST_LEAP_PERIODS * period_s * 1e9)
        #: May change while frames flow.
        self.timeout_s = timeout_s
        self._clock = clock
        self._last_stamp_ns: int | None = None
        self._accepted_at_s = clock()

    @property
    def last_stamp_ns(self) -> int | None:
        """Stamp of the last accepted frame, None before the first."""
        return self._last_stamp_ns

    @property
    def lost(self) -> bool:
        """Whether no frame was accepted within the timeout, or none at all, and for longer."""
        longest_s = self.timeout_s + (FIRST_FRAME_S if self._last_stamp_ns is None else 0.0)
        return self._clock() - self._accepted_at_s > longest_s

    def judge(self, stamp_ns: int) -> Verdict:
        """Return what the frame with this stamp is, and remember it if it is accepted."""
        verdict = self._verdict(stamp_ns)
        if verdict not in (Verdict.STALE, Verdict.LEAP):
            self._last_stamp_ns = stamp_ns
            self._accepted_at_s = self._clock()
        return verdict

    def _verdict(self, stamp_ns: int) -> Verdict:
        last = self._last_stamp_ns
        if last is None:
            return Verdict.NEXT
        if stamp_ns == last:
            return Verdict.REPEATED
        if stamp_ns < last:
            return Verdict.RESTARTED if self.lost else Verdict.STALE
        if stamp_ns - last > self._leap_ns and not self.lost:
            return Verdict.LEAP
        return Verdict.NEXT
