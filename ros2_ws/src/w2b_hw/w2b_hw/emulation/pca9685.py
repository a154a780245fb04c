"""
The PCA9685 as its data sheet describes it (NXP PCA9685, Rev. 4, 16 April 2015).

Section 7.3: registers; 7.3.1.1: restart; 7.3.3: outputs; 7.3.5: prescale; 7.1.4 and 7.6: the
software reset. The time that the oscillator takes to start (500 us) is not emulated.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from time import monotonic
from typing import NamedTuple

MODE1, MODE2, SUBADR1, ALLCALLADR = 0x00, 0x01, 0x02, 0x05
LED0_ON_L, LED15_OFF_H = 0x06, 0x45
ALL_LED_ON_L, ALL_LED_OFF_H, PRE_SCALE, TEST_MODE = 0xFA, 0xFD, 0xFE, 0xFF
RESTART, EXTCLK, AUTO_INCREMENT, SLEEP, ALLCALL = 0x80, 0x40, 0x20, 0x10, 0x01
SUB_BITS = (0x08, 0x04, 0x02)
OCH, OUTDRV = 0x08, 0x04
FULL = 0x10
COUNTS = 4096
#: States of the outputs that are remembered; 20 minutes at a change a frame.
HISTORY = 24_000
_GENERAL_CALL = 0x00
_SOFTWARE_RESET = 0x06


class Output(NamedTuple):
    """What one channel's registers say: counts 0..4095, and the two full bits."""

    on: int
    off: int
    full_on: bool
    full_off: bool


class Outputs(NamedTuple):
    """What the 16 pins did from a moment on: pulses in us, 0 for none."""

    since_s: float
    pulses_us: tuple[float, ...]


