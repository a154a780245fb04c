"""The web server: a handful of files and one WebSocket, in a thread of its own."""

from __future__ import annotations

import asyncio
import errno
import gzip
import threading
from collections.abc import Awaitable, Callable
from concurrent.futures import Future
from contextlib import suppress
from importlib import resources

from aiohttp import WSCloseCode, web

from w2b_ros.ros_process import StartError
from w2b_web import security
from w2b_web.hub import MOST_CLIENTS, Hub
from w2b_web.rate import Rate
from w2b_web.requests import LARGEST_MESSAGE
from w2b_web.security import Access

TYPES = {'html': 'text/html', 'js': 'text/javascript', 'css': 'text/css', 'svg': 'image/svg+xml',
         'txt': 'text/plain'}
#: What `browser/build.mjs` makes, and what is served as it is written: that counts, where an
#: earlier build has left a page of the same name in `static`.
FOLDERS = ('static', 'html')
#: Served to a person who has not shown the secret yet.
PUBLIC = frozenset({'/login', '/login.html', '/page.css', '/icon.svg'})
COOKIE = 'w2b'
LOGINS_PER_S = 0.2
START_S = 10.0
Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


def files() -> dict[str, tuple[str, bytes]]:
    """Return what is served: path -> content type and content."""
    return {f'/{file.name}': (TYPES[file.name.rpartition('.')[2]], file.read_bytes())
            for folder in FOLDERS for file in (resources.files('w2b_web') / folder).iterdir()
            if file.name.rpartition('.')[2] in TYPES}


class Server:
    """
    Serves the page until it is closed.

    Parameters
    ----------
    access
        Who may open it, and where.
    hub
        The open pages.

    """

    def __init__(self, access: Access, hub: Hub) -> None:
        self.access = access
        self._hub = hub
        self._files = files()
        self._zipped = {path: gzip.compress(body, 6) for path, (_type, body) in
                        self._files.items() if len(body) > 1000}
        self._headers = security.headers(access)
        self._logins: Rate | None = None
        self._opening = 0
        self._loop = asyncio.new_event_loop()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Listen (StartError if the port is taken)."""
        started: Future[None] = Future()
        self._thread = threading.Thread(target=self._run, args=(started,), daemon=True,
                                        name='web server')
        self._thread.start()
        started.result(START_S)

    def close(self) -> None:
        """End all connections and stop listening."""
        if self._thread is None:
            return
        with suppress(RuntimeError):
            self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(3.0)
        self._thread = None

    def _run(self, started: Future[None]) -> None:
        asyncio.set_event_loop(self._loop)
        runner = None
        try:
            runner = self._loop.run_until_complete(self._listen())
        except OSError as error:
            started.set_exception(StartError(self._why_not(error)))
        except BaseException as error:
            started.set_exception(error)
        if runner is None:
            self._loop.close()
            return
        self._hub.loop = self._loop
        looking = self._loop.create_task(self._hub.look_after())
        started.set_result(None)
        self._loop.run_forever()
        looking.cancel()
        self._loop.run_until_complete(self._hub.close())
        self._loop.run_until_complete(runner.cleanup())
        self._loop.close()

    def _why_not(self, error: OSError) -> str:
        place = f'{self.access.host}:{self.access.port}'
        if error.errno == errno.EADDRINUSE:
            return (f'port: {place} is in use, by another page most likely: stop that one, or '
                    f'choose another port (-p port:={self.access.port + 1})')
        return f'host, port: expected an address to listen on, got {place} ({error})'

    async def _listen(self) -> web.AppRunner:
        application = web.Application(middlewares=[self._guard],
                                      client_max_size=LARGEST_MESSAGE)
        application.router.add_get('/ws', self._socket)
        application.router.add_get('/{name:[a-z0-9._-]*}', self._file)
        if self.access.secret:
            self._logins = Rate(LOGINS_PER_S, self._loop.time)
            application.router.add_post('/login', self._login)
        runner = web.AppRunner(application, access_log=None, shutdown_timeout=1.0,
                               keepalive_timeout=15.0)
        await runner.setup()
        try:
            await web.TCPSite(runner, self.access.host, self.access.port,
                              ssl_context=self.access.tls).start()
        except OSError:
            await runner.cleanup()
            raise
        return runner

    @web.middleware
    async def _guard(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        try:
            if not self.access.allows_host(request.headers.get('Host')):
                raise web.HTTPForbidden(text='Host: not a name of this server (parameter names)')
            if request.path not in PUBLIC and not self.access.allows_session(
                    request.cookies.get(COOKIE)):
                if request.path == '/':
                    raise web.HTTPSeeOther('/login.html')
                raise web.HTTPForbidden(text='log in first')
            response = await handler(request)
        except web.HTTPException as error:
            error.headers.update(self._headers)
            raise
        if not response.prepared:
            response.headers.update(self._headers)
        return response

    async def _file(self, request: web.Request) -> web.Response:
        path = '/index.html' if request.path == '/' else request.path
        if path not in self._files:
            raise web.HTTPNotFound
        kind, body = self._files[path]
        if path == '/index.html':
            body = body.replace(b'@TOKEN@', self.access.token.encode())
        elif path in self._zipped and 'gzip' in request.headers.get('Accept-Encoding', ''):
            return web.Response(body=self._zipped[path], content_type=kind, charset='utf-8',
                                headers={'Content-Encoding': 'gzip'})
        return web.Response(body=body, content_type=kind, charset='utf-8')

    async def _login(self, request: web.Request) -> web.Response:
        if not self.access.allows_origin(request.headers.get('Origin')):
            raise web.HTTPForbidden(text='Origin: not this page')
        assert self._logins is not None
        if not self._logins.allow():
            raise web.HTTPTooManyRequests(text='one try every 5 seconds')
        given = (await request.post()).get('secret', '')
        if not isinstance(given, str) or not security.same(given, self.access.secret):
            raise web.HTTPSeeOther('/login.html')
        response = web.Response(status=303, headers={'Location': '/'})
        response.set_cookie(COOKIE, self.access.session, httponly=True, samesite='Strict',
                            secure=self.access.tls is not None)
        return response

    async def _socket(self, request: web.Request) -> web.StreamResponse:
        if not self.access.allows_origin(request.headers.get('Origin')):
            raise web.HTTPForbidden(text='Origin: not this page')
        offered = request.headers.get('Sec-WebSocket-Protocol', '').split(',')
        if not self.access.allows_token([one.strip() for one in offered]):
            raise web.HTTPForbidden(text='token: not that of this page; load it again')
        full = len(self._hub) + self._opening >= MOST_CLIENTS
        socket = web.WebSocketResponse(protocols=('w2b',), max_msg_size=LARGEST_MESSAGE,
                                       compress=False, timeout=1.0)
        self._opening += not full
        try:
            await socket.prepare(request)
        finally:
            self._opening -= not full
        if full:
            self._hub.refused += 1
            # A browser shows a person the reason of an end, not that of a refusal.
            await socket.close(code=WSCloseCode.TRY_AGAIN_LATER,
                               message=f'{MOST_CLIENTS} pages are open already'.encode())
        else:
            await self._hub.serve(socket, request.transport)
        return socket
