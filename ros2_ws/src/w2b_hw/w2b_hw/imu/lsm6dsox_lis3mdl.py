"""
LSM6DSOX (accelerometer, gyroscope) with LIS3MDL (magnetometer), the default IMU.

Register names and values: ST data sheets DS12814 (LSM6DSOX) and DocID024204 (LIS3MDL). A sample is
the mean of all that came into the FIFO since the last one, as Linux's st_lsm6dsx driver reads it:
one sample of 104 Hz a frame would miss four fifths of how a walking robot turns.
"""

from __future__ import annotations

import struct
import time
from math import radians
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from w2b_core.bodies.chips import LIS3MDL, LSM6DSOX
from w2b_hw.i2c import Transport, read_register, write_register
from w2b_hw.imu.part import (
    STANDARD_GRAVITY_M_S2,
    FrozenCheck,
    ImuError,
    Sample,
    mean_rate_rad_s,
    scaled,
)

_FIFO_CTRL1, _FIFO_CTRL4, _CTRL3_C, _FIFO_STATUS1, _FIFO_DATA_OUT_TAG = (
    0x07, 0x0A, 0x12, 0x3A, 0x78)
_SW_RESET = 0x01
_RATE_HZ = 104.0
_FIFO_OFF, _FIFO_CONTINUOUS = 0x00, 0x06
#: FIFO_CTRL1 to CTRL3_C, all that lies between: both sensors into the FIFO at 104 Hz, continuous
#: mode; reset values and the identity; CTRL1_XL 104 Hz, 4 g; CTRL2_G 104 Hz, 500 dps; CTRL3_C block
#: data update, increment.
_SETUP = bytes([0x00, 0x00, 0x44, _FIFO_CONTINUOUS, 0x00, 0x00, 0x00, 0x00, 0x6C, 0x48, 0x44, 0x44])
#: What is written of it, in this order: the FIFO begins when both sensors run.
_WRITTEN = (0x12, 0x10, 0x11, 0x09, 0x0A)
#: A word of the FIFO: its address goes round from 0x7E to 0x78, so that one read takes them all.
_WORD = np.dtype([('tag', 'u1'), ('value', '<i2', 3)])
_TAG_GYRO, _TAG_ACCEL = 0x01, 0x02
#: More are of a robot that was not looked after for a while; they are thrown away.
_MOST_WORDS = 40
_ACCEL_SCALE = 0.122e-3 * STANDARD_GRAVITY_M_S2
_GYRO_SCALE = radians(17.5e-3)

_MAG_ADDRESSES, _MAG_WHO_AM_I_REGISTER, _MAG_WHO_AM_I = LIS3MDL.addresses, 0x0F, 0x3D
_MAG_CTRL_REG1, _MAG_STATUS_REG = 0x20, 0x27
#: CTRL_REG1..5: ultra-high performance at 80 Hz, 4 gauss, continuous, z too, block data update.
_MAG_CONTROL = bytes([0x7C, 0x00, 0x00, 0x0C, 0x40])
#: Without this bit of the sub-address the LIS3MDL gives one register again and again.
_MAG_INCREMENT = 0x80
_MAG_NEW = 0x08
_MAG_SCALE = 1e-4 / 6842

_RESET_TRIES, _RESET_WAIT_S = 20, 0.001
_SAMPLE_TRIES, _SAMPLE_WAIT_S = 10, 0.003


class Lsm6dsoxLis3mdl:
    """Both chips; without a LIS3MDL it is an IMU without a magnetometer."""

    name: ClassVar[str] = 'lsm6dsox'
    addresses: ClassVar[tuple[int, ...]] = LSM6DSOX.addresses
    who_am_i_register: ClassVar[int] = 0x0F
    who_am_i: ClassVar[int] = 0x6C
    # Noise densities 70 ug/sqrt(Hz) and 3.8 mdps/sqrt(Hz) (DS12814, table 2) over 10 Hz, the band
    # of a mean of 50 ms; RMS noise 4.1 mgauss, the z axis' (DocID024204, table 3).
    acceleration_variance: ClassVar[float] = (70e-6 * STANDARD_GRAVITY_M_S2) ** 2 * 10
    angular_velocity_variance: ClassVar[float] = radians(3.8e-3) ** 2 * 10
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
        for register in _WRITTEN:
            write_register(self._transport, self._address, register,
                           _SETUP[register - _FIFO_CTRL1])
        self._magnetometer = self._find_magnetometer()
        if self._magnetometer is not None:
            for offset, value in enumerate(_MAG_CONTROL):
                write_register(self._transport, self._magnetometer, _MAG_CTRL_REG1 + offset, value)
        self._frozen = FrozenCheck()

    def read(self) -> Sample:
        """Return a new sample (OSError; ImuError if there is none or the part lost its setup)."""
        setup = read_register(self._transport, self._address, _FIFO_CTRL1, len(_SETUP))
        if setup != _SETUP:
            raise ImuError(f'LSM6DSOX lost its setup: expected {_SETUP.hex()}, got {setup.hex()}')
        words = self._new_words()
        tags, values = words['tag'] >> 3, words['value']
        rates, forces = values[tags == _TAG_GYRO], values[tags == _TAG_ACCEL]
        if not (len(rates) and len(forces)):
            raise ImuError(f'LSM6DSOX: expected words of both sensors in its FIFO, got the tags '
                           f'{", ".join(map(str, tags))}')
        self._frozen.check(rates[-1].tobytes() + forces[-1].tobytes())
        x, y, z = (forces.mean(axis=0) * _ACCEL_SCALE).tolist()
        return Sample((x, y, z), mean_rate_rad_s(rates * _GYRO_SCALE, 1.0 / _RATE_HZ),
                      self._read_field())

    def _new_words(self) -> NDArray[np.void]:
        """Return what came into the FIFO since the last time; a frame that came early waits."""
        for again in range(_SAMPLE_TRIES):
            if again:
                time.sleep(_SAMPLE_WAIT_S)
            low, high = read_register(self._transport, self._address, _FIFO_STATUS1, 2)
            count = low | (high & 0x03) << 8
            if count > _MOST_WORDS:
                for mode in (_FIFO_OFF, _FIFO_CONTINUOUS):
                    write_register(self._transport, self._address, _FIFO_CTRL4, mode)
            elif count >= 2:
                return np.frombuffer(read_register(
                    self._transport, self._address, _FIFO_DATA_OUT_TAG, count * _WORD.itemsize),
                    dtype=_WORD)
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
