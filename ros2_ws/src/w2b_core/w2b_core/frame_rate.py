"""Whether frames come at the controller's rate, by their stamps: a network has no other clock."""

from __future__ import annotations

from collections import deque
from statistics import median

#: A gap between two frames is right within this share of the period: jitter, and a frame in haste.
TOLERANCE = 0.25
#: Gaps that are looked at.
WINDOW = 10


class FrameRate:
    """The gaps between the last frames; one that was lost, or came late, does not count."""

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        self._gaps_s: deque[float] = deque(maxlen=WINDOW)

    def restart(self) -> None:
        """Forget the gaps: frames were missing, or started over."""
        self._gaps_s.clear()

    def take(self, gap_ns: int) -> None:
        """Take the time between a frame and the one before it."""
        self._gaps_s.append(gap_ns / 1e9)

    @property
    def fault(self) -> str:
        """What is wrong with most of the last gaps, with both numbers; empty if nothing is."""
        if len(self._gaps_s) < WINDOW:
            return ''
        usual_s = median(self._gaps_s)
        if not self._off(usual_s):
            return ''
        return (f'sensor frames come at {1 / usual_s:.3g} Hz, the controller is for '
                f'{1 / self._period_s:.3g} Hz')

    @property
    def steady(self) -> bool:
        """Whether all of the last gaps are too short, or all too long."""
        sides = {self._off(gap_s) for gap_s in self._gaps_s}
        return len(self._gaps_s) == WINDOW and sides in ({-1}, {1})

    def _off(self, gap_s: float) -> int:
        """Return -1 for a gap that is too short, 1 for one that is too long, 0 for a right one."""
        share = gap_s / self._period_s
        return (share > 1 + TOLERANCE) - (share < 1 - TOLERANCE)
