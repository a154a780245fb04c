"""Messages to systemd (sd_notify(3)): ready, alive, stopping; without systemd nothing is sent."""

from __future__ import annotations

import os
import socket


class Systemd:
    """The service manager's notification socket, named in the environment."""

    def __init__(self) -> None:
        path = os.environ.get('NOTIFY_SOCKET', '')
        self._socket: socket.socket | None = None
        if path:
            # A leading @ stands for the abstract namespace's zero byte.
            self._address = '\0' + path[1:] if path.startswith('@') else path
            self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
            self._socket.setblocking(False)

    def ready(self) -> None:
        """Report that the service is up."""
        self._send(b'READY=1')

    def alive(self) -> None:
        """Feed the watchdog."""
        self._send(b'WATCHDOG=1')

    def stopping(self) -> None:
        """Report that the service is stopping."""
        self._send(b'STOPPING=1')

    def _send(self, message: bytes) -> None:
        if self._socket is None:
            return
        try:
            self._socket.sendto(message, self._address)
        except OSError:
            # A full or closed socket must not end a walk; silence makes systemd act.
            return
