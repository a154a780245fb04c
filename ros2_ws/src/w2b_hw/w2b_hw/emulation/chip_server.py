"""
Emulated chips in a process of their own, reached through a Unix socket.

Chips outlive a process that drives them. To test how such a process ends, `emulator PATH` serves
the chips from another one and `transport:=emulated:PATH` uses them.

One JSON object a line each way. `{"transfer": [["w", address, "hex"], ["r", address, count]]}`
gives `{"got": ["hex"]}` or `{"errno": 121, "message": "..."}`; `{"outputs": true}` gives what the
pins did, `{"power_on": true}` is a brown-out, `{"held": true}` holds the bus, and
`{"acceleration_m_s2": [x, y, z]}` is the specific force that the IMU feels from now on.
"""

from __future__ import annotations

import contextlib
import errno
import json
import os
import socket
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from time import monotonic
from typing import Any

from w2b_hw.emulation.robot import EmulatedRobot
from w2b_hw.i2c import Message, Read, Write


class ChipServer:
    """Serves one emulated robot to any number of clients, one transfer at a time."""

    def __init__(self, path: str, imu: str = 'lsm6dsox',
                 clock: Callable[[], float] = monotonic) -> None:
        self.robot = EmulatedRobot(imu, clock)
        self._held = False
        self._lock = threading.Lock()
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        # Whoever sees the socket can connect to it: it gets its name when it listens.
        aside = f'{path}~'
        Path(aside).unlink(missing_ok=True)
        self._socket.bind(aside)
        os.chmod(aside, 0o600)
        self._socket.listen()
        os.replace(aside, path)

    def serve(self) -> None:
        """Answer clients until the process ends."""
        while True:
            client, _ = self._socket.accept()
            threading.Thread(target=self._serve_client, args=(client,), daemon=True).start()

    def _serve_client(self, client: socket.socket) -> None:
        # A client that was killed is gone; the chips stay as it left them.
        with client, contextlib.suppress(ConnectionError), client.makefile('rwb') as stream:
            for line in stream:
                with self._lock:
                    answer = self._answer(json.loads(line))
                stream.write(json.dumps(answer).encode() + b'\n')
                stream.flush()

    def _answer(self, request: dict[str, Any]) -> dict[str, Any]:
        if 'transfer' in request:
            try:
                return {'got': [data.hex() for data in self._transfer(request['transfer'])]}
            except OSError as error:
                return {'errno': error.errno, 'message': error.strerror}
        if 'power_on' in request:
            self.robot.pca9685.power_on()
        if 'acceleration_m_s2' in request:
            x, y, z = map(float, request['acceleration_m_s2'])
            self.robot.motion.acceleration_m_s2 = (x, y, z)
        if 'held' in request:
            self._held = bool(request['held'])
        chip, wire = self.robot.pca9685, self.robot.wire
        return {'outputs': list(chip.history), 'bits': wire.bits, 'transfers': wire.transfers}

    def _transfer(self, encoded: list[list[Any]]) -> list[bytes]:
        if self._held:
            raise OSError(errno.ETIMEDOUT, 'the bus is held')
        messages: Sequence[Message] = [
            Write(address, bytes.fromhex(rest)) if kind == 'w' else Read(address, rest)
            for kind, address, rest in encoded]
        return self.robot.wire.transfer(messages)
