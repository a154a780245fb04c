"""
Buses by name, the kernel's among them, and how often a transfer is tried again.

`i2c` defines the interface for drivers and emulated chips.
"""

from __future__ import annotations

import errno
from collections.abc import Sequence

from w2b_hw.i2c import Message, Read, Transport, Write, read_register, write_register

__all__ = [
    'DEFAULT_DEVICE', 'EMULATED', 'TRANSIENT_ERRNOS', 'FrameBudget', 'LinuxTransport', 'Message',
    'Read', 'Transport', 'Write', 'check_name', 'is_emulated', 'open_transport', 'read_register',
    'write_register']

#: A missing acknowledge, or a lost arbitration: worth another try at once.
TRANSIENT_ERRNOS = frozenset({errno.EREMOTEIO, errno.EIO, errno.ENXIO, errno.EAGAIN})
DEFAULT_DEVICE = '/dev/i2c-1'
EMULATED = 'emulated'
#: Emulated chips on a simulated body, in a process that the hardware node starts and ends.
SIMULATED = 'simulated'

# linux/i2c-dev.h; smbus2 does not name these two.
_I2C_RETRIES = 0x0701
_I2C_TIMEOUT = 0x0702


class LinuxTransport:
    """
    /dev/i2c-N through smbus2: every transfer is one I2C_RDWR ioctl, which the kernel finishes.

    Parameters
    ----------
    device
        Path of the character device.
    timeout_ms
        How long a held bus may block one transfer. The kernel's own default is a second, which
        is 20 frames. Rounded up to the kernel's unit of 10 ms.
    exclusive
        Claim the device: of the programs that drive servos only one may run. Those that only read
        or turn off do without.

    Raises
    ------
    OSError
        If the device cannot be opened, or another program has claimed it.

    """

    def __init__(self, device: str = DEFAULT_DEVICE, timeout_ms: int = 10,
                 exclusive: bool = False) -> None:
        # Imported here: code that talks to emulated chips needs no smbus2.
        from fcntl import LOCK_EX, LOCK_NB, flock, ioctl

        from smbus2 import SMBus, i2c_msg

        self._message = i2c_msg
        self._bus = SMBus(device)
        descriptor = self._bus.fd
        assert descriptor is not None
        if exclusive:
            try:
                flock(descriptor, LOCK_EX | LOCK_NB)
            except BlockingIOError:
                self._bus.close()
                raise OSError(errno.EBUSY, f'another program drives what is on {device}: '
                                           'stop it first') from None
        ioctl(descriptor, _I2C_TIMEOUT, -(-timeout_ms // 10))
        # Retries are counted by the frame's budget, not hidden in the kernel.
        ioctl(descriptor, _I2C_RETRIES, 0)

    def transfer(self, messages: Sequence[Message]) -> list[bytes]:
        """Send the messages as one ioctl; return what each Read got (OSError if it fails)."""
        sent = [self._message.write(message.address, message.data) if isinstance(message, Write)
                else self._message.read(message.address, message.length) for message in messages]
        self._bus.i2c_rdwr(*sent)
        return [bytes(got) for got, message in zip(sent, messages, strict=True)
                if isinstance(message, Read)]

    def close(self) -> None:
        """Close the device."""
        self._bus.close()


class FrameBudget:
    """
    A transport that tries again, but only so often in one frame.

    A spike on the wire must not end a walk, and a dead wire must not eat the frame: at most
    `retries` further tries are shared by all transfers between two calls of `begin_frame`. A held
    bus (errno 110) is never tried again in the same frame: after it, every transfer of the frame
    fails at once with the same error.
    """

    def __init__(self, transport: Transport, retries: int = 2) -> None:
        self._transport = transport
        self._retries = retries
        self._left = retries
        self._held = False
        #: Transfers that were repeated since the start, for diagnostics.
        self.retried = 0

    def begin_frame(self) -> None:
        """Start a frame: the budget is full again."""
        self._left = self._retries
        self._held = False

    def transfer(self, messages: Sequence[Message]) -> list[bytes]:
        """Send the messages, repeating within the budget; OSError when that is used up."""
        if self._held:
            raise OSError(errno.ETIMEDOUT, 'the bus is held; not tried again in this frame')
        while True:
            try:
                return self._transport.transfer(messages)
            except OSError as error:
                self._held = error.errno == errno.ETIMEDOUT
                if error.errno not in TRANSIENT_ERRNOS or self._left == 0:
                    raise
                self._left -= 1
                self.retried += 1

    def close(self) -> None:
        """Release the bus."""
        self._transport.close()


def is_emulated(name: str) -> bool:
    """Return whether a bus of this name has emulated chips."""
    return name.partition(':')[0] == EMULATED


def is_simulated(name: str) -> bool:
    """Return whether a bus of this name is to be started, with a simulated body."""
    return name.partition(':')[0] == SIMULATED


def check_name(name: str) -> None:
    """Raise a ValueError unless `name` has the form of a bus's name."""
    if not (is_emulated(name) or is_simulated(name) or name.startswith('/')):
        raise ValueError(f'transport: expected a device such as {DEFAULT_DEVICE}, {EMULATED}, '
                         f'{EMULATED}:SOCKET, {SIMULATED}, {SIMULATED}:ENGINE or '
                         f'{SIMULATED}:/SOCKET, got {name!r}')


def open_transport(name: str = DEFAULT_DEVICE, *, exclusive: bool = False) -> Transport:
    """
    Return the bus of this name; `exclusive` claims a device, see `LinuxTransport`.

    `/dev/i2c-1`: the kernel's bus (the default). `emulated`: emulated chips in this process.
    `emulated:PATH`: emulated chips in the process that serves the Unix socket PATH.

    Raises
    ------
    OSError
        If the device or socket cannot be opened.
    ValueError
        If the name is of no such form.

    """
    check_name(name)
    if is_simulated(name):
        raise ValueError(f'transport: {name} is only for the hardware node, which starts it; '
                         'start `emulator SOCKET --body physical_twin` and use emulated:SOCKET')
    if is_emulated(name):
        path = name.partition(':')[2]
        if path:
            from w2b_hw.emulation.client import SocketTransport

            return SocketTransport(path)
        from w2b_hw.emulation.robot import EmulatedRobot

        return EmulatedRobot().wire
    return LinuxTransport(name, exclusive=exclusive)
