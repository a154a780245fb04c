"""
LSM6DSOX (accelerometer, gyroscope) with LIS3MDL (magnetometer), the default IMU.

Register names and values: ST data sheets DS12814 (LSM6DSOX) and DocID024204 (LIS3MDL).
"""

from __future__ import annotations

import struct
import time
from math import radians
from typing import ClassVar

from w2b_hw.i2c import Transport, read_register, write_register
from w2b_hw.imu.part import STANDARD_GRAVITY_M_S2, FrozenCheck, ImuError, Sample, scaled

_CTRL1_XL, _CTRL3_C, _STATUS_REG = 0x10, 0x12, 0x1E
_SW_RESET = 0x01
#: CTRL1_XL: 26 Hz, 4 g. CTRL2_G: 26 Hz, 500 dps. CTRL3_C: block data update, increment. A sample is
#: the mean of 38 ms: one of 104 Hz a frame would miss four fifths of how a walking robot turns, and
#: its heading drift by half a degree a second.
_CONTROL = bytes([0x28, 0x24, 0x44])
_NEW_BOTH = 0x03
_ACCEL_SCALE = 0.122e-3 * STANDARD_GRAVITY_M_S2
_GYRO_SCALE = radians(17.5e-3)

_MAG_ADDRESSES, _MAG_WHO_AM_I_REGISTER, _MAG_WHO_AM_I = (0x1C, 0x1E), 0x0F, 0x3D
_MAG_CTRL_REG1, _MAG_STATUS_REG = 0x20, 0x27
#: CTRL_REG1..5: ultra-high performance at 80 Hz, 4 gauss, continuous, z too, block data update.
_MAG_CONTROL = bytes([0x7C, 0x00, 0x00, 0x0C, 0x40])
#: Without this bit of the sub-address the LIS3MDL gives one register again and again.
_MAG_INCREMENT = 0x80
_MAG_NEW = 0x08
_MAG_SCALE = 1e-4 / 6842

_RESET_TRIES, _RESET_WAIT_S = 20, 0.001
_SAMPLE_TRIES, _SAMPLE_WAIT_S = 5, 0.003


class Lsm6dsoxLis3mdl:
    """Both chips; without a LIS3MDL it is an IMU without a magnetometer."""

    name: ClassVar[str] = 'lsm6dsox'
    addresses: ClassVar[tuple[int, ...]] = (0x6A, 0x6B)
    who_am_i_register: ClassVar[int] = 0x0F
    who_am_i: ClassVar[int] = 0x6C
    # Noise densities 70 ug/sqrt(Hz) and 3.8 mdps/sqrt(Hz) over 13 Hz (DS12814, table 2); RMS noise
    # 4.1 mgauss, the z axis' (DocID024204, table 3).
    acceleration_variance: ClassVar[float] = (70e-6 * STANDARD_GRAVITY_M_S2) ** 2 * 13
    angular_velocity_variance: ClassVar[float] = radians(3.8e-3) ** 2 * 13
    field_variance: ClassVar[float] = (4.1e-3 * 1e-4) ** 2
    gyroscope_range_dps: ClassVar[float] = 500.0

    def __init__(self, transport: Transport, address: int) -> None:
        self._transport = transport
        self._address = address
        self._magnetometer: int | None = None
        self._frozen = FrozenCheck()

    def configure(self) -> None:
        """Reset both chips and set them up (OSError, ImuError)."""
        write_register(self._transport, self._address, _CTRL3_C, _SW_RESET)
        self._wait_for_reset()
        for offset, value in enumerate(_CONTROL):
            write_register(self._transport, self._address, _CTRL1_XL + offset, value)
        self._magnetometer = self._find_magnetometer()
        if self._magnetometer is not None:
            for offset, value in enumerate(_MAG_CONTROL):
                write_register(self._transport, self._magnetometer, _MAG_CTRL_REG1 + offset, value)
        self._frozen = FrozenCheck()

    def read(self) -> Sample:
        """Return a new sample (OSError; ImuError if there is none or the part lost its setup)."""
        control = read_register(self._transport, self._address, _CTRL1_XL, len(_CONTROL))
        if control != _CONTROL:
            raise ImuError(f'LSM6DSOX lost its setup: expected {_CONTROL.hex()}, '
                           f'got {control.hex()}')
        block = self._new_block()
        self._frozen.check(block[4:])
        words = struct.unpack('<6h', block[4:])
        return Sample(scaled(words[3:], _ACCEL_SCALE), scaled(words[:3], _GYRO_SCALE),
                      self._read_field())

    def _new_block(self) -> bytes:
        """Return status and outputs of a new sample; a frame that came early waits for it."""
        for again in range(_SAMPLE_TRIES):
            if again:
                time.sleep(_SAMPLE_WAIT_S)
            block = read_register(self._transport, self._address, _STATUS_REG, 16)
            if block[0] & _NEW_BOTH == _NEW_BOTH:
                return block
        raise ImuError('LSM6DSOX has no new sample')

    def _read_field(self) -> tuple[float, float, float] | None:
        if self._magnetometer is None:
            return None
        status, *raw = read_register(self._transport, self._magnetometer,
                                     _MAG_STATUS_REG | _MAG_INCREMENT, 7)
        if not status & _MAG_NEW:
            return None
        return scaled(struct.unpack('<3h', bytes(raw)), _MAG_SCALE)

    def _find_magnetometer(self) -> int | None:
        for address in _MAG_ADDRESSES:
            try:
                identity = read_register(self._transport, address, _MAG_WHO_AM_I_REGISTER)[0]
            except OSError:
                continue
            if identity == _MAG_WHO_AM_I:
                return address
        return None

    def _wait_for_reset(self) -> None:
        for _ in range(_RESET_TRIES):
            if not read_register(self._transport, self._address, _CTRL3_C)[0] & _SW_RESET:
                return
            time.sleep(_RESET_WAIT_S)
        raise ImuError('LSM6DSOX does not come out of reset: check its supply')
