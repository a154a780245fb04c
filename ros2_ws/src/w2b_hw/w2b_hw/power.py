"""Undervoltage, as the Raspberry Pi's firmware reports it through the kernel's hwmon."""

from __future__ import annotations

from pathlib import Path

HWMON = Path('/sys/class/hwmon')
NAME = 'rpi_volt'
ALARM = 'in0_lcrit_alarm'


class Power:
    """The undervoltage alarm; on machines without one it is unknown."""

    def __init__(self, hwmon: Path = HWMON) -> None:
        self._alarm = next((folder / ALARM for folder in sorted(hwmon.glob('hwmon*'))
                            if _text(folder / 'name') == NAME), None)

    @property
    def present(self) -> bool:
        """Whether this machine has the sensor."""
        return self._alarm is not None

    def undervoltage(self) -> bool | None:
        """Return whether the supply is too low; None if that cannot be read."""
        alarm = None if self._alarm is None else _text(self._alarm)
        return {'0': False, '1': True}.get(alarm) if alarm is not None else None


def _text(path: Path) -> str | None:
    try:
        return path.read_text(encoding='ascii').strip()
    except OSError:
        return None
