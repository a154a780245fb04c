"""What the emulated IMU chips have in common: a register file with a sub-address pointer."""

from __future__ import annotations


class RegisterChip:
    """
    A chip whose first written byte is a sub-address and whose other bytes are registers.

    A chip's own behaviour is in `load` (before a register is read) and `store` (a register is
    written); `following` says which sub-address comes next.
    """

    def __init__(self, address: int) -> None:
        self.address = address
        self.registers = bytearray(256)
        self._pointer = 0
        self._pointer_next = False

    def answers_to(self, address: int, reading: bool) -> bool:
        """Own address only."""
        return address == self.address

    def start(self, address: int, reading: bool) -> None:
        """Expect the sub-address first if this is a write."""
        self._pointer_next = not reading

    def write(self, byte: int) -> bool:
        """Take the sub-address, then data."""
        if self._pointer_next:
            self._pointer, self._pointer_next = byte, False
        else:
            self.store(self._pointer, byte)
            self._pointer = self.following(self._pointer)
        return True

    def read(self) -> int:
        """Give the register that the sub-address points to."""
        value = self.load(self._pointer)
        self._pointer = self.following(self._pointer)
        return value

    def stop(self) -> None:
        """Nothing happens at the stop."""

    def load(self, pointer: int) -> int:
        """Return what a read of this sub-address gives."""
        return self.registers[pointer]

    def store(self, pointer: int, byte: int) -> None:
        """Write a byte to this sub-address."""
        self.registers[pointer] = byte

    def following(self, pointer: int) -> int:
        """Return the sub-address after this one."""
        return (pointer + 1) & 0xFF
