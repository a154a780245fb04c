"""How often something may happen."""

from __future__ import annotations

from collections.abc import Callable


class Rate:
    """
    A token bucket.

    Parameters
    ----------
    per_s
        How often it may happen a second in the long run, and at once (once at least).
    clock
        Monotonic seconds.

    """

    def __init__(self, per_s: float, clock: Callable[[], float]) -> None:
        self._per_s = per_s
        self._clock = clock
        self._most = self._left = max(1.0, per_s)
        self._at_s = clock()

    def allow(self) -> bool:
        """Return whether it may happen now, and count it if so."""
        now_s = self._clock()
        self._left = min(self._most, self._left + (now_s - self._at_s) * self._per_s)
        self._at_s = now_s
        if self._left < 1.0:
            return False
        self._left -= 1.0
        return True
