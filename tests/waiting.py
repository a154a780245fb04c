"""How tests wait: for a condition, with a deadline."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

Found = TypeVar('Found')
#: Between two looks.
LOOK_S = 0.02


def wait_until(condition: Callable[[], Found], what: str, deadline_s: float = 120.0) -> Found:
    """Return the first value of `condition` that is true (AssertionError after `deadline_s`)."""
    end_s = time.monotonic() + deadline_s
    while not (found := condition()):
        assert time.monotonic() < end_s, f'{what} did not come within {deadline_s:g} s'
        time.sleep(LOOK_S)
    return found
