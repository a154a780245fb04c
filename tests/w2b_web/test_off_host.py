"""From another machine: TLS and a secret, really tried; plain HTTP, and no secret, get nothing."""

import asyncio
import shutil
import socket
import ssl
import subprocess
import warnings

import aiohttp
import pytest

from tests.w2b_web.serving import DEADLINE_S, Serving, heard
from w2b_ros.ros_process import StartError
from w2b_web.security import access

NAME, SECRET = 'robot.local', 'correct horse battery'

pytestmark = pytest.mark.skipif(shutil.which('openssl') is None,
                                reason='no openssl here, which makes the certificate')


@pytest.fixture(scope='module')
def files(tmp_path_factory):
    """Certificate, key and secret, as docs/page.md has them made."""
    folder = tmp_path_factory.mktemp('tls')
    subprocess.run(
        ['openssl', 'req', '-x509', '-newkey', 'rsa:2048', '-nodes', '-days', '365', '-subj',
         f'/CN={NAME}', '-addext', f'subjectAltName=DNS:{NAME}', '-keyout', folder / 'key.pem',
         '-out', folder / 'certificate.pem'], check=True, capture_output=True)
    (folder / 'secret').touch(0o600)
    (folder / 'secret').write_text(f'{SECRET}\n')
    return {'certificate': str(folder / 'certificate.pem'),
            'private_key': str(folder / 'key.pem'), 'secret_file': str(folder / 'secret')}


@pytest.fixture
def serving(files):
    with Serving(host='0.0.0.0', names=NAME, **files) as running:
        # Tries to log in are counted in a clock that this test moves.
        running.server._logins._per_s = 1000.0
        yield running


class Found(aiohttp.abc.AbstractResolver):
    """Finds the robot's name on this machine, as mDNS does from another."""

    async def resolve(self, host, port=0, family=socket.AF_INET):
        assert host == NAME
        return [{'hostname': host, 'host': '127.0.0.1', 'port': port, 'family': socket.AF_INET,
                 'proto': 0, 'flags': 0}]

    async def close(self):
        pass


def run(serving, files, attack):
    trusted = ssl.create_default_context(cafile=files['certificate'])

    async def limited():
        connector = aiohttp.TCPConnector(resolver=Found(), ssl=trusted)
        async with asyncio.timeout(DEADLINE_S), aiohttp.ClientSession(
                f'https://{NAME}:{serving.port}', connector=connector) as session:
            await attack(session)
    asyncio.run(limited())


async def log_in(session, serving, secret, origin=None):
    origin = origin or f'https://{NAME}:{serving.port}'
    return await session.post('/login', data={'secret': secret}, headers={'Origin': origin},
                              allow_redirects=False)


def connect(session, serving):
    return session.ws_connect('/ws', headers={'Origin': f'https://{NAME}:{serving.port}'},
                              protocols=('w2b', serving.access.token))


def test_the_right_secret_opens_it_over_tls(serving, files):
    async def attack(session):
        async with session.get('/') as page:
            assert page.url.path == '/login.html'
            assert serving.access.token not in await page.text()
        answer = await log_in(session, serving, SECRET)
        assert (answer.status, answer.headers['Location']) == (303, '/')
        cookie = answer.headers['Set-Cookie']
        for word in ('HttpOnly', 'Secure', 'SameSite=Strict'):
            assert word in cookie
        assert SECRET not in cookie
        async with session.get('/') as page:
            assert serving.access.token in await page.text()
        async with connect(session, serving) as page:
            await heard(page, 'robots')
            await serving.takes_a_word(page)
    run(serving, files, attack)


@pytest.mark.parametrize('secret', ['', 'wrong', SECRET[:-1], SECRET + 'x', SECRET.upper(),
                                    'ä' * 99])
def test_a_wrong_secret_opens_nothing(serving, files, secret):
    async def attack(session):
        answer = await log_in(session, serving, secret)
        assert (answer.status, answer.headers['Location']) == (303, '/login.html')
        assert 'Set-Cookie' not in answer.headers
        for path in ('/page.js', '/index.html'):
            async with session.get(path) as page:
                assert page.status == 403
        # The token alone is not enough either, nor with a cookie that was made up.
        session.cookie_jar.update_cookies({'w2b': 'made up'})
        with pytest.raises(aiohttp.WSServerHandshakeError) as raised:
            async with connect(session, serving):
                pass
        assert raised.value.status == 403
    run(serving, files, attack)
    assert not serving.asked.requests


def test_another_site_cannot_log_in_for_a_person(serving, files):
    async def attack(session):
        assert (await log_in(session, serving, SECRET, 'https://evil.example')).status == 403
    run(serving, files, attack)


def test_secrets_cannot_be_tried_one_after_the_other(files):
    with Serving(host='0.0.0.0', names=NAME, **files) as serving:
        async def attack(session):
            assert (await log_in(session, serving, 'guess')).status == 303
            # One that is right does not tell so either.
            assert {(await log_in(session, serving, guess)).status
                    for guess in ('again', SECRET)} == {429}
        run(serving, files, attack)


def test_plain_http_and_old_tls_get_nothing(serving):
    with socket.create_connection(('127.0.0.1', serving.port), DEADLINE_S) as plain:
        plain.sendall(f'GET / HTTP/1.1\r\nHost: {NAME}:{serving.port}\r\n\r\n'.encode())
        answer = b''
        try:
            while piece := plain.recv(4096):
                answer += piece
        except ConnectionResetError:
            pass
    assert b'HTTP/1.1 200' not in answer
    assert b'token' not in answer
    old = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    old.check_hostname, old.verify_mode = False, ssl.CERT_NONE
    with warnings.catch_warnings(action='ignore', category=DeprecationWarning):
        old.minimum_version, old.maximum_version = ssl.TLSVersion.TLSv1, ssl.TLSVersion.TLSv1_1
    with socket.create_connection(('127.0.0.1', serving.port), DEADLINE_S) as connection, \
            pytest.raises((ssl.SSLError, ConnectionError)):
        old.wrap_socket(connection)


def test_who_does_not_trust_the_certificate_sees_it_refused(serving):
    async def attack():
        async with aiohttp.ClientSession(
                connector=aiohttp.TCPConnector(resolver=Found())) as session:
            with pytest.raises(aiohttp.ClientConnectorCertificateError):
                await session.get(f'https://{NAME}:{serving.port}/')
    asyncio.run(attack())


@pytest.mark.parametrize('missing', ['certificate', 'private_key', 'secret_file', 'names'])
def test_it_does_not_start_without_all_of_them(files, missing):
    options = {'names': NAME, **files, missing: ''}
    with pytest.raises(StartError, match=missing):
        access('0.0.0.0', 8096, **options)


@pytest.mark.parametrize(('secret', 'mode', 'says'), [
    (SECRET, 0o644, 'chmod 600'), ('short', 0o600, 'expected 12 characters'),
    (None, 0o600, 'expected a file with a secret')])
def test_a_secret_that_others_read_or_guess_is_refused(files, tmp_path, secret, mode, says):
    file = tmp_path / 'secret'
    if secret is not None:
        file.write_text(secret)
        file.chmod(mode)
    with pytest.raises(StartError, match=says):
        access('0.0.0.0', 8096, **{'names': NAME, **files, 'secret_file': str(file)})


def test_its_policy_lets_the_page_connect_to_its_own_name(serving, files):
    async def attack(session):
        async with session.get('/login.html') as page:
            policy = page.headers['Content-Security-Policy']
            assert f'wss://{NAME}:{serving.port}' in policy
            assert ' ws://' not in policy
    run(serving, files, attack)
