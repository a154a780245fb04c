"""The whole emulated robot: a PCA9685, an IMU and the wire they hang on."""

from __future__ import annotations

from collections.abc import Callable
from time import monotonic

from w2b_hw.emulation.icm20948 import Ak09916, Icm20948
from w2b_hw.emulation.lis3mdl import Lis3mdl
from w2b_hw.emulation.lsm6dsox import Lsm6dsox
from w2b_hw.emulation.motion import Motion
from w2b_hw.emulation.pca9685 import Pca9685
from w2b_hw.emulation.wire import Chip, Wire

IMUS = ('lsm6dsox', 'icm20948', 'none')


class EmulatedRobot:
    """
    Chips on a wire.

    Parameters
    ----------
    imu
        One of `IMUS`.
    clock
        Seconds; the IMU takes its samples by it.
    oscillator_hz
        What the PCA9685's oscillator really runs at.

    Raises
    ------
    ValueError
        If there is no such IMU.

    """

    def __init__(self, imu: str = 'lsm6dsox', clock: Callable[[], float] = monotonic,
                 oscillator_hz: float = 25e6) -> None:
        self.motion = Motion(clock=clock)
        self.pca9685 = Pca9685(oscillator_hz=oscillator_hz, clock=clock)
        self.imu_chips: list[Lsm6dsox | Lis3mdl | Icm20948 | Ak09916] = []
        if imu == 'lsm6dsox':
            self.imu_chips = [Lsm6dsox(self.motion), Lis3mdl(self.motion)]
        elif imu == 'icm20948':
            host = Icm20948(self.motion)
            self.imu_chips = [host, Ak09916(self.motion, host)]
        elif imu != 'none':
            raise ValueError(f'imu: expected one of {", ".join(IMUS)}, got {imu!r}')
        chips: list[Chip] = [self.pca9685, *self.imu_chips]
        self.wire = Wire(chips)
