"""
The LIS3MDL magnetometer (ST data sheet DocID024204, Rev. 6).

Section 7: register description; table 3: sensitivities; 5.1.1: I2C. The sub-address increments
only with its bit 7 set, and goes round within the six output registers, as PX4's traces of the
part show; `always_increments` gives the behaviour that drivers which leave that bit out rely on.
"""

from __future__ import annotations

import math

from w2b_hw.emulation.motion import Motion, noise_lsb, to_int16
from w2b_hw.emulation.registers import RegisterChip

WHO_AM_I, CTRL_REG1, CTRL_REG2, CTRL_REG3, CTRL_REG4 = 0x0F, 0x20, 0x21, 0x22, 0x23
STATUS_REG, OUT_X_L, OUT_Z_H = 0x27, 0x28, 0x2D
IDENTITY = 0x3D
INCREMENT = 0x80
SOFT_RST, POWER_DOWN, CONTINUOUS = 0x04, 0x03, 0x00
ZYXDA = 0x08
FAST_ODR = 0x02
#: LSB for each gauss, by FS (4, 8, 12, 16 gauss).
LSB_PER_GAUSS = (6842, 3421, 2281, 1711)
RATES_HZ = (0.625, 1.25, 2.5, 5.0, 10.0, 20.0, 40.0, 80.0)
#: With FAST_ODR, by operating mode (low power to ultra-high performance).
FAST_RATES_HZ = (1000.0, 560.0, 300.0, 155.0)


class Lis3mdl(RegisterChip):
    """One chip; `frozen` stops its samples."""

    def __init__(self, motion: Motion, address: int = 0x1C, always_increments: bool = False
                 ) -> None:
        super().__init__(address)
        self.frozen = False
        self._always_increments = always_increments
        self._motion = motion
        self._reset()

    def _reset(self) -> None:
        self.registers[:] = bytes(256)
        self.registers[WHO_AM_I] = IDENTITY
        self.registers[CTRL_REG1] = 0x10
        self.registers[CTRL_REG3] = POWER_DOWN
        self._sampled = 0

    def following(self, pointer: int) -> int:
        """Go on only with bit 7 of the sub-address set; round the six output registers."""
        if not (pointer & INCREMENT or self._always_increments):
            return pointer
        if pointer & 0x7F == OUT_Z_H:
            return pointer & INCREMENT | OUT_X_L
        return pointer & INCREMENT | (pointer + 1) & 0x7F

    def store(self, pointer: int, byte: int) -> None:
        """Only the control and interrupt registers can be written."""
        register = pointer & 0x7F
        if register == CTRL_REG2 and byte & SOFT_RST:
            self._reset()
        elif register != WHO_AM_I and not STATUS_REG <= register <= OUT_Z_H:
            self.registers[register] = byte

    def load(self, pointer: int) -> int:
        """Take a due sample before the status is read; reading the outputs clears it."""
        register = pointer & 0x7F
        if register == STATUS_REG:
            self._sample()
        elif OUT_X_L <= register <= OUT_Z_H:
            if not self.registers[STATUS_REG]:
                self._sample()
            if register == OUT_Z_H:
                self.registers[STATUS_REG] = 0
        return self.registers[register]

    def _sample(self) -> None:
        control = self.registers[CTRL_REG1]
        rate_hz = FAST_RATES_HZ[control >> 5 & 3] if control & FAST_ODR \
            else RATES_HZ[control >> 2 & 7]
        sample = math.floor(self._motion.clock() * rate_hz)
        running = self.registers[CTRL_REG3] & POWER_DOWN == CONTINUOUS
        if self.frozen or not running or sample == self._sampled:
            return
        self._sampled = sample
        lsb_per_t = 1e4 * LSB_PER_GAUSS[self.registers[CTRL_REG2] >> 5 & 3]
        for axis, field_t in enumerate(self._motion.field_t):
            word = to_int16(field_t * lsb_per_t + noise_lsb(sample, axis)) & 0xFFFF
            self.registers[OUT_X_L + 2 * axis:OUT_X_L + 2 * axis + 2] = word.to_bytes(2, 'little')
        self.registers[STATUS_REG] = ZYXDA | 0x07
