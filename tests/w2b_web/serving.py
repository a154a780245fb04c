"""A page's server on a free port, and what its pages asked for."""

import asyncio
import json
import socket
import threading
import time
from contextlib import asynccontextmanager

import aiohttp

from w2b_web.hub import Hub
from w2b_web.security import access
from w2b_web.server import Server

DEADLINE_S = 20.0


def free_port():
    with socket.socket() as probe:
        probe.bind(('127.0.0.1', 0))
        return probe.getsockname()[1]


class Asked:
    """What the pages asked for, and which were lost, with the time."""

    def __init__(self):
        self.requests, self.lost, self._lock = [], [], threading.Lock()

    def request(self, robot, request, client):
        with self._lock:
            self.requests.append((robot, request, client))

    def page_lost(self, client):
        with self._lock:
            self.lost.append((client, time.monotonic()))

    def suggest(self, robot, prefix):
        return [{'word': f'{prefix}ward', 'behaviour': ''}]

    def count(self, do):
        with self._lock:
            return sum(request.do == do for _robot, request, _client in self.requests)


class Serving:
    """A server that runs; as a context manager it ends."""

    def __init__(self, **options):
        self.asked = Asked()
        self.hub = Hub(self.asked)
        self.hub.robots([''])
        self.access = access(options.pop('host', '127.0.0.1'), free_port(), **options)
        self.server = Server(self.access, self.hub)

    def __enter__(self):
        self.server.start()
        return self

    def __exit__(self, *_):
        self.server.close()

    @property
    def port(self):
        return self.access.port

    @property
    def origin(self):
        return f'{self.access.scheme}://127.0.0.1:{self.port}'

    def publish(self, text):
        """Send a frame to all pages, as the robot's thread does."""
        self.hub.from_ros(self.hub.frame, '', text)

    @asynccontextmanager
    async def page(self, session, **changes):
        """Connect as the page does, with changed headers or another token."""
        origin = changes.pop('origin', self.origin)
        token = changes.pop('token', self.access.token)
        headers = {**({} if origin is None else {'Origin': origin}), **changes.pop('headers', {})}
        protocols = ('w2b',) if token is None else ('w2b', token)
        async with session.ws_connect(f'{self.origin}/ws', headers=headers, protocols=protocols,
                                      **changes) as connected:
            yield connected

    async def takes_a_word(self, page):
        """Say the first word on a page, and wait until it has arrived."""
        await page.send_json({'do': 'say', 'text': 'march'})
        await until(lambda: self.asked.count('say') == 1, 'the word')


async def until(condition, what):
    """Wait for a condition."""
    end_s = time.monotonic() + DEADLINE_S
    while not condition():
        assert time.monotonic() < end_s, what
        await asyncio.sleep(0.01)


async def heard(connected, kind):
    """Return the next message of a kind."""
    async with asyncio.timeout(DEADLINE_S):
        while True:
            incoming = await connected.receive()
            assert incoming.type == aiohttp.WSMsgType.TEXT, incoming
            message = json.loads(incoming.data)
            if message['k'] == kind:
                return message