class Pca9685:
    """
    One chip with its 16 outputs.

    Parameters
    ----------
    address
        Its own 7-bit address.
    oscillator_hz
        What its internal oscillator really runs at; 25 MHz nominally.
    clock
        Seconds, for the times in the history.

    """

    def __init__(self, address: int = 0x40, oscillator_hz: float = 25e6,
                 clock: Callable[[], float] = monotonic) -> None:
        self.address = address
        self.oscillator_hz = oscillator_hz
        self._clock = clock
        #: The last states of the outputs, oldest first.
        self.history: deque[Outputs] = deque(maxlen=HISTORY)
        self.power_on()

    def power_on(self) -> None:
        """Take the power-on state: asleep, auto-increment off, prescale 30, all channels off."""
        self._registers = bytearray(256)
        self._registers[MODE1] = SLEEP | ALLCALL
        self._registers[MODE2] = OUTDRV
        self._registers[SUBADR1:ALLCALLADR + 1] = bytes([0xE2, 0xE4, 0xE8, 0xE0])
        self._registers[PRE_SCALE] = 0x1E
        for channel in range(16):
            self._registers[LED0_ON_L + 4 * channel + 3] = FULL
        self._pointer = 0
        self._pointer_next = False
        self._resetting = False
        self._loaded: dict[int, set[int]] = {}
        self._latched = [self._staged(channel) for channel in range(16)]
        self._note()

    def register(self, register: int) -> int:
        """Return a register's value, past the wire."""
        return self._registers[register]

    def corrupt(self, register: int, value: int) -> None:
        """Change a register past the wire, as a disturbance does."""
        self._registers[register] = value
        self._note()

    # -- outputs

    @property
    def tick_us(self) -> float:
        """Duration of one count."""
        return 1e6 * (self._registers[PRE_SCALE] + 1) / self.oscillator_hz

    def pulses_us(self) -> tuple[float, ...]:
        """Return the length of each channel's pulse now, 0 for no pulse."""
        stopped = self._registers[MODE1] & (SLEEP | RESTART)
        return tuple(0.0 if stopped else self.tick_us * _counts(output)
                     for output in self._latched)

    def _staged(self, channel: int) -> Output:
        on_l, on_h, off_l, off_h = self._registers[LED0_ON_L + 4 * channel:][:4]
        return Output((on_h & 0x0F) << 8 | on_l, (off_h & 0x0F) << 8 | off_l,
                      bool(on_h & FULL), bool(off_h & FULL))

    def _note(self) -> None:
        pulses = self.pulses_us()
        if not self.history or self.history[-1].pulses_us != pulses:
            self.history.append(Outputs(self._clock(), pulses))

    # -- wire

    def answers_to(self, address: int, reading: bool) -> bool:
        """Own address; for writing also general call, and all-call and sub addresses if on."""
        if address == self.address:
            return True
        if reading:
            return False
        mode1 = self._registers[MODE1]
        others = [ALLCALLADR] if mode1 & ALLCALL else []
        others += [SUBADR1 + n for n, bit in enumerate(SUB_BITS) if mode1 & bit]
        return address == _GENERAL_CALL or address in [self._registers[r] >> 1 for r in others]

    def start(self, address: int, reading: bool) -> None:
        """Expect the control register first if this is a write."""
        self._resetting = address == _GENERAL_CALL
        self._pointer_next = not reading

    def write(self, byte: int) -> bool:
        """Take the control register, then data."""
        if self._resetting:
            if byte == _SOFTWARE_RESET:
                self.power_on()
            return byte == _SOFTWARE_RESET
        if self._pointer_next:
            self._pointer, self._pointer_next = byte, False
            return not LED15_OFF_H < byte < ALL_LED_ON_L
        self._store(self._pointer, byte)
        self._advance()
        return True

    def read(self) -> int:
        """Give the register that the control register points to."""
        # The ALL_LED registers read as zero.
        value = 0 if ALL_LED_ON_L <= self._pointer <= ALL_LED_OFF_H \
            else self._registers[self._pointer]
        self._advance()
        return value

    def stop(self) -> None:
        """
        With OCH = 0 the outputs change now.

        The history is kept by transfers: pins change at the end of a PWM cycle, which is 20 times
        as long as a burst, so the states within one burst are hardly ever put out.
        """
        if not self._registers[MODE2] & OCH and self._loaded:
            for channel in self._loaded:
                self._latch(channel)
            self._registers[MODE1] &= ~RESTART
        # A channel of which not all four registers came keeps waiting only within a transfer.
        self._loaded.clear()
        self._note()

    def _advance(self) -> None:
        if not self._registers[MODE1] & AUTO_INCREMENT:
            return
        # Past register 69 it goes on at 0; it works from 250 to 254 and then rolls over to 0.
        self._pointer = 0 if self._pointer in (LED15_OFF_H, PRE_SCALE, TEST_MODE) \
            else self._pointer + 1

    def _store(self, register: int, byte: int) -> None:
        if register == MODE1:
            self._store_mode1(byte)
        elif register == MODE2:
            self._registers[MODE2] = byte & 0x1F
        elif register == PRE_SCALE:
            if self._registers[MODE1] & SLEEP:
                self._registers[PRE_SCALE] = max(byte, 3)
        elif register >= ALL_LED_ON_L and register != TEST_MODE:
            for channel in range(16):
                self._store_led(LED0_ON_L + 4 * channel + register - ALL_LED_ON_L, byte)
        elif LED0_ON_L <= register <= LED15_OFF_H:
            self._store_led(register, byte)
        else:
            self._registers[register] = byte

    def _store_mode1(self, byte: int) -> None:
        old = self._registers[MODE1]
        restart = old & RESTART
        if byte & SLEEP and not old & SLEEP:
            restart = RESTART if any(map(_counts, self._latched)) else 0
        elif byte & RESTART and not byte & SLEEP and not old & SLEEP:
            restart = 0
        # EXTCLK is cleared by a reset only.
        self._registers[MODE1] = byte & 0x7F | old & EXTCLK | restart

    def _store_led(self, register: int, byte: int) -> None:
        channel, part = divmod(register - LED0_ON_L, 4)
        self._registers[register] = byte & 0x1F if part in (1, 3) else byte
        loaded = self._loaded.setdefault(channel, set())
        loaded.add(part)
        if self._registers[MODE2] & OCH and len(loaded) == 4:
            self._latch(channel)
            self._registers[MODE1] &= ~RESTART
            loaded.clear()

    def _latch(self, channel: int) -> None:
        self._latched[channel] = self._staged(channel)


def _counts(output: Output) -> int:
    if output.full_off:
        return 0
    if output.full_on:
        return COUNTS
    return (output.off - output.on) % COUNTS
