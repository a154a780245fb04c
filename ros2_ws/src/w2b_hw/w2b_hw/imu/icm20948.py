"""
ICM-20948 (accelerometer, gyroscope, and an AK09916 magnetometer behind its bypass).

Register names and values: TDK data sheet DS-000189, sections 7 to 13.
"""

from __future__ import annotations

import struct
import time
from math import radians
from typing import ClassVar

from w2b_core.bodies.chips import ICM20948
from w2b_hw.i2c import Transport, read_register, write_register
from w2b_hw.imu.part import STANDARD_GRAVITY_M_S2, FrozenCheck, ImuError, Sample, scaled

_REG_BANK_SEL, _BANK_0, _BANK_2 = 0x7F, 0x00, 0x20
_PWR_MGMT_1, _INT_PIN_CFG, _INT_STATUS_1, _ACCEL_XOUT_H = 0x06, 0x0F, 0x1A, 0x2D
_DEVICE_RESET, _AWAKE, _BYPASS_EN, _NEW = 0x80, 0x01, 0x02, 0x01
#: Bank 2, register to value: 102 Hz, low-pass 51 and 50 Hz, 500 dps and 4 g.
_SETTINGS = {0x00: 10, 0x01: 0x1B, 0x11: 10, 0x14: 0x1B}
_ACCEL_SCALE = STANDARD_GRAVITY_M_S2 / 8192
_GYRO_SCALE = radians(1 / 65.5)

_MAG_ADDRESS, _MAG_WIA2, _MAG_IDENTITY = 0x0C, 0x01, 0x09
_MAG_ST1, _MAG_CNTL2, _MAG_CNTL3 = 0x10, 0x31, 0x32
_MAG_RESET, _MAG_100_HZ, _MAG_NEW, _MAG_OVERFLOW = 0x01, 0x08, 0x01, 0x08
_MAG_SCALE = 0.15e-6
_RESET_WAIT_S = 0.1
#: The settings in bank 2 cost three more transfers to read, so they are read every so often.
_SETTINGS_EVERY = 20


class Icm20948:
    """The part, with its magnetometer if that answers."""

    name: ClassVar[str] = 'icm20948'
    addresses: ClassVar[tuple[int, ...]] = ICM20948.addresses
    who_am_i_register: ClassVar[int] = 0x00
    who_am_i: ClassVar[int] = 0xEA
    # Noise densities 230 ug/sqrt(Hz) and 0.015 dps/sqrt(Hz) over 50 Hz (tables 1 and 2). The data
    # sheet gives no noise for the magnetometer: unknown, which is 0 in a covariance.
    acceleration_variance: ClassVar[float] = (230e-6 * STANDARD_GRAVITY_M_S2) ** 2 * 50
    angular_velocity_variance: ClassVar[float] = radians(0.015) ** 2 * 50
    field_variance: ClassVar[float] = 0.0
    gyroscope_range_dps: ClassVar[float] = 500.0

    def __init__(self, transport: Transport, address: int) -> None:
        self._transport = transport
        self._address = address
        self._has_magnetometer = False
        self._frozen = FrozenCheck()
        self._reads = 0

    def configure(self) -> None:
        """Reset the part and set it up (OSError, ImuError)."""
        self._write(_REG_BANK_SEL, _BANK_0)
        self._write(_PWR_MGMT_1, _DEVICE_RESET)
        time.sleep(_RESET_WAIT_S)
        self._write(_PWR_MGMT_1, _AWAKE)
        self._write(_REG_BANK_SEL, _BANK_2)
        for register, value in _SETTINGS.items():
            self._write(register, value)
        self._write(_REG_BANK_SEL, _BANK_0)
        self._write(_INT_PIN_CFG, _BYPASS_EN)
        self._has_magnetometer = self._start_magnetometer()
        self._frozen = FrozenCheck()
        self._reads = 0

    def read(self) -> Sample:
        """Return a new sample (OSError; ImuError if there is none or the part lost its setup)."""
        power = self._read(_PWR_MGMT_1)
        if power != bytes([_AWAKE]):
            raise ImuError(f'ICM-20948 lost its setup: expected PWR_MGMT_1 0x{_AWAKE:02x}, '
                           f'got 0x{power[0]:02x}')
        if self._reads % _SETTINGS_EVERY == 0:
            self._check_settings()
        self._reads += 1
        if not self._read(_INT_STATUS_1)[0] & _NEW:
            raise ImuError('ICM-20948 has no new sample')
        raw = self._read(_ACCEL_XOUT_H, 12)
        self._frozen.check(raw)
        words = struct.unpack('>6h', raw)
        return Sample(scaled(words[:3], _ACCEL_SCALE), scaled(words[3:], _GYRO_SCALE),
                      self._read_field())

    def _check_settings(self) -> None:
        self._write(_REG_BANK_SEL, _BANK_2)
        try:
            for register, value in _SETTINGS.items():
                got = self._read(register)[0]
                if got != value:
                    raise ImuError(f'ICM-20948 lost its setup: expected 0x{value:02x} in bank 2 '
                                   f'register 0x{register:02x}, got 0x{got:02x}')
        finally:
            self._write(_REG_BANK_SEL, _BANK_0)

    def _read_field(self) -> tuple[float, float, float] | None:
        if not self._has_magnetometer:
            return None
        # ST2, the last byte, must be read or the part keeps this sample for ever.
        status, *raw, _, overflow = read_register(self._transport, _MAG_ADDRESS, _MAG_ST1, 9)
        if not status & _MAG_NEW or overflow & _MAG_OVERFLOW:
            return None
        x, y, z = scaled(struct.unpack('<3h', bytes(raw)), _MAG_SCALE)
        # The magnetometer's y and z point the other way (data sheet, figures 12 and 13).
        return x, -y, -z

    def _start_magnetometer(self) -> bool:
        try:
            identity = read_register(self._transport, _MAG_ADDRESS, _MAG_WIA2)[0]
        except OSError:
            return False
        if identity != _MAG_IDENTITY:
            return False
        write_register(self._transport, _MAG_ADDRESS, _MAG_CNTL3, _MAG_RESET)
        write_register(self._transport, _MAG_ADDRESS, _MAG_CNTL2, _MAG_100_HZ)
        return True

    def _read(self, register: int, count: int = 1) -> bytes:
        return read_register(self._transport, self._address, register, count)

    def _write(self, register: int, value: int) -> None:
        write_register(self._transport, self._address, register, value)
