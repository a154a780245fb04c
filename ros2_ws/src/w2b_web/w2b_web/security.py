"""
Who may open the page: the names it answers to, the origin of a connection, token and secret.

Every browser on the machine can send requests to a local port, with whatever page it shows. So a
request must name this server (DNS rebinding), a connection must come from this very page (a foreign
Origin is refused), and it must show the token that only a reader of the page knows. Beyond this
machine a secret and TLS come on top.
"""

from __future__ import annotations

import hmac
import ipaddress
import os
import secrets
import ssl
import stat
from dataclasses import dataclass
from pathlib import Path

from w2b_ros.ros_process import StartError

#: Characters of a secret that a person chose.
SHORTEST_SECRET = 12
TUNNEL = 'or keep host:=127.0.0.1 and use an SSH tunnel (ssh -L 8096:127.0.0.1:8096 ROBOT)'


@dataclass(frozen=True)
class Access:
    """
    Who may open the page.

    Attributes
    ----------
    host, port
        Where the server listens.
    hosts
        What a request may say in its header `Host`.
    token
        Made at every start, shown by every connection.
    secret
        What a person has to know; empty on this machine.
    session
        What the cookie of a person holds who knew the secret.
    tls
        Certificate and key; None on this machine.

    """

    host: str
    port: int
    hosts: frozenset[str]
    token: str
    secret: str = ''
    session: str = ''
    tls: ssl.SSLContext | None = None

    @property
    def scheme(self) -> str:
        """The scheme of its address."""
        return 'http' if self.tls is None else 'https'

    @property
    def address(self) -> str:
        """What a person types into the browser."""
        host = f'[{self.host}]' if ':' in self.host else self.host
        if not is_local(self.host) and self.hosts:
            return f'{self.scheme}://{min(self.hosts)}/'
        return f'{self.scheme}://{host}:{self.port}/'

    def allows_host(self, host: str | None) -> bool:
        """Return whether a request is meant for this server."""
        return host is not None and host.lower() in self.hosts

    def allows_origin(self, origin: str | None) -> bool:
        """Return whether a connection was opened by this server's own page."""
        scheme, _, host = (origin or '').partition('://')
        return scheme == self.scheme and self.allows_host(host)

    def allows_token(self, offered: list[str]) -> bool:
        """Return whether one of the offered protocols of a connection is the token."""
        return any(same(one, self.token) for one in offered)

    def allows_session(self, cookie: str | None) -> bool:
        """Return whether a cookie is that of a person who knew the secret, where one is needed."""
        return not self.secret or (cookie is not None and same(cookie, self.session))


def same(given: str, expected: str) -> bool:
    """Compare in constant time."""
    return hmac.compare_digest(given.encode('utf-8', 'replace'), expected.encode())


def is_local(host: str) -> bool:
    """Return whether an address is of this machine alone."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == 'localhost'


def access(host: str, port: int, *, names: str = '', certificate: str = '', private_key: str = '',
           secret_file: str = '') -> Access:
    """
    Return who may open the page, as the parameters have it.

    Raises
    ------
    StartError
        If the page would be open to other machines without a secret and TLS, or if a file will
        not do.

    """
    local = is_local(host)
    if not local:
        missing = [name for name, value in (
            ('certificate', certificate), ('private_key', private_key),
            ('secret_file', secret_file), ('names', names)) if not value]
        if missing:
            raise StartError(
                f'host: {host} can be reached from other machines: expected {", ".join(missing)} '
                f'too (docs/page.md: from another machine), {TUNNEL}')
    known = ['localhost', '127.0.0.1', '[::1]'] if local else []
    known += [name.strip().lower() for name in names.split(',') if name.strip()]
    hosts = {f'{name}:{port}' for name in known}
    if port == (443 if certificate else 80):
        hosts.update(known)
    return Access(host, port, frozenset(hosts), secrets.token_urlsafe(24),
                  _secret(secret_file) if secret_file else '', secrets.token_urlsafe(24),
                  _tls(certificate, private_key) if certificate else None)


def _secret(name: str) -> str:
    path = Path(name).expanduser()
    try:
        if path.stat().st_mode & (stat.S_IRWXG | stat.S_IRWXO) and os.name == 'posix':
            raise StartError(f'secret_file: {path}: expected a file that only you can read, got '
                             f'one that others can: chmod 600 {path}')
        secret = path.read_text(encoding='utf-8').strip()
    except (OSError, UnicodeDecodeError) as error:
        raise StartError(f'secret_file: {path}: expected a file with a secret, got {error}'
                         ) from error
    if len(secret) < SHORTEST_SECRET:
        raise StartError(f'secret_file: {path}: expected {SHORTEST_SECRET} characters at least, '
                         f'got {len(secret)}')
    return secret


def _tls(certificate: str, private_key: str) -> ssl.SSLContext:
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    try:
        context.load_cert_chain(Path(certificate).expanduser(),
                                Path(private_key).expanduser() if private_key else None)
    except (OSError, ssl.SSLError) as error:
        raise StartError(f'certificate: {certificate}, private_key: {private_key}: expected PEM '
                         f'files that belong together, got {error}') from error
    return context


def headers(access: Access) -> dict[str, str]:
    """Return the headers of every answer: nothing is loaded from, or shown in, another place."""
    socket = f'{access.scheme.replace("http", "ws")}://'
    # Of an IPv6 address 'self' has to do: a policy takes none.
    sockets = ' '.join(sorted(f'{socket}{host}' for host in access.hosts if '[' not in host))
    return {
        'Content-Security-Policy': (
            "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; "
            f"connect-src 'self' {sockets}; base-uri 'none'; form-action 'self'; "
            "frame-ancestors 'none'"),
        'X-Content-Type-Options': 'nosniff', 'X-Frame-Options': 'DENY',
        'Referrer-Policy': 'no-referrer', 'Cache-Control': 'no-store',
        'Cross-Origin-Opener-Policy': 'same-origin',
        'Cross-Origin-Resource-Policy': 'same-origin', 'Server': 'w2b',
        'Permissions-Policy': 'camera=(), geolocation=(), microphone=(self)'}
