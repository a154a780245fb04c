"""
The ICM-20948 and the AK09916 inside it (TDK data sheet DS-000189, Rev. 1.3).

Sections 7 to 12: register maps of the banks; 12 and 13: the magnetometer, which the bus reaches at
0x0C when INT_PIN_CFG has BYPASS_EN; tables 1 to 3: sensitivities. The magnetometer's y and z axes
point the other way (section 13.1, figures 12 and 13).
"""

from __future__ import annotations

import math

from w2b_hw.emulation.motion import Motion, noise_lsb, to_int16
from w2b_hw.emulation.registers import RegisterChip

REG_BANK_SEL = 0x7F
# Bank 0
WHO_AM_I, PWR_MGMT_1, PWR_MGMT_2, INT_PIN_CFG, INT_STATUS_1 = 0x00, 0x06, 0x07, 0x0F, 0x1A
ACCEL_XOUT_H, GYRO_XOUT_H, TEMP_OUT_H = 0x2D, 0x33, 0x39
# Bank 2
GYRO_SMPLRT_DIV, GYRO_CONFIG_1, ACCEL_SMPLRT_DIV_2, ACCEL_CONFIG = 0x00, 0x01, 0x11, 0x14
IDENTITY = 0xEA
DEVICE_RESET, SLEEP, BYPASS_EN, RAW_DATA_0_RDY = 0x80, 0x40, 0x02, 0x01
ACCEL_LSB_PER_G = (16384.0, 8192.0, 4096.0, 2048.0)
GYRO_LSB_PER_DPS = (131.0, 65.5, 32.8, 16.4)
BASE_RATE_HZ = 1125.0

AK_ADDRESS = 0x0C
AK_WIA2, AK_ST1, AK_HXL, AK_HZH, AK_ST2, AK_CNTL2, AK_CNTL3 = (
    0x01, 0x10, 0x11, 0x16, 0x18, 0x31, 0x32)
AK_COMPANY, AK_IDENTITY = 0x48, 0x09
AK_DRDY, AK_SRST = 0x01, 0x01
AK_RATES_HZ = {0x02: 10.0, 0x04: 20.0, 0x06: 50.0, 0x08: 100.0}
AK_LSB_T = 0.15e-6


class Icm20948(RegisterChip):
    """Accelerometer and gyroscope; `frozen` stops its samples."""

    def __init__(self, motion: Motion, address: int = 0x68) -> None:
        super().__init__(address)
        self.frozen = False
        self._motion = motion
        self._reset()

    def _reset(self) -> None:
        self.banks = [bytearray(128) for _ in range(4)]
        self.banks[0][WHO_AM_I] = IDENTITY
        self.banks[0][PWR_MGMT_1] = SLEEP | 0x01
        self.banks[2][GYRO_CONFIG_1] = self.banks[2][ACCEL_CONFIG] = 0x01
        self._bank = 0
        self._sampled = 0

    @property
    def bypass(self) -> bool:
        """Whether the magnetometer is on the bus."""
        return bool(self.banks[0][INT_PIN_CFG] & BYPASS_EN)

    def store(self, pointer: int, byte: int) -> None:
        """REG_BANK_SEL is in every bank; DEVICE_RESET clears itself."""
        if pointer == REG_BANK_SEL:
            self._bank = byte >> 4 & 3
        elif self._bank == 0 and pointer == PWR_MGMT_1 and byte & DEVICE_RESET:
            self._reset()
        elif not (self._bank == 0 and (pointer == WHO_AM_I
                                       or ACCEL_XOUT_H <= pointer < TEMP_OUT_H)):
            self.banks[self._bank][pointer & 0x7F] = byte

    def load(self, pointer: int) -> int:
        """INT_STATUS_1 tells of a new sample and is cleared by reading it."""
        if pointer == REG_BANK_SEL:
            return self._bank << 4
        bank = self.banks[self._bank]
        if self._bank == 0 and pointer == INT_STATUS_1:
            self._sample()
            value, bank[INT_STATUS_1] = bank[INT_STATUS_1], 0
            return value
        return bank[pointer & 0x7F]

    def _sample(self) -> None:
        bank, settings = self.banks[0], self.banks[2]
        rate_hz = BASE_RATE_HZ / (1 + settings[GYRO_SMPLRT_DIV])
        sample = math.floor(self._motion.clock() * rate_hz)
        if self.frozen or bank[PWR_MGMT_1] & SLEEP or sample == self._sampled:
            return
        self._sampled = sample
        per_m_s2 = ACCEL_LSB_PER_G[settings[ACCEL_CONFIG] >> 1 & 3] / 9.80665
        per_dps = GYRO_LSB_PER_DPS[settings[GYRO_CONFIG_1] >> 1 & 3]
        values = [value * per_m_s2 for value in self._motion.acceleration_m_s2]
        values += [math.degrees(value) * per_dps for value in self._motion.angular_velocity_rad_s]
        for axis, value in enumerate(values):
            word = to_int16(value + noise_lsb(sample, axis)) & 0xFFFF
            first = ACCEL_XOUT_H + 2 * axis
            bank[first:first + 2] = word.to_bytes(2, 'big')
        bank[INT_STATUS_1] = RAW_DATA_0_RDY


class Ak09916(RegisterChip):
    """The magnetometer on the ICM-20948's auxiliary bus, seen through its bypass."""

    def __init__(self, motion: Motion, host: Icm20948) -> None:
        super().__init__(AK_ADDRESS)
        self._motion = motion
        self._host = host
        self._reset()

    def _reset(self) -> None:
        self.registers[:] = bytes(256)
        self.registers[0], self.registers[AK_WIA2] = AK_COMPANY, AK_IDENTITY
        self._sampled = 0

    def answers_to(self, address: int, reading: bool) -> bool:
        """Only while the host passes the bus through."""
        return self._host.bypass and super().answers_to(address, reading)

    def store(self, pointer: int, byte: int) -> None:
        """Only the control registers can be written."""
        if pointer == AK_CNTL3 and byte & AK_SRST:
            self._reset()
        elif pointer == AK_CNTL2:
            self.registers[pointer] = byte

    def load(self, pointer: int) -> int:
        """ST1 tells of a new sample; reading ST2 ends the reading of it."""
        if pointer == AK_ST1:
            self._sample()
        elif pointer == AK_ST2:
            self.registers[AK_ST1] = 0
        return self.registers[pointer]

    def _sample(self) -> None:
        rate_hz = AK_RATES_HZ.get(self.registers[AK_CNTL2], 0.0)
        sample = math.floor(self._motion.clock() * rate_hz)
        if self._host.frozen or not rate_hz or sample == self._sampled:
            return
        self._sampled = sample
        x_t, y_t, z_t = self._motion.field_t
        for axis, field_t in enumerate((x_t, -y_t, -z_t)):
            word = to_int16(field_t / AK_LSB_T + noise_lsb(sample, axis)) & 0xFFFF
            first = AK_HXL + 2 * axis
            self.registers[first:first + 2] = word.to_bytes(2, 'little')
        self.registers[AK_ST1] = AK_DRDY
