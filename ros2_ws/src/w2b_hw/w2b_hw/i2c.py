"""
The I2C bus: one method, `transfer`, used by every driver of this package.

A transfer is a list of I2C messages joined by repeated starts and ended by one stop. It either
happens whole or raises an OSError with the kernel's error number: 121 (EREMOTEIO), 6 (ENXIO) or
5 (EIO) for a chip that does not acknowledge, 110 (ETIMEDOUT) for a bus that is held.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol


class Write(NamedTuple):
    """An I2C message to a chip."""

    address: int
    data: bytes


class Read(NamedTuple):
    """An I2C message from a chip."""

    address: int
    length: int


Message = Write | Read


class Transport(Protocol):
    """An I2C bus."""

    def transfer(self, messages: Sequence[Message]) -> list[bytes]:
        """Send the messages as one transfer; return what each Read got (OSError if it fails)."""

    def close(self) -> None:
        """Release the bus."""


def read_register(transport: Transport, address: int, register: int, count: int = 1) -> bytes:
    """Return `count` bytes from a chip's register on."""
    return transport.transfer([Write(address, bytes([register])), Read(address, count)])[0]


def write_register(transport: Transport, address: int, register: int, value: int) -> None:
    """Write one register of a chip."""
    transport.transfer([Write(address, bytes([register, value]))])
