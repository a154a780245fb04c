"""Find the IMU on the bus by its WHO_AM_I register."""

from __future__ import annotations

from w2b_hw.i2c import Transport, read_register
from w2b_hw.imu.icm20948 import Icm20948
from w2b_hw.imu.lsm6dsox_lis3mdl import Lsm6dsoxLis3mdl
from w2b_hw.imu.part import ImuError, Part

PARTS: tuple[type[Part], ...] = (Lsm6dsoxLis3mdl, Icm20948)
AUTO, NONE = 'auto', 'none'
CHOICES = (AUTO, NONE, *(part.name for part in PARTS))


def find(transport: Transport, name: str = AUTO) -> Part | None:
    """
    Return the IMU on the bus, configured; None for the name `none`.

    Parameters
    ----------
    transport
        The bus.
    name
        One of `CHOICES`.

    Raises
    ------
    ImuError
        If none answers as it should; the message names what answered.
    OSError
        If one is there but cannot be set up.
    ValueError
        If there is no such choice.

    """
    part = identify(transport, name)
    if part is not None:
        part.configure()
    return part


def identify(transport: Transport, name: str = AUTO) -> Part | None:
    """Return the IMU on the bus as it is: nothing is written to it (raises what `find` does)."""
    if name not in CHOICES:
        raise ValueError(f'imu: expected one of {", ".join(CHOICES)}, got {name!r}')
    if name == NONE:
        return None
    answers: list[str] = []
    for kind in PARTS:
        if name not in (AUTO, kind.name):
            continue
        for address in kind.addresses:
            try:
                identity = read_register(transport, address, kind.who_am_i_register)[0]
            except OSError as error:
                answers.append(f'0x{address:02x}: no answer (error {error.errno})')
                continue
            if identity == kind.who_am_i:
                return kind(transport, address)
            answers.append(f'0x{address:02x}: 0x{identity:02x} in register '
                           f'0x{kind.who_am_i_register:02x}, not the 0x{kind.who_am_i:02x} '
                           f'of {kind.name}')
    raise ImuError(f'no known IMU ({"; ".join(answers)}): check its wiring, or set imu:=none')
