"""
An I2C bus with emulated chips on it, byte by byte as on the wire.

The wire counts clock bits the way a logic analyser does: one for the start, one for each repeated
start, nine for each byte with its acknowledge, one for the stop (NXP UM10204, section 3.1).
"""

from __future__ import annotations

import errno
from collections.abc import Sequence
from typing import Protocol

from w2b_hw.i2c import Message, Write


class Chip(Protocol):
    """What a chip does on the wire."""

    def answers_to(self, address: int, reading: bool) -> bool:
        """Say whether the chip acknowledges this address now."""

    def start(self, address: int, reading: bool) -> None:
        """Take the start of a message to it."""

    def write(self, byte: int) -> bool:
        """Take a byte; return whether it is acknowledged."""

    def read(self) -> int:
        """Give the next byte."""

    def stop(self) -> None:
        """Take the stop that ends a transfer."""


class Wire:
    """A `Transport` with chips on it; an address that no chip acknowledges gives errno 121."""

    def __init__(self, chips: Sequence[Chip]) -> None:
        self.chips = list(chips)
        #: Clock bits, transfers and bytes since the start.
        self.bits = 0
        self.transfers = 0

    def transfer(self, messages: Sequence[Message]) -> list[bytes]:
        """Clock the messages through; return what each Read got (OSError 121 without ACK)."""
        self.transfers += 1
        addressed: list[Chip] = []
        try:
            return [got for message in messages
                    if (got := self._message(message, addressed)) is not None]
        finally:
            self.bits += 1
            for chip in addressed:
                chip.stop()

    def _message(self, message: Message, addressed: list[Chip]) -> bytes | None:
        self.bits += 1 + 9
        reading = not isinstance(message, Write)
        chips = [chip for chip in self.chips if chip.answers_to(message.address, reading)]
        if not chips:
            raise OSError(errno.EREMOTEIO, f'no chip acknowledged 0x{message.address:02x}')
        for chip in chips:
            chip.start(message.address, reading)
            if chip not in addressed:
                addressed.append(chip)
        if not isinstance(message, Write):
            self.bits += 9 * message.length
            return bytes(chips[0].read() for _ in range(message.length))
        for byte in message.data:
            self.bits += 9
            acknowledged = [chip.write(byte) for chip in chips]
            if not any(acknowledged):
                raise OSError(errno.EREMOTEIO, f'0x{message.address:02x} did not acknowledge '
                                               f'byte 0x{byte:02x}')
        return None

    def close(self) -> None:
        """Nothing to release."""
