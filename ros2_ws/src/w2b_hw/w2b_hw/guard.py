"""
A small process beside the one that drives servos: it turns them off when that one is gone.

A process that is killed (SIGKILL, out of memory) cannot clean up, and the PCA9685 keeps sending
its last pulses. The guard's end of a pipe tells it: end of file, or no sign of life while
servos are driven, and it turns all channels off itself.
"""

from __future__ import annotations

import argparse
import os
import select
import signal
import subprocess
import sys

from w2b_hw.relax import DEFAULT_ADDRESS, relax_until

#: Signs of life: servos are driven, or are off.
DRIVEN, OFF = b'd', b'o'
READY = b'r'
#: Silence that counts as death while servos are driven; ten frames.
SILENCE_S = 0.5
_RELAX_FOR_S = 30.0
_READY_WITHIN_S = 5.0
_END_WITHIN_S = 1.0


class Guard:
    """
    The guarded side: starts the guard process and sends it heartbeats.

    Parameters
    ----------
    transport_name, address
        What the guard turns off; see `transport.open_transport`.

    Raises
    ------
    RuntimeError
        If the guard does not come up.

    """

    def __init__(self, transport_name: str, address: int = DEFAULT_ADDRESS) -> None:
        # A session of its own: Ctrl-C in the terminal, or a signal to the group, must not end it.
        self._process = subprocess.Popen(
            [sys.executable, '-m', 'w2b_hw.guard', transport_name, str(address)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True)
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._to = self._process.stdin
        # A guard that hangs must not block the frame.
        os.set_blocking(self._to.fileno(), False)
        with self._process.stdout as output:
            ready, _, _ = select.select([output], [], [], _READY_WITHIN_S)
            started = ready and os.read(output.fileno(), 1) == READY
        if not started:
            self._process.kill()
            self.close()
            raise RuntimeError('the guard process did not start: no servo will be driven')

    @property
    def pid(self) -> int:
        """Process id of the guard."""
        return self._process.pid

    def alive(self) -> bool:
        """Whether the guard runs."""
        return self._process.poll() is None

    def sign_of_life(self, driven: bool) -> None:
        """Send the guard a heartbeat."""
        try:
            os.write(self._to.fileno(), DRIVEN if driven else OFF)
        except (BlockingIOError, BrokenPipeError):
            # alive() tells; the pipe holds 65,536 signs of life.
            return

    def close(self) -> None:
        """
        Let the guard turn everything off once more, and end.

        One that cannot reach the chip yet is left behind, trying.
        """
        self._to.close()
        try:
            self._process.wait(timeout=_END_WITHIN_S)
        except subprocess.TimeoutExpired:
            return


def watch(stdin: int, transport_name: str, address: int) -> None:
    """Read signs of life until the end of file; turn off at silence and at the end."""
    driven = False
    while True:
        ready, _, _ = select.select([stdin], [], [], SILENCE_S if driven else None)
        if not ready:
            print(f'guard: no sign of life for {SILENCE_S} s: turning all servos off',
                  file=sys.stderr, flush=True)
            _turn_off(transport_name, address)
            driven = False
            continue
        signs = os.read(stdin, 4096)
        if not signs:
            break
        driven = signs.endswith(DRIVEN)
    _turn_off(transport_name, address)


def _turn_off(transport_name: str, address: int) -> None:
    error = relax_until(transport_name, address, _RELAX_FOR_S)
    if error is not None:
        print(f'guard: the servos could not be turned off ({error}): CUT THEIR SUPPLY',
              file=sys.stderr, flush=True)


def main() -> None:
    """Guard the process at the other end of standard input."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('transport')
    parser.add_argument('address', type=int)
    arguments = parser.parse_args()
    # It ends with its ward, not before: neither by Ctrl-C nor when a service is stopped.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    os.write(sys.stdout.fileno(), READY)
    watch(sys.stdin.fileno(), arguments.transport, arguments.address)


if __name__ == '__main__':
    main()
