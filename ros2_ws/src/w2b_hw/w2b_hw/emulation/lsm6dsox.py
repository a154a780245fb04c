"""
The LSM6DSOX accelerometer and gyroscope (ST data sheet DS12814, Rev. 4).

Section 9: register description; table 2: sensitivities; 5.1.1: I2C. Emulated: identity, software
reset, address increment, output data rates, full scales, data-ready bits, output registers.
"""

from __future__ import annotations

import math

from w2b_hw.emulation.motion import Motion, noise_lsb, to_int16
from w2b_hw.emulation.registers import RegisterChip

WHO_AM_I, CTRL1_XL, CTRL2_G, CTRL3_C, CTRL9_XL, STATUS_REG = 0x0F, 0x10, 0x11, 0x12, 0x18, 0x1E
OUT_TEMP_L, OUTX_L_G, OUTX_L_A, OUTZ_H_A = 0x20, 0x22, 0x28, 0x2D
IDENTITY = 0x6C
SW_RESET, IF_INC = 0x01, 0x04
XLDA, GDA, TDA = 0x01, 0x02, 0x04
FS_125 = 0x02
#: mg for each LSB, by FS_XL (2, 16, 4, 8 g).
ACCEL_MG = (0.061, 0.488, 0.122, 0.244)
#: mdps for each LSB, by FS_G (250, 500, 1000, 2000 dps), and for FS_125.
GYRO_MDPS = (8.75, 17.5, 35.0, 70.0)
GYRO_125_MDPS = 4.375
RATES_HZ = (0.0, 12.5, 26.0, 52.0, 104.0, 208.0, 416.0, 833.0, 1667.0, 3333.0, 6667.0)


class Lsm6dsox(RegisterChip):
    """One chip; `frozen` stops its samples, as a hung part does."""

    def __init__(self, motion: Motion, address: int = 0x6A) -> None:
        super().__init__(address)
        self.frozen = False
        self._motion = motion
        self._reset()

    def _reset(self) -> None:
        self.registers[:] = bytes(256)
        self.registers[WHO_AM_I] = IDENTITY
        self.registers[CTRL3_C] = IF_INC
        self.registers[CTRL9_XL] = 0xE0
        self._sampled = {CTRL1_XL: 0, CTRL2_G: 0}

    @property
    def rate_hz(self) -> float:
        """Output data rate of the gyroscope; 0 while it is off."""
        return RATES_HZ[min(self.registers[CTRL2_G] >> 4, 10)]

    def following(self, pointer: int) -> int:
        """IF_INC is on after reset."""
        return super().following(pointer) if self.registers[CTRL3_C] & IF_INC else pointer

    def store(self, pointer: int, byte: int) -> None:
        """Output and identity registers are read-only; SW_RESET clears itself."""
        if pointer == CTRL3_C and byte & SW_RESET:
            self._reset()
        elif pointer != WHO_AM_I and not STATUS_REG <= pointer <= OUTZ_H_A:
            self.registers[pointer] = byte

    def load(self, pointer: int) -> int:
        """Take due samples before the status or an output is read."""
        if pointer == STATUS_REG:
            self._sample(CTRL1_XL, XLDA)
            self._sample(CTRL2_G, GDA)
        elif pointer == OUTX_L_A:
            self._sample(CTRL1_XL, XLDA)
            self.registers[STATUS_REG] &= ~XLDA
        elif pointer == OUTX_L_G:
            self._sample(CTRL2_G, GDA)
            self.registers[STATUS_REG] &= ~GDA
        return self.registers[pointer]

    def _sample(self, control: int, ready: int) -> None:
        rate_hz = RATES_HZ[min(self.registers[control] >> 4, 10)]
        sample = math.floor(self._motion.clock() * rate_hz)
        if self.frozen or not rate_hz or sample == self._sampled[control]:
            return
        self._sampled[control] = sample
        first, values = self._outputs(control)
        for axis, value in enumerate(values):
            word = to_int16(value + noise_lsb(sample, axis + first)) & 0xFFFF
            self.registers[first + 2 * axis:first + 2 * axis + 2] = word.to_bytes(2, 'little')
        self.registers[STATUS_REG] |= ready

    def _outputs(self, control: int) -> tuple[int, list[float]]:
        scale = self.registers[control] >> 2 & 3
        if control == CTRL1_XL:
            lsb = ACCEL_MG[scale] * 9.80665e-3
            return OUTX_L_A, [value / lsb for value in self._motion.acceleration_m_s2]
        mdps = GYRO_125_MDPS if self.registers[CTRL2_G] & FS_125 else GYRO_MDPS[scale]
        return OUTX_L_G, [math.degrees(value) * 1000 / mdps
                          for value in self._motion.angular_velocity_rad_s]
