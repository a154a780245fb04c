"""The page's server under attack: what it refuses, and that others are served all the while."""

import asyncio
import json
import socket
import time

import aiohttp
import pytest

from tests.w2b_web.serving import DEADLINE_S, Serving, heard, until
from w2b_ros.ros_process import StartError
from w2b_web.client import MOST_MALFORMED
from w2b_web.hub import MOST_CLIENTS
from w2b_web.requests import LARGEST_MESSAGE
from w2b_web.security import access


@pytest.fixture
def serving():
    with Serving() as running:
        yield running


def run(attack):
    async def limited():
        async with asyncio.timeout(4 * DEADLINE_S), aiohttp.ClientSession() as session:
            await attack(session)
    asyncio.run(limited())


def raw(serving, request):
    """Send bytes, return all that comes back."""
    with socket.create_connection(('127.0.0.1', serving.port), DEADLINE_S) as connection:
        connection.sendall(request)
        received = b''
        while chunk := connection.recv(65536):
            received += chunk
    return received


def get(serving, path, host=None):
    host = host or f'127.0.0.1:{serving.port}'
    return raw(serving, f'GET {path} HTTP/1.1\r\nHost: {host}\r\n'
               'Connection: close\r\n\r\n'.encode())


def test_the_page_works_for_its_own(serving):
    async def attack(session):
        async with serving.page(session) as page:
            assert page.protocol == 'w2b'
            await heard(page, 'robots')
            await serving.takes_a_word(page)
            await page.send_json({'do': 'suggest', 'text': 'for'})
            assert (await heard(page, 'words'))['words'] == [{'word': 'forward', 'behaviour': ''}]
    run(attack)


@pytest.mark.parametrize('changes', [
    {'origin': 'http://evil.example'}, {'origin': 'null'}, {'origin': None},
    {'origin': 'https://127.0.0.1:{port}'}, {'origin': 'http://127.0.0.1:{port}.evil.example'},
    {'origin': 'http://127.0.0.1'}, {'origin': 'http://localhost.evil.example:{port}'},
    {'token': None}, {'token': ''}, {'token': 'x' * 32}, {'token': 'w2b'},
    {'headers': {'Host': 'evil.example'}}, {'headers': {'Host': '192.168.0.7:{port}'}},
    {'headers': {'Host': '127.0.0.1:1'}}], ids=str)
def test_a_foreign_connection_is_refused(serving, changes):
    changes = json.loads(json.dumps(changes).replace('{port}', str(serving.port)))

    async def attack(session):
        with pytest.raises(aiohttp.WSServerHandshakeError) as raised:
            async with serving.page(session, **changes):
                pass
        assert raised.value.status == 403
    run(attack)
    assert not serving.asked.requests


@pytest.mark.parametrize('host', ['evil.example', 'evil.example:{port}', '127.0.0.1:80', '',
                                  '127.0.0.1.evil.example:{port}'])
def test_a_wrong_host_gets_no_page_and_no_token(serving, host):
    answer = get(serving, '/', host.format(port=serving.port) or ' ')
    assert answer.startswith((b'HTTP/1.1 403', b'HTTP/1.0 400', b'HTTP/1.1 400'))
    assert serving.access.token.encode() not in answer


@pytest.mark.parametrize('path', [
    '/../../../../etc/passwd', '/..%2f..%2f..%2fetc/passwd', '/%2e%2e/%2e%2e/etc/passwd',
    '/static/../server.py', '//etc/passwd', '/....//....//etc/passwd', '/manifest.json',
    '/server.py', '/..', '/%00', '/page.js%00.html', '/C:\\x', '/' + 'a' * 5000])
def test_nothing_but_the_page_is_served(serving, path):
    answer = get(serving, path)
    assert answer.startswith((b'HTTP/1.1 404', b'HTTP/1.1 400', b'HTTP/1.0 400')), answer[:200]
    assert b'root:' not in answer
    assert b'import' not in answer


@pytest.mark.parametrize('path', ['/', '/page.js', '/page.css', '/icon.svg', '/nothing'])
def test_every_answer_says_that_nothing_comes_from_elsewhere(serving, path):
    head = get(serving, path).partition(b'\r\n\r\n')[0].decode().lower()
    assert "content-security-policy: default-src 'none'; script-src 'self'; style-src 'self';" \
        in head
    assert 'unsafe' not in head
    for line in ('x-content-type-options: nosniff', 'x-frame-options: deny',
                 'cache-control: no-store', 'referrer-policy: no-referrer',
                 'cross-origin-resource-policy: same-origin', 'server: w2b'):
        assert line in head
    assert 'access-control' not in head
    assert 'python' not in head


@pytest.mark.parametrize('method', ['POST', 'PUT', 'DELETE', 'OPTIONS', 'TRACE'])
def test_other_methods_do_nothing(serving, method):
    answer = raw(serving, f'{method} / HTTP/1.1\r\nHost: 127.0.0.1:{serving.port}\r\n'
                 'Connection: close\r\nContent-Length: 0\r\n\r\n'.encode())
    assert answer.startswith(b'HTTP/1.1 405')


def test_an_oversized_message_ends_its_connection_alone(serving):
    async def attack(session):
        async with serving.page(session) as good, serving.page(session) as bad:
            await bad.send_str(json.dumps({'do': 'say', 'text': 'x' * LARGEST_MESSAGE}))
            await until_closed(bad)
            assert bad.close_code == aiohttp.WSCloseCode.MESSAGE_TOO_BIG
            await serving.takes_a_word(good)
    run(attack)


