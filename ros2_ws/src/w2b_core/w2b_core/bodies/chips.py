"""The chips on the robot's I2C bus, with their addresses; `w2b_hw` has their drivers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class BoardChip:
    """A chip, as its maker calls it, and the 7-bit addresses that it can have, its usual first."""

    name: str
    addresses: tuple[int, ...]


SERVO_BOARD = BoardChip('PCA9685', (0x40,))
LSM6DSOX, LIS3MDL = BoardChip('LSM6DSOX', (0x6A, 0x6B)), BoardChip('LIS3MDL', (0x1C, 0x1E))
ICM20948 = BoardChip('ICM-20948', (0x68, 0x69))
#: The IMUs, as the parameter `imu` has them: the chips of each board.
IMUS: Mapping[str, tuple[BoardChip, ...]] = {
    'lsm6dsox': (LSM6DSOX, LIS3MDL), 'icm20948': (ICM20948,)}
