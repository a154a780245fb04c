"""The client's side of `emulator`: a transport to chips that live in another process."""

from __future__ import annotations

import contextlib
import errno
import json
import socket
from collections.abc import Callable, Sequence
from typing import Any

from w2b_hw.emulation.pca9685 import Outputs
from w2b_hw.i2c import Message, Write


class SocketTransport:
    """
    A `Transport` over the Unix socket that `emulator` serves.

    `clock`, if given, is sent with each request: the time of chips in lockstep.

    Raises
    ------
    OSError
        If nothing listens there (and from `transfer`, with the wire's error number).

    """

    def __init__(self, path: str, timeout_s: float = 2.0,
                 clock: Callable[[], float] | None = None) -> None:
        self._clock = clock
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._socket.settimeout(timeout_s)
        try:
            self._socket.connect(path)
        except OSError as error:
            self._socket.close()
            raise OSError(error.errno, f'no emulated chips at {path} ({error.strerror}): '
                                       f'start `emulator {path}` first') from None
        self._stream = self._socket.makefile('rwb')

    def transfer(self, messages: Sequence[Message]) -> list[bytes]:
        """Send the messages; return what each Read got (OSError if it fails)."""
        encoded = [['w', message.address, message.data.hex()] if isinstance(message, Write)
                   else ['r', message.address, message.length] for message in messages]
        answer = self.request({'transfer': encoded})
        if 'errno' in answer:
            raise OSError(answer['errno'], answer['message'])
        return [bytes.fromhex(data) for data in answer['got']]

    def outputs(self) -> list[Outputs]:
        """Return what the PCA9685's pins did, oldest first; times are of the monotonic clock."""
        return [Outputs(since_s, tuple(pulses_us))
                for since_s, pulses_us in self.request({'outputs': True})['outputs']]

    def request(self, request: dict[str, Any]) -> dict[str, Any]:
        """Send one request and return its answer."""
        if self._clock is not None:
            request = {**request, 'clock': self._clock()}
        self._stream.write(json.dumps(request).encode() + b'\n')
        self._stream.flush()
        line = self._stream.readline()
        if not line:
            raise OSError(errno.EIO, 'the emulator went away')
        answer: dict[str, Any] = json.loads(line)
        return answer

    def close(self) -> None:
        """Close the connection."""
        # What was not sent when the emulator went away is not worth an error now.
        with contextlib.suppress(OSError):
            self._stream.close()
        self._socket.close()
