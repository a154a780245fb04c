"""
The clocks that frames can run by: the machine's, or one that waits for the brain.

On the robot time passes even if a node is late. On a simulated body time can stand still instead: a
stepped clock goes on when the targets that answer a frame are there, so that a busy machine makes
a run slow and not wrong.
"""

from __future__ import annotations

import threading
import time
from enum import Enum
from typing import Protocol

#: A frame's answer takes so long on a Pi; the stepped clock lets it take as long.
ANSWER_S = 0.003
#: Real time after which an answer is not waited for any more.
PATIENCE_S = 3.0


class Answer(Enum):
    """What is known of the answer to the last frame."""

    AWAITED = 'awaited'
    CAME = 'came'
    #: Nobody answers.
    NONE = 'none'


class Clock(Protocol):
    """Seconds that only go forward, and waiting by them."""

    def now(self) -> float:
        """Return the time."""

    def stamp_ns(self) -> int:
        """Return the time as a stamp of messages."""

    def wait_until(self, condition: threading.Condition, until_s: float, answer: Answer) -> bool:
        """
        Wait until a time, or until `condition`, which is held, is notified; return whether it was.

        `answer` is what is known of the answer to the last frame.
        """


class WallClock:
    """The machine's monotonic clock; stamps are of its wall clock."""

    def now(self) -> float:
        """See `Clock`."""
        return time.monotonic()

    def stamp_ns(self) -> int:
        """See `Clock`."""
        return time.time_ns()

    def wait_until(self, condition: threading.Condition, until_s: float, answer: Answer) -> bool:
        """See `Clock`."""
        return condition.wait(max(0.0, until_s - time.monotonic()))


class SteppedClock:
    """
    Time goes on when what is awaited is there.

    Parameters
    ----------
    real_time_factor
        Its seconds in a second of the machine, at most; 0 for as fast as answers come. Without
        answers it is never faster than the machine's clock.

    """

    def __init__(self, real_time_factor: float = 1.0) -> None:
        self._factor = real_time_factor
        self._now_s = 1.0
        self._stepped_at_s = time.monotonic()
        self._base_ns = time.time_ns() - round(self._now_s * 1e9)

    def now(self) -> float:
        """See `Clock`."""
        return self._now_s

    def stamp_ns(self) -> int:
        """See `Clock`; the stamps begin at the machine's time."""
        return self._base_ns + round(self._now_s * 1e9)

    def wait_until(self, condition: threading.Condition, until_s: float, answer: Answer) -> bool:
        """See `Clock`."""
        came = condition.wait(PATIENCE_S if answer is Answer.AWAITED
                              else self._pause_s(until_s, answer))
        if came:
            self._now_s = max(self._now_s, min(until_s, self._now_s + ANSWER_S))
            return True
        self._now_s = max(self._now_s, until_s)
        self._stepped_at_s = time.monotonic()
        return False

    def _pause_s(self, until_s: float, answer: Answer) -> float:
        """Return how long to wait in real time before the step."""
        if self._factor == 0.0 and answer is Answer.CAME:
            return 0.0
        due_s = self._stepped_at_s + (until_s - self._now_s) / (self._factor or 1.0)
        return max(0.0, due_s - time.monotonic())
