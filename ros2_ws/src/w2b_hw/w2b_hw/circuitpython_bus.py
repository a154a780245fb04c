"""What Adafruit's drivers ask of an I2C bus, on top of a `Transport`: no board detection."""

from __future__ import annotations

from w2b_hw.i2c import Read, Transport, Write


class CircuitPythonBus:
    """
    The five methods of `busio.I2C` that CircuitPython drivers use.

    Locking is a promise here, not a lock: one thread alone does I/O, because adafruit_register
    fills a buffer that all devices share before it asks for the lock.
    """

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def try_lock(self) -> bool:
        """Grant the bus."""
        return True

    def unlock(self) -> None:
        """Take the bus back."""

    def scan(self) -> list[int]:
        """Return the addresses that answer a read of one byte."""
        return [address for address in range(0x08, 0x78) if self._answers(address)]

    def writeto(self, address: int, buffer: bytes, *, start: int = 0, end: int | None = None
                ) -> None:
        """Write `buffer[start:end]` to a chip."""
        self._transport.transfer([Write(address, bytes(buffer[start:end]))])

    def readfrom_into(self, address: int, buffer: bytearray, *, start: int = 0,
                      end: int | None = None) -> None:
        """Fill `buffer[start:end]` from a chip."""
        end = len(buffer) if end is None else end
        buffer[start:end] = self._transport.transfer([Read(address, end - start)])[0]

    def writeto_then_readfrom(self, address: int, out_buffer: bytes, in_buffer: bytearray, *,
                              out_start: int = 0, out_end: int | None = None, in_start: int = 0,
                              in_end: int | None = None) -> None:
        """Write, then read, joined by a repeated start."""
        in_end = len(in_buffer) if in_end is None else in_end
        in_buffer[in_start:in_end] = self._transport.transfer([
            Write(address, bytes(out_buffer[out_start:out_end])),
            Read(address, in_end - in_start)])[0]

    def _answers(self, address: int) -> bool:
        try:
            self._transport.transfer([Read(address, 1)])
        except OSError:
            return False
        return True
