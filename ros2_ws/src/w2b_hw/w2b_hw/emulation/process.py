"""Emulated chips on a simulated body, as a process that ends with the one that started it."""

from __future__ import annotations

import os
import select
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from w2b_hw.clocks import Clock
from w2b_hw.emulation.client import SocketTransport
from w2b_hw.transport import Transport

#: A physics engine is imported first.
_READY_WITHIN_S = 60.0
_END_WITHIN_S = 5.0
#: Time stands still meanwhile: a busy machine may take long.
_ANSWER_WITHIN_S = 60.0


def connect(path: str, clock: Clock) -> Transport:
    """Return the bus to chips in lockstep with `clock` (OSError if none are served at `path`)."""
    return SocketTransport(path, _ANSWER_WITHIN_S, clock.now)


class SimulatedRobot:
    """
    The process; `path` is that of its socket.

    Parameters
    ----------
    name
        `simulated`, or `simulated:ENGINE` with an engine of `w2b_sim`.
    body
        Name of the body that the chips sit on.

    Raises
    ------
    OSError
        If it does not start; the message has its reason.

    """

    def __init__(self, name: str, body: str) -> None:
        engine = name.partition(':')[2]
        self._folder = Path(tempfile.mkdtemp(prefix='w2b-'))
        socket = self._folder / 'chips'
        self.path = str(socket)
        self._log = self._folder / 'log'
        with self._log.open('wb') as log:
            # A session of its own: Ctrl-C must not end the chips before the servos are off.
            self._process = subprocess.Popen(
                [sys.executable, '-m', 'w2b_hw.emulation.server', str(socket),
                 '--body', body, '--lockstep', '--end-with-stdin',
                 *(['--engine', engine] if engine else [])],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=log, start_new_session=True)
        assert self._process.stdout is not None
        ready, _, _ = select.select([self._process.stdout], [], [], _READY_WITHIN_S)
        if not ready or not os.read(self._process.stdout.fileno(), 1):
            said = self._log.read_text(errors='replace').strip().splitlines()
            self.close()
            raise OSError(f'the simulated robot did not start: {said[-1] if said else "no word"}')

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    def close(self) -> None:
        """End the process."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.close()
        self._process.stdout.close()
        try:
            self._process.wait(_END_WITHIN_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        shutil.rmtree(self._folder, ignore_errors=True)
