"""All open pages: what each gets, what each asks for, and which of them are lost."""

from __future__ import annotations

import asyncio
import itertools
import json
import time
from collections.abc import Callable
from typing import Any, Protocol

from aiohttp import WSMsgType, web

from w2b_web.client import MOST_MALFORMED, Client
from w2b_web.requests import URGENT, BadRequestError, Request, parse
from w2b_web.voice.listener import Listener
from w2b_web.voice.recogniser import is_there
from w2b_web.voice.talks import Talks

MOST_CLIENTS = 8
#: Between two signs of life that are asked for, and how long a page may owe one: a robot that it
#: moved stands within 2 s.
PING_S, LOST_S, CHECK_S = 0.5, 1.4, 0.1
#: A page that hangs this long has its connection ended; it comes back by itself.
GONE_S = 20.0


class Robots(Protocol):
    """What the pages' requests go to; called in the server's thread, returns at once."""

    def request(self, robot: str, request: Request, client: int) -> None:
        """Do what a page asks for."""

    def page_lost(self, client: int) -> None:
        """Stop what a page moved that can say nothing any more."""

    def suggest(self, robot: str, prefix: str) -> list[dict[str, str]]:
        """Return words that begin so."""


def message(kind: str, **values: Any) -> str:
    """Return a message to a page."""
    return json.dumps({'k': kind, **values}, separators=(',', ':'))


class Hub:
    """
    The open pages; to be used in the server's event loop, but for `from_ros`.

    Parameters
    ----------
    robots
        What the requests go to.
    clock
        Monotonic seconds.

    """

    def __init__(self, robots: Robots, clock: Callable[[], float] = time.monotonic) -> None:
        self._robots = robots
        self._clock = clock
        self._clients: dict[int, Client] = {}
        self._numbers = itertools.count(1)
        self._known: dict[str, dict[str, str]] = {'': {}}
        self._names: list[str] = ['']
        self._talks = Talks(
            Listener(), lambda page, kind, **values: self.tell_one(page, message(kind, **values)),
            lambda robot, word, page: robots.request(robot, Request('say', robot, word), page),
            clock)
        self.loop: asyncio.AbstractEventLoop | None = None
        #: Read by the other thread: the robots that somebody looks at.
        self.watched: frozenset[str] = frozenset()
        self.refused = 0

    def __len__(self) -> int:
        return len(self._clients)

    # -- from the robots, any thread

    def from_ros(self, act: Callable[..., None], *arguments: Any) -> None:
        """Call one of the methods below in the server's thread; in this one while none runs."""
        if self.loop is None or self.loop.is_closed():
            act(*arguments)
        else:
            self.loop.call_soon_threadsafe(act, *arguments)

    def robots(self, names: list[str]) -> None:
        """Tell all pages which robots there are."""
        self._names = names
        self._known = {name: self._known.get(name, {}) for name in names}
        for client in self._clients.values():
            client.tell(message('robots', names=names))

    def tell(self, robot: str, kind: str, text: str, *, keep: bool = True) -> None:
        """Tell the pages that show a robot; pages that come later get the newest of each kind."""
        if keep:
            self._known.setdefault(robot, {})[kind] = text
        for client in self._clients.values():
            if client.robot == robot:
                client.tell(text)

    def tell_one(self, client: int, text: str) -> None:
        """Tell one page, if it is still there."""
        if client in self._clients:
            self._clients[client].tell(text)

    def frame(self, robot: str, text: str) -> None:
        """Send a frame to the pages that show a robot."""
        for client in self._clients.values():
            if client.robot == robot:
                client.show(text)

    # -- from the pages

    async def serve(self, socket: web.WebSocketResponse,
                    transport: asyncio.Transport | None) -> None:
        """Serve one page until its connection ends."""
        client = Client(next(self._numbers), socket, transport, self._names[0], self._clock)
        self._clients[client.number] = client
        writer = asyncio.create_task(client.write())
        client.tell(message('hello', page=client.number, talk=is_there()))
        client.tell(message('robots', names=self._names))
        self._watch(client, client.robot)
        try:
            async for incoming in socket:
                if not (self._take(client, incoming.data) if incoming.type == WSMsgType.TEXT else
                        incoming.type == WSMsgType.BINARY and client.messages.allow()
                        and self._talks.take(client.number, incoming.data)):
                    break
        finally:
            del self._clients[client.number]
            self._update_watched()
            writer.cancel()
            self._talks.forget(client.number)
            self._robots.page_lost(client.number)

    def _take(self, client: Client, data: str) -> bool:
        """Do what a message asks for; return whether the connection goes on."""
        try:
            request = parse(data)
        except BadRequestError as error:
            client.malformed += 1
            client.tell(message('note', level='bad', text=f'not understood: {error}'))
            return client.malformed < MOST_MALFORMED
        robot = client.robot if request.robot is None else request.robot
        if request.do in URGENT:
            self._robots.request(robot, request, client.number)
            return True
        if not client.messages.allow():
            return False
        if request.do == 'pong':
            client.alive()
        elif request.do == 'watch':
            self._watch(client, request.robot or '')
        elif not client.commands.allow():
            if client.warnings.allow():
                client.tell(message('note', level='warn', text='more than 20 commands a second: '
                                    'some were left out'))
        elif request.do == 'talk':
            self._talks.begin(client.number, robot)
        elif request.do == 'talked':
            self._talks.end(client.number)
        elif request.do == 'suggest':
            words = self._robots.suggest(client.robot, request.text)
            client.tell(message('words', prefix=request.text, words=words))
        else:
            self._robots.request(robot, request, client.number)
        return True

    def _watch(self, client: Client, robot: str) -> None:
        if robot not in self._known:
            client.tell(message('note', level='warn', text=f'there is no robot {robot or "/"} '
                                'any more'))
            return
        client.robot = robot
        client.tell(message('watching', robot=robot))
        for text in self._known[robot].values():
            client.tell(text)
        self._update_watched()

    def _update_watched(self) -> None:
        self.watched = frozenset(client.robot for client in self._clients.values())

    # -- signs of life

    async def look_after(self) -> None:
        """Ask all pages for signs of life, for ever; stop what a lost page moved."""
        pinged_at_s = 0.0
        while True:
            await asyncio.sleep(CHECK_S)
            now_s = self._clock()
            if now_s - pinged_at_s >= PING_S:
                pinged_at_s = now_s
                for client in self._clients.values():
                    client.tell(message('ping'))
            for client in list(self._clients.values()):
                silent_s = client.silent_s()
                if silent_s > LOST_S and not client.lost:
                    client.lost = True
                    self._robots.page_lost(client.number)
                if silent_s > GONE_S:
                    client.end('no answer')

    async def close(self) -> None:
        """End all connections, and what listens."""
        for client in self._clients.values():
            client.end('the page is shut down')
        await self._talks.close()
