"""The ends of a process, measured: real processes, chips that outlive them, real time."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.faults.rig import FRAME_S
from tests.faults.scenarios import Outcome, scenario
from w2b_hw.emulation.client import SocketTransport
from w2b_hw.relax import relax_until

ROOT = Path(__file__).resolve().parents[2]
_WITHIN_S = 20.0


@contextmanager
def chips() -> Iterator[tuple[str, SocketTransport]]:
    """Give the name of a bus with chips in a process of their own, and a look at their pins."""
    with TemporaryDirectory() as folder:
        path = f'{folder}/chips'
        server = subprocess.Popen([sys.executable, '-m', 'w2b_hw.emulation.server', path],
                                  stdout=subprocess.PIPE)
        with server.stdout:
            server.stdout.readline()
            client = SocketTransport(path)
            yield f'emulated:{path}', client
            client.close()
            server.terminate()
            server.wait()


@contextmanager
def driving() -> Iterator[tuple[subprocess.Popen, SocketTransport]]:
    """Give a process that drives all servos, and a look at the pins."""
    with chips() as (name, client):
        driver = subprocess.Popen([sys.executable, '-m', 'tests.faults.driver', name], cwd=ROOT,
                                  stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        with driver.stdout:
            assert driver.stdout.readline() == b'driven\n'
            # Drained no further: the pipe takes more than these scenarios last.
            yield driver, client
        if driver.poll() is None:
            driver.kill()
        driver.wait()


def off_after(client: SocketTransport, since_s: float) -> Outcome:
    """Wait until all channels are off; return when that was."""
    ends_s = time.monotonic() + _WITHIN_S
    while any(client.outputs()[-1].pulses_us):
        assert time.monotonic() < ends_s, 'still driven'
    elapsed_s = max(0.0, client.outputs()[-1].since_s - since_s)
    return Outcome(round(elapsed_s / FRAME_S), 1e3 * elapsed_s)


def _signal(number: signal.Signals, code: int) -> Outcome:
    with driving() as (driver, client):
        since_s = time.monotonic()
        driver.send_signal(number)
        outcome = off_after(client, since_s)
        off_s = client.outputs()[-1].since_s
        if number is signal.SIGSTOP:
            # It wakes to be ended: what it does then, it does because it goes on where it was.
            driver.terminate()
            driver.send_signal(signal.SIGCONT)
        assert driver.wait(_WITHIN_S) == code
        after = [output.pulses_us for output in client.outputs() if output.since_s >= off_s]
        assert not any(map(any, after)), 'it came on again'
    return outcome


@scenario('SIGTERM', 'off, process ends in order', frames=20, ms=1000)
def sigterm() -> Outcome:
    return _signal(signal.SIGTERM, 0)


@scenario('exception in the I/O thread', 'off, process ends', frames=20, ms=1000)
def exception() -> Outcome:
    return _signal(signal.SIGUSR1, 1)


@scenario('SIGKILL', 'off, by the guard process', frames=20, ms=1000)
def sigkill() -> Outcome:
    return _signal(signal.SIGKILL, -signal.SIGKILL)


@scenario('process hangs (SIGSTOP)', 'off, by the guard process', frames=20, ms=1000)
def sigstop() -> Outcome:
    return _signal(signal.SIGSTOP, 0)


@scenario('no guard: relax command after the end', 'off, by what systemd runs', frames=20, ms=1000)
def relax_command() -> Outcome:
    with chips() as (name, client):
        from w2b_hw.transport import Write
        client.transfer([Write(0x40, bytes([0x00, 0x20]))])
        client.transfer([Write(0x40, bytes([0x06, 0, 0, 0x33, 1]))])
        assert any(client.outputs()[-1].pulses_us)
        since_s = time.monotonic()
        subprocess.run([sys.executable, '-m', 'w2b_hw.relax', '--transport', name], check=True,
                       stdout=subprocess.DEVNULL)
        assert relax_until(name, 0x40, 0.0) is None
        return off_after(client, since_s)
