"""Processes that end with the one that started them."""

from __future__ import annotations

import ctypes
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

#: A node's end takes a second; the hardware node parks its servos.
END_S = 12.0
TAIL_LINES = 12
_PR_SET_PDEATHSIG = 1


def _die_with_parent() -> None:
    """Ask the kernel for SIGINT when the parent ends, however it does (Linux)."""
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGINT)


class Child:
    """
    A subcommand of `w2b` that runs, with its output in a file.

    Parameters
    ----------
    name
        The subcommand.
    arguments
        What follows it.
    log
        Where its output goes.

    """

    def __init__(self, name: str, arguments: Sequence[str], log: Path) -> None:
        self.name = name
        self._log = log
        with log.open('wb') as output:
            self._process = subprocess.Popen(
                [sys.executable, '-m', 'w2b_controller.cli.main', name, *arguments],
                stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT,
                env={**os.environ, 'PYTHONUNBUFFERED': '1'}, preexec_fn=_die_with_parent)

    @property
    def exit_code(self) -> int | None:
        """Its exit code, None while it runs."""
        return self._process.poll()

    @property
    def pid(self) -> int:
        """Its process."""
        return self._process.pid

    def _text(self) -> str:
        return self._log.read_text(encoding='utf-8', errors='replace')

    def tail(self) -> str:
        """Return the last lines of its output."""
        return '\n'.join(self._text().splitlines()[-TAIL_LINES:])

    def found(self, pattern: str) -> str:
        """Return the group of a pattern in its output, empty if it is not there."""
        match = re.search(pattern, self._text())
        return match[1] if match else ''

    def interrupt(self) -> None:
        """Ask it to end."""
        if self.exit_code is None:
            self._process.send_signal(signal.SIGINT)

    def wait(self, until_s: float) -> None:
        """Wait for its end; kill it if it takes too long."""
        try:
            self._process.wait(max(0.0, until_s - time.monotonic()))
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


def end_all(children: Sequence[Child]) -> None:
    """End processes in order, all at once."""
    until_s = time.monotonic() + END_S
    for child in children:
        child.interrupt()
    for child in children:
        child.wait(until_s)
