"""One open page: what waits to be sent to it, how often it may ask, whether it is still alive."""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress

from aiohttp import WSCloseCode, web

from w2b_web.rate import Rate

COMMANDS_PER_S = 20.0
#: Of all messages, answers to a sign of life included; above it the connection ends.
MESSAGES_PER_S = 200.0
#: Messages that wait for a slow connection; frames do not: only the newest does.
MOST_WAITING = 64
#: Messages that are none of the page's, until the connection ends.
MOST_MALFORMED = 20
#: A message that cannot be sent within this time ends the connection.
SEND_S = 10.0


class Client:
    """
    One open page.

    Parameters
    ----------
    number
        Tells it from the others.
    socket
        Its connection.
    transport
        What the connection goes over.
    robot
        Namespace of the robot that it shows.
    clock
        Monotonic seconds.

    """

    def __init__(self, number: int, socket: web.WebSocketResponse,
                 transport: asyncio.Transport | None, robot: str,
                 clock: Callable[[], float] = time.monotonic) -> None:
        self.number = number
        self.robot = robot
        self.commands = Rate(COMMANDS_PER_S, clock)
        self.messages = Rate(MESSAGES_PER_S, clock)
        self.warnings = Rate(1.0, clock)
        self.malformed = 0
        self.answered_at_s = clock()
        self.lost = False
        self._socket = socket
        self._transport = transport
        self._clock = clock
        self._waiting: deque[str] = deque()
        self._frame: str | None = None
        self._news = asyncio.Event()
        self._reason = ''

    def alive(self) -> None:
        """Note that the page itself, not just its connection, answered."""
        self.answered_at_s = self._clock()
        self.lost = False

    def silent_s(self) -> float:
        """Return for how long the page has not answered."""
        return self._clock() - self.answered_at_s

    def tell(self, text: str) -> None:
        """Send a message, in order; a page that takes none is let go."""
        self._waiting.append(text)
        if len(self._waiting) > MOST_WAITING:
            self.end('too slow')
        self._news.set()

    def show(self, frame: str) -> None:
        """Send a frame, unless a newer one comes before it can be sent."""
        self._frame = frame
        self._news.set()

    def end(self, reason: str) -> None:
        """Close the connection soon."""
        self._reason = reason
        self._waiting.clear()
        self._news.set()

    async def write(self) -> None:
        """Send what waits, until the connection ends."""
        while not self._socket.closed:
            await self._news.wait()
            self._news.clear()
            try:
                async with asyncio.timeout(SEND_S):
                    await self._send()
            except TimeoutError:
                self._reason = 'too slow'
            except (ConnectionError, RuntimeError):
                return
            if self._reason:
                await self._close()
                return

    async def _send(self) -> None:
        while self._waiting:
            await self._socket.send_str(self._waiting.popleft())
        frame, self._frame = self._frame, None
        if frame is not None and not self._reason:
            await self._socket.send_str(frame)

    async def _close(self) -> None:
        with suppress(TimeoutError, ConnectionError, RuntimeError):
            async with asyncio.timeout(1.0):
                await self._socket.close(code=WSCloseCode.POLICY_VIOLATION,
                                         message=self._reason.encode()[:120])
        # One that reads nothing does not even take the farewell.
        if self._transport is not None:
            self._transport.abort()
