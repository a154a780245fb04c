"""How a joint's servo is wired: its output on the board, and what pulse means which angle."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, pi

#: Outputs of a PCA9685.
CHANNELS = 16
NOMINAL_ZERO_US = 1500.0
#: 2000 us for 180 degrees: the nominal micro servo.
NOMINAL_US_PER_RAD = 2000.0 / pi


class WiringError(ValueError):
    """A servo's data that no servo has; one line with the field."""


@dataclass(frozen=True)
class Wiring:
    """
    One servo as it is built in; the calibration starts from it.

    Attributes
    ----------
    channel
        Output on the board.
    direction
        1 if a longer pulse turns the joint in its positive sense, else -1.
    zero_us
        Pulse at which the joint stands: angle 0 of the body, the stance of a maker's robot.
    us_per_rad
        How much the pulse changes for a radian.

    """

    channel: int
    direction: int = 1
    zero_us: float = NOMINAL_ZERO_US
    us_per_rad: float = NOMINAL_US_PER_RAD

    def __post_init__(self) -> None:
        """Check the ranges (WiringError)."""
        if type(self.channel) is not int or not 0 <= self.channel < CHANNELS:
            raise WiringError(f'channel: expected 0 to {CHANNELS - 1}, got {self.channel!r}')
        if type(self.direction) is not int or self.direction not in (1, -1):
            raise WiringError(f'direction: expected 1 or -1, got {self.direction!r}')
        for name, value, low, high in (('zero_us', self.zero_us, 500.0, 2500.0),
                                       ('us_per_rad', self.us_per_rad, 200.0, 2000.0)):
            if isinstance(value, bool) or not isinstance(value, int | float) or not (
                    isfinite(value) and low <= value <= high):
                raise WiringError(f'{name}: expected {low:g} to {high:g}, got {value!r}')
            object.__setattr__(self, name, float(value))
