"""Which page moved a robot, so that it stands when that page is lost."""

from __future__ import annotations

import time
from collections.abc import Callable

#: A word that is not answered by then was not heard.
ANSWERED_S = 5.0


class Senders:
    """
    The pages that said words to one robot, and which of them it follows.

    Parameters
    ----------
    clock
        Monotonic seconds.

    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._said: dict[int, tuple[str, float]] = {}
        self._mover: int | None = None

    def said(self, page: int, text: str) -> None:
        """Note that a page said something, which is not answered yet."""
        self._said[page] = (text, self._clock())

    def understood(self, text: str, moves: bool) -> None:
        """Note that the brain follows a text now, whoever said it, and whether it moves."""
        pages = [page for page, (said, at_s) in self._said.items() if said == text]
        self._mover = pages[-1] if pages and moves else None
        for page in pages:
            del self._said[page]

    def refused(self, text: str) -> None:
        """Note that a text changed nothing."""
        self._said = {page: entry for page, entry in self._said.items() if entry[0] != text}

    def stopped(self) -> None:
        """Note that the robot follows no word any more."""
        self._mover = None

    def lost(self, page: int) -> bool:
        """Forget a page; return whether the robot moves, or may move, because of it."""
        said, moved = self._said.pop(page, None), self._mover == page
        if moved:
            self._mover = None
        return moved or (said is not None and self._clock() - said[1] < ANSWERED_S)
