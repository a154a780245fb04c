"""
The LSM6DSOX accelerometer and gyroscope (ST data sheet DS12814, Rev. 4).

Section 9: register description; table 2: sensitivities; 5.1.1: I2C. Emulated: identity, software
reset, address increment, output data rates, full scales, data-ready bits, output registers, and the
FIFO (section 6) in bypass and continuous mode, without compression.
"""

from __future__ import annotations

import math
from collections import deque

from w2b_hw.emulation.motion import Motion, noise_lsb, to_int16
from w2b_hw.emulation.registers import RegisterChip

WHO_AM_I, CTRL1_XL, CTRL2_G, CTRL3_C, CTRL9_XL, STATUS_REG = 0x0F, 0x10, 0x11, 0x12, 0x18, 0x1E
OUT_TEMP_L, OUTX_L_G, OUTX_L_A, OUTZ_H_A = 0x20, 0x22, 0x28, 0x2D
FIFO_CTRL3, FIFO_CTRL4, FIFO_STATUS1, FIFO_STATUS2 = 0x09, 0x0A, 0x3A, 0x3B
FIFO_DATA_OUT_TAG, FIFO_DATA_OUT_Z_H = 0x78, 0x7E
FIFO_MODE, CONTINUOUS, FIFO_WORDS = 0x07, 0x06, 512
#: Sensor, by control register: the FIFO's tag, and where its batch data rate is in FIFO_CTRL3.
BATCHED = {CTRL2_G: (0x01, 4), CTRL1_XL: (0x02, 0)}
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
        self._empty()

    def _empty(self) -> None:
        self._fifo: deque[bytes] = deque(maxlen=FIFO_WORDS)
        self._batched: dict[int, int] = {}
        self._tag_count = 0

    def take_samples(self) -> None:
        """Put the samples into the FIFO that are due by now, all of the present motion."""
        if self.registers[FIFO_CTRL4] & FIFO_MODE != CONTINUOUS or self.frozen:
            return
        due: list[tuple[float, int, int]] = []
        for order, (control, (_tag, shift)) in enumerate(BATCHED.items()):
            rate_hz = min(RATES_HZ[min(self.registers[FIFO_CTRL3] >> shift & 0x0F, 10)],
                          RATES_HZ[min(self.registers[control] >> 4, 10)])
            last = math.floor(self._motion.clock() * rate_hz)
            if rate_hz:
                first = self._batched.get(control, last - 1) + 1
                due += [(number / rate_hz, order, number)
                        for number in range(max(first, last - FIFO_WORDS), last + 1)]
                self._batched[control] = last
        for _time_s, order, number in sorted(due):
            control = [*BATCHED][order]
            values = b''.join(word.to_bytes(2, 'little') for word in self._words(control, number))
            self._tag_count += order == 0
            tag = BATCHED[control][0] << 3 | (self._tag_count & 3) << 1
            self._fifo.append(bytes([tag | tag.bit_count() & 1]) + values)

    def following(self, pointer: int) -> int:
        """IF_INC is on after reset; the FIFO's output goes round."""
        if pointer == FIFO_DATA_OUT_Z_H:
            return FIFO_DATA_OUT_TAG
        return super().following(pointer) if self.registers[CTRL3_C] & IF_INC else pointer

    def store(self, pointer: int, byte: int) -> None:
        """Output and identity registers are read-only; SW_RESET clears itself."""
        if pointer == CTRL3_C and byte & SW_RESET:
            self._reset()
        elif not (pointer == WHO_AM_I or STATUS_REG <= pointer <= OUTZ_H_A
                  or pointer in (FIFO_STATUS1, FIFO_STATUS2)
                  or FIFO_DATA_OUT_TAG <= pointer <= FIFO_DATA_OUT_Z_H):
            self.registers[pointer] = byte
            if pointer == FIFO_CTRL4 and byte & FIFO_MODE != CONTINUOUS:
                self._empty()
            elif pointer == FIFO_CTRL4:
                self.take_samples()

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
        elif pointer == FIFO_STATUS1:
            self.take_samples()
            self.registers[FIFO_STATUS1] = len(self._fifo) & 0xFF
            self.registers[FIFO_STATUS2] = len(self._fifo) >> 8
        elif pointer == FIFO_DATA_OUT_TAG:
            word = self._fifo.popleft() if self._fifo else bytes(7)
            self.registers[FIFO_DATA_OUT_TAG:FIFO_DATA_OUT_Z_H + 1] = word
        return self.registers[pointer]

    def _sample(self, control: int, ready: int) -> None:
        rate_hz = RATES_HZ[min(self.registers[control] >> 4, 10)]
        sample = math.floor(self._motion.clock() * rate_hz)
        if self.frozen or not rate_hz or sample == self._sampled[control]:
            return
        self._sampled[control] = sample
        first = self._outputs(control)[0]
        for axis, word in enumerate(self._words(control, sample)):
            self.registers[first + 2 * axis:first + 2 * axis + 2] = word.to_bytes(2, 'little')
        self.registers[STATUS_REG] |= ready

    def _words(self, control: int, sample: int) -> list[int]:
        """Return the three words of a sensor's sample."""
        first, values = self._outputs(control)
        return [to_int16(value + noise_lsb(sample, axis + first)) & 0xFFFF
                for axis, value in enumerate(values)]

    def _outputs(self, control: int) -> tuple[int, list[float]]:
        scale = self.registers[control] >> 2 & 3
        if control == CTRL1_XL:
            lsb = ACCEL_MG[scale] * 9.80665e-3
            return OUTX_L_A, [value / lsb for value in self._motion.acceleration_m_s2]
        mdps = GYRO_125_MDPS if self.registers[CTRL2_G] & FS_125 else GYRO_MDPS[scale]
        return OUTX_L_G, [math.degrees(value) * 1000 / mdps
                          for value in self._motion.angular_velocity_rad_s]
