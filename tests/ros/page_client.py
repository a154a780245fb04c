"""What a browser's page does on its connection, without a browser; it can hang, and be cut off."""

from __future__ import annotations

import asyncio
import json
import re
import socket
import threading
import time
import urllib.request
from typing import Any

import aiohttp

DEADLINE_S = 60.0


class PageClient:
    """A page that is open, in a thread of its own."""

    def __init__(self, port: int) -> None:
        self.messages: list[tuple[float, dict[str, Any]]] = []
        #: Whether the page answers signs of life; without it its browser hangs.
        self.alive = True
        self._address = f'http://127.0.0.1:{port}'
        with urllib.request.urlopen(self._address) as response:
            self._token = re.search(r'name="token" content="([^"]*)"',
                                    response.read().decode())[1]
        self._loop = asyncio.new_event_loop()
        self._socket: aiohttp.ClientWebSocketResponse | None = None
        self._opened = threading.Event()
        self._thread = threading.Thread(target=self._loop.run_until_complete,
                                        args=(self._serve(),), daemon=True)
        self._thread.start()
        assert self._opened.wait(DEADLINE_S)

    async def _serve(self) -> None:
        async with aiohttp.ClientSession() as session, session.ws_connect(
                f'{self._address}/ws', headers={'Origin': self._address},
                protocols=('w2b', self._token)) as self._socket:
            self._opened.set()
            async for incoming in self._socket:
                message = json.loads(incoming.data)
                self.messages.append((time.monotonic(), message))
                if message['k'] == 'ping' and self.alive:
                    await self._socket.send_json({'do': 'pong', 'number': 0})

    def send(self, do: str, **values: Any) -> None:
        assert self._socket is not None
        asyncio.run_coroutine_threadsafe(
            self._socket.send_json({'do': do, **values}), self._loop).result(DEADLINE_S)

    def last(self, kind: str) -> dict[str, Any]:
        """Return the newest message of a kind, empty if there was none."""
        return next((message for _at, message in reversed(self.messages)
                     if message['k'] == kind), {})

    def notes(self) -> str:
        return '\n'.join(message['text'] for _at, message in self.messages
                         if message['k'] == 'note')

    def frames(self) -> int:
        return sum(message['k'] == 'f' for _at, message in self.messages)

    def close(self) -> None:
        if self._thread.is_alive():
            assert self._socket is not None
            asyncio.run_coroutine_threadsafe(self._socket.close(), self._loop)
            self._thread.join(DEADLINE_S)

    def cut(self) -> None:
        """End the connection as a network does that is gone: without a farewell."""
        assert self._socket is not None
        transport = self._socket.get_extra_info('socket')
        self._loop.call_soon_threadsafe(transport.shutdown, socket.SHUT_RDWR)
        self._thread.join(DEADLINE_S)
