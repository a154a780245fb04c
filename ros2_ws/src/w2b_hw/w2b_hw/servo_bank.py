"""
The PCA9685 as a bank of servos: set-up by Adafruit's driver, one burst write a frame.

Outputs change "on ACK" (MODE2 OCH = 1): a channel changes when all four of its registers came. A
burst that is cut by a missing acknowledge then leaves each channel old or new, never half of each,
which could be a pulse beyond a servo's end stop; the next try makes the pose whole.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from adafruit_pca9685 import PCA9685

from w2b_hw.circuitpython_bus import CircuitPythonBus
from w2b_hw.i2c import Transport, Write, read_register
from w2b_hw.relax import (
    ALL_LED_OFF_H,
    LED0_ON_L,
    MODE1,
    MODE2_ON_STOP,
    PRE_SCALE,
    all_channels_off,
)

MODE1_RUNNING = 0x20  # auto-increment; awake, no all-call, no sub addresses
MODE2_ON_ACK = 0x0C  # totem pole, outputs change on ACK
FULL_OFF = bytes([0, 0, 0, 0x10])
COUNTS = 4096
CHANNELS = 16

__all__ = ['ALL_LED_OFF_H', 'ChipStateError', 'ServoBank']


class ChipStateError(RuntimeError):
    """The chip is not as it was set up: it lost power, or a register changed."""


class ServoBank:
    """
    Servos on one PCA9685.

    Parameters
    ----------
    transport
        The bus. Nothing else may use the bank from another thread.
    channels
        The channels that carry servos; all others stay off.
    address, oscillator_hz, frequency_hz
        Of the board: its I2C address, what its oscillator really runs at, frames per second.

    """

    def __init__(self, transport: Transport, channels: Sequence[int], *, address: int = 0x40,
                 oscillator_hz: float = 25e6, frequency_hz: float = 50.0) -> None:
        self._transport = transport
        self._address = address
        self._frequency_hz = frequency_hz
        self._first, self._last = min(channels), max(channels)
        self._oscillator_hz = oscillator_hz
        self._mode2 = MODE2_ON_STOP

    @property
    def _prescale(self) -> int:
        # As Adafruit's driver rounds it: connect() checks that they agree.
        return int(self._oscillator_hz / COUNTS / self._frequency_hz + 0.5) - 1

    @property
    def tick_us(self) -> float:
        """The smallest step of a pulse."""
        return 1e6 * (self._prescale + 1) / self._oscillator_hz

    def connect(self) -> None:
        """
        Set the chip up with all channels off, whatever state it was found in.

        Raises
        ------
        OSError
            If the chip does not answer.
        ChipStateError
            If it does not keep what it was set to.

        """
        # First of all: a live chip still drives its old pulses, and the driver would wake them.
        self.relax()
        chip = PCA9685(CircuitPythonBus(self._transport), address=self._address,
                       reference_clock_speed=int(self._oscillator_hz))
        chip.frequency = self._frequency_hz
        chip.mode2_reg = MODE2_ON_ACK
        self._mode2 = MODE2_ON_ACK
        self.check()

    def set_oscillator(self, oscillator_hz: float) -> None:
        """Take another measured clock, and set the chip up with it: all channels off."""
        self._oscillator_hz = oscillator_hz
        self.connect()

    def check(self) -> None:
        """Read the chip's state (ChipStateError if it is not as set up, OSError)."""
        mode1, mode2 = read_register(self._transport, self._address, MODE1, 2)
        prescale, = read_register(self._transport, self._address, PRE_SCALE)
        if (mode1, mode2, prescale) == (MODE1_RUNNING, self._mode2, self._prescale):
            return
        state = (f'MODE1 0x{mode1:02x}, MODE2 0x{mode2:02x}, PRE_SCALE {prescale}; expected '
                 f'0x{MODE1_RUNNING:02x}, 0x{self._mode2:02x}, {self._prescale}')
        if mode1 == 0x11 and prescale == 0x1E:
            raise ChipStateError(f'PCA9685 lost power and is in its power-on state ({state}): '
                                 'check the servo supply, then arm again')
        raise ChipStateError(f'PCA9685 is not as it was set up ({state}): arm again')

    def write(self, pulses_us: Mapping[int, float | None]) -> dict[int, float]:
        """
        Send the pulses of a whole pose in one burst.

        Parameters
        ----------
        pulses_us
            Channel to pulse length; None, or a channel left out, is off.

        Returns
        -------
            Channel to the pulse that the chip makes of it: whole ticks, 0 for off.

        Raises
        ------
        OSError
            If the burst was not acknowledged.
        ValueError
            If a pulse is not shorter than the period.

        """
        data = bytearray([LED0_ON_L + 4 * self._first])
        sent = {}
        for channel in range(self._first, self._last + 1):
            pulse_us = pulses_us.get(channel)
            if pulse_us is None:
                data += FULL_OFF
                sent[channel] = 0.0
                continue
            counts = round(pulse_us / self.tick_us)
            if not 0 < counts < COUNTS:
                raise ValueError(f'channel {channel}: expected a pulse of more than 0 and less '
                                 f'than {COUNTS * self.tick_us:.0f} us, got {pulse_us} us')
            data += bytes([0, 0, counts & 0xFF, counts >> 8])
            sent[channel] = counts * self.tick_us
        self._transport.transfer([Write(self._address, bytes(data))])
        return {channel: sent.get(channel, 0.0) for channel in pulses_us}

    def relax(self) -> None:
        """Turn all channels off, in any state of the chip (OSError if it does not answer)."""
        self._mode2 = MODE2_ON_STOP
        all_channels_off(self._transport, self._address)