async def until_closed(page):
    async with asyncio.timeout(DEADLINE_S):
        while not page.closed:
            await page.receive()


def test_malformed_messages_are_named_then_end_their_connection_alone(serving):
    async def attack(session):
        async with serving.page(session) as good, serving.page(session) as bad:
            await bad.send_str('{"do": "reboot"}')
            assert 'expected one of' in (await heard(bad, 'note'))['text']
            for _ in range(MOST_MALFORMED):
                await bad.send_str('\x00{]')
            await until_closed(bad)
            async with serving.page(session) as bytes_too:
                await bytes_too.send_bytes(b'\xff\x00')
                await until_closed(bytes_too)
            await serving.takes_a_word(good)
    run(attack)


def test_a_flood_of_words_is_cut_and_stop_is_not(serving):
    async def attack(session):
        async with serving.page(session) as page:
            began_s = time.monotonic()
            for _ in range(150):
                await page.send_json({'do': 'say', 'text': 'march'})
            for _ in range(300):
                await page.send_json({'do': 'stop'})
            await until(lambda: serving.asked.count('stop') == 300, 'every stop')
            allowed = 20 * (1 + time.monotonic() - began_s) + 1
            assert 20 <= serving.asked.count('say') <= min(allowed, 149)
            assert 'more than 20' in (await heard(page, 'note'))['text']
    run(attack)


def test_a_hundred_pages_do_not_get_in_the_way_of_the_first(serving):
    async def attack(session):
        async with serving.page(session) as first:
            async def another():
                connected = await session.ws_connect(
                    f'{serving.origin}/ws', headers={'Origin': serving.origin},
                    protocols=('w2b', serving.access.token))
                while (incoming := await connected.receive()).type == aiohttp.WSMsgType.TEXT:
                    if json.loads(incoming.data)['k'] == 'watching':
                        return True, connected
                return connected.close_code, connected
            opened = await asyncio.gather(*(another() for _ in range(100)))
            assert sum(outcome is True for outcome, _page in opened) == MOST_CLIENTS - 1
            assert {outcome for outcome, _page in opened} == {
                True, aiohttp.WSCloseCode.TRY_AGAIN_LATER}
            assert len(serving.hub) == MOST_CLIENTS
            began_s = time.monotonic()
            await first.send_json({'do': 'stop'})
            await until(lambda: serving.asked.count('stop') == 1, 'stop')
            assert time.monotonic() - began_s < 1.0
            for _outcome, page in opened:
                await page.close()
            await until(lambda: len(serving.hub) == 1, 'the end of the others')
            async with serving.page(session) as later:
                await heard(later, 'watching')
    run(attack)


def test_half_open_connections_do_not_get_in_the_way(serving):
    half = [socket.create_connection(('127.0.0.1', serving.port)) for _ in range(100)]
    for connection in half:
        connection.sendall(b'GET / HTTP/1.1\r\nHost: ')
    began_s = time.monotonic()
    assert get(serving, '/').startswith(b'HTTP/1.1 200')
    assert time.monotonic() - began_s < 2.0
    for connection in half:
        connection.close()


def test_a_page_that_reads_nothing_is_let_go_and_others_get_every_frame_fresh(serving):
    """Its memory here stays bounded: it has the newest frame waiting, and no other."""
    async def attack(session):
        token = serving.access.token
        slow = socket.socket()
        slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        slow.connect(('127.0.0.1', serving.port))
        slow.sendall(
            f'GET /ws HTTP/1.1\r\nHost: 127.0.0.1:{serving.port}\r\nOrigin: {serving.origin}\r\n'
            'Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n'
            f'Sec-WebSocket-Key: MDEyMzQ1Njc4OWFiY2RlZg==\r\nSec-WebSocket-Protocol: w2b, {token}'
            '\r\n\r\n'.encode())
        await until(lambda: len(serving.hub) == 1, 'the slow page')
        async with serving.page(session) as good:
            await heard(good, 'watching')
            late_s = []
            for number in range(300):
                serving.publish(json.dumps({'k': 'f', 'n': number, 'at': time.monotonic(),
                                            'pad': 'x' * 20_000}))
                frame = await heard(good, 'f')
                late_s.append(time.monotonic() - frame['at'])
                assert frame['n'] == number
            assert sorted(late_s)[len(late_s) // 2] < 0.05
            waiting, = (client for client in serving.hub._clients.values()
                        if client.robot == '' and client._frame is not None)
            assert len(waiting._waiting) <= 64
            assert len(serving.hub) == 2
            # It owes a sign of life: what it moved is stopped long before.
            await until(lambda: serving.asked.lost, 'that it is noticed')
        slow.close()
    run(attack)


def test_a_port_that_is_taken_is_an_error(serving):
    second = Serving()
    second.server.access = second.access = access('127.0.0.1', serving.port)
    with pytest.raises(StartError, match='is in use, by another page') as raised:
        second.server.start()
    assert f'-p port:={serving.port + 1}' in str(raised.value)
    assert get(serving, '/').startswith(b'HTTP/1.1 200')


def test_it_listens_on_this_machine_alone(serving):
    with socket.socket() as other:
        # Another address of the loopback network: what listens on all takes it too.
        assert other.connect_ex(('127.0.0.2', serving.port)) != 0
