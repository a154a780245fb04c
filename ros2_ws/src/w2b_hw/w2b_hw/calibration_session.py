"""
Calibrating, without a terminal: what each key does to the robot and to the values.

One servo at a time is driven, all others are off; a servo is moved in small steps, and what was
found is kept by keys that say "here". Every change can be undone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from w2b_hw.calibration import (
    LONGEST_US,
    PLAUSIBLE_US_PER_RAD,
    SHORTEST_US,
    Board,
    Calibration,
    CalibrationError,
    Servo,
)
from w2b_hw.joints import TWIN, JointList
from w2b_hw.servo_bank import CHANNELS, ChipStateError, ServoBank

SMALL_US, LARGE_US = 5.0, 20.0
#: The angle of the second mark where the joint's limits allow it: a set square fits it.
MARK_RAD = math.radians(45)
#: What has to be found for a servo to be calibrated, and the key that says so.
NEEDED = {'zero': 'z', 'mark': 'm', 'direction': 't'}
#: By so much a joint is moved to ask whether what it does is what was drawn.
TRIAL_RAD = math.radians(10)
OSCILLATOR_STEP_HZ = 50e3

HELP = """\
 n p   next, previous servo (relaxes)     e     energise this servo, or relax it
 . ,   5 us longer, shorter               > <   20 us longer, shorter
 z     here the joint is at zero          m     here it is at its mark: +45 degrees, hips +30
 t     go to zero, then +10 degrees       y     yes, it moved as was said
 l u   here its range ends (short, long)  d     no: turn the direction round
 + -   board clock 50 kHz up, down        x     undo
 s     save                               q     relax and leave"""


@dataclass(frozen=True)
class Draft:
    """The values so far; unlike a `Calibration`, they need not belong together yet."""

    board: Board
    servos: tuple[dict[str, float | int | str], ...]
    #: Of each servo, what was found of `NEEDED`.
    found: tuple[frozenset[str], ...]
    joints: JointList

    def finished(self) -> Calibration:
        """Return the calibration (CalibrationError if the values do not belong together)."""
        return Calibration(self.board, tuple(
            Servo(**{**servo, 'calibrated': found >= set(NEEDED)})  # type: ignore[arg-type]
            for servo, found in zip(self.servos, self.found, strict=True)), self.joints)


def mark_rad(joint: str, joints: JointList = TWIN) -> float:
    """Return the angle of the second mark, within the joint's limits: negative if they are."""
    low, high = joints.limits_rad(joint)
    return min(MARK_RAD, high) if high >= -low else max(-MARK_RAD, low)


class Session:
    """
    One calibration.

    Parameters
    ----------
    bank
        Connected, all off.
    start
        Where to begin from: the last calibration, or the nominal one.
    in_file
        Whether `start` is from the file that `s` saves to.

    """

    def __init__(self, bank: ServoBank, start: Calibration, in_file: bool = False) -> None:
        self._bank = bank
        self._draft = Draft(start.board, tuple(vars(servo).copy() for servo in start.servos),
                            tuple(frozenset(NEEDED if servo.calibrated else ())
                                  for servo in start.servos), start.joints)
        self.in_file = in_file
        self._undo: list[Draft] = []
        self._index = 0
        self._pulse_us = 0.0
        self._driven = False
        #: Whether the person was asked what a trial did, and has not answered yet.
        self._asked = False
        self.saved = True
        #: What the last key did, or why it did nothing.
        self.message = 'all servos are off; e energises this one'
        self._recentre()

    @property
    def driven(self) -> bool:
        """Whether a servo is driven."""
        return self._driven

    def press(self, key: str) -> None:
        """Do what a key says; what goes wrong on the bus is in the message."""
        actions = {'n': lambda: self._select(1), 'p': lambda: self._select(-1),
                   'e': self._energise, '.': lambda: self._step(SMALL_US),
                   ',': lambda: self._step(-SMALL_US), '>': lambda: self._step(LARGE_US),
                   '<': lambda: self._step(-LARGE_US), 'z': self._zero, 'm': self._mark,
                   't': self._try, 'y': self._confirm, 'l': self._shortest,
                   'u': self._longest, 'd': self._turn_round,
                   '+': lambda: self._clock(OSCILLATOR_STEP_HZ),
                   '-': lambda: self._clock(-OSCILLATOR_STEP_HZ),
                   ']': lambda: self._rewire(1), '[': lambda: self._rewire(-1),
                   'x': self._take_back}
        action = actions.get(key)
        if action is None:
            self.message = f'no key {key!r}'
            return
        asked, self._asked = self._asked, False
        try:
            if key == 'y' and not asked:
                self.message = 'try it first (t): there is nothing to confirm yet'
            else:
                action()
        except (OSError, ChipStateError) as error:
            # The values found so far must survive a spike on the wire or a loose supply.
            self._recover(error)

    def _recover(self, error: Exception) -> None:
        self._driven = False
        try:
            self._bank.connect()
        except (OSError, ChipStateError):
            self.message = f'{error}: the servos could not be turned off, CUT THEIR SUPPLY'
        else:
            self.message = f'{error}: relaxed'

    def relax(self) -> None:
        """Turn everything off (OSError if the chip does not answer)."""
        self._driven = False
        self._bank.relax()

    def finished(self) -> Calibration:
        """Return the calibration (CalibrationError if the values do not belong together)."""
        return self._draft.finished()

    def show(self) -> str:
        """Return the screen: one line for the servo, one for the last key."""
        servo, found = self._servo, self._draft.found
        lacking = [key for name, key in NEEDED.items() if name not in found[self._index]]
        done = sum(one >= set(NEEDED) for one in found)
        kept = 'NOT SAVED' if not self.saved else 'saved' if self.in_file else 'not in a file'
        direction = '+' if servo['direction'] == 1 else '-'
        return (f'[{self._index + 1:2d}/{len(self._draft.servos)}] {servo["joint"]:<18} '
                f'channel {servo["channel"]:2d}  {"DRIVEN " if self._driven else "relaxed"} '
                f'{self._pulse_us:6.0f} us | zero {servo["zero_us"]:6.1f}  {direction}'
                f'{servo["us_per_rad"]:.1f} us/rad  range {servo["min_us"]:.0f}..'
                f'{servo["max_us"]:.0f} us | clock {self._draft.board.oscillator_hz / 1e6:.2f} MHz'
                f' | {"lacks " + " and ".join(lacking) if lacking else "calibrated"}, '
                f'{done} of {len(found)} done | {kept}\n{self.message}')

    # -- moving

    def _select(self, step: int) -> None:
        self.relax()
        self._index = (self._index + step) % len(self._draft.servos)
        self._recentre()
        self.message = 'relaxed; e energises this one'

    def _energise(self) -> None:
        if self._driven:
            self.relax()
            self.message = 'relaxed'
            return
        self._drive(self._pulse_us)
        self._driven = True
        self.message = 'driven: . and , move it by 5 us, > and < by 20 us'

    def _step(self, by_us: float) -> None:
        if not self._driven:
            self.message = 'energise it first (e)'
            return
        wanted_us = self._pulse_us + by_us
        if not SHORTEST_US <= wanted_us <= LONGEST_US:
            self.message = f'no servo goes beyond {SHORTEST_US:.0f}..{LONGEST_US:.0f} us'
            return
        self._drive(wanted_us)
        self.message = f'{wanted_us:.0f} us'

    def _try(self) -> None:
        """Go to zero; from there move by `TRIAL_RAD`, and ask whether it did what was drawn."""
        servo, zero_us = self._servo, float(self._servo['zero_us'])
        if not self._driven:
            self.message = 'energise it first (e)'
        elif 'zero' not in self._draft.found[self._index]:
            self.message = 'find its zero first (z)'
        elif abs(self._pulse_us - zero_us) > SMALL_US:
            self._drive(zero_us)
            self.message = 'at zero: watch the leg, then t again'
        else:
            low, high = self._draft.joints.limits_rad(str(servo['joint']))
            angle_rad = TRIAL_RAD if high >= min(TRIAL_RAD, -low) else -TRIAL_RAD
            angle_rad = min(max(angle_rad, low), high)
            wanted_us = zero_us + int(servo['direction']) * float(servo['us_per_rad']) * angle_rad
            self._drive(min(max(wanted_us, float(servo['min_us'])), float(servo['max_us'])))
            self._asked = True
            words = self._draft.joints.motion(str(servo['joint']), angle_rad)
            self.message = (f'moved by {math.degrees(angle_rad):+.0f} degrees: the end of its leg '
                            f'should have gone {words}; y if it did, d if the other way')

    def _confirm(self) -> None:
        self._change('direction confirmed', 'direction')

    def _drive(self, pulse_us: float) -> None:
        # A chip that lost power must not be driven on; the error says so.
        self._bank.check()
        self._bank.write({int(self._servo['channel']): pulse_us})
        self._pulse_us = pulse_us

    def _recentre(self) -> None:
        self._pulse_us = float(self._servo['zero_us'])

    # -- values

    @property
    def _servo(self) -> dict[str, float | int | str]:
        return self._draft.servos[self._index]

    def _zero(self) -> None:
        self._change('zero is here', 'zero', zero_us=self._pulse_us)

    def _mark(self) -> None:
        from_zero_us = self._pulse_us - float(self._servo['zero_us'])
        angle_rad = mark_rad(str(self._servo['joint']), self._draft.joints)
        if abs(from_zero_us) < LARGE_US:
            self.message = f'move it to {math.degrees(angle_rad):+.0f} degrees first: it is at zero'
            return
        slope = abs(from_zero_us / angle_rad)
        low, high = PLAUSIBLE_US_PER_RAD
        doubt = '' if low <= slope <= high else (
            f'; BUT {slope:.0f} us/rad is implausible (servos have {low:.0f} to {high:.0f}): '
            'is it really there?')
        self._change(f'{math.degrees(angle_rad):+.0f} degrees is here{doubt}', 'mark',
                     direction=1 if from_zero_us * angle_rad > 0 else -1, us_per_rad=slope)

    def _shortest(self) -> None:
        self._change('the range ends here', None, min_us=self._pulse_us)

    def _longest(self) -> None:
        self._change('the range ends here', None, max_us=self._pulse_us)

    def _turn_round(self) -> None:
        self._change('direction turned round: try it (t)', None,
                     direction=-int(self._servo['direction']))

    def _clock(self, by_hz: float) -> None:
        self.relax()
        try:
            board = replace(self._draft.board,
                            oscillator_hz=self._draft.board.oscillator_hz + by_hz)
        except CalibrationError as error:
            self.message = str(error)
            return
        # Every pulse is another one now.
        self._keep(replace(self._draft, board=board, found=(frozenset(),) * len(self._draft.found)))
        self._bank.set_oscillator(board.oscillator_hz)
        self.message = ('clock changed, relaxed: measure a pulse of 1500 us again; all servos have '
                        'to be calibrated after it')

    def _rewire(self, step: int) -> None:
        """Say that this joint hangs on another channel; the joint that had it gets this one's."""
        self.relax()
        old = int(self._servo['channel'])
        new = (old + step) % CHANNELS
        swap = {old: new, new: old}
        servos = tuple({**servo, 'channel': swap.get(int(servo['channel']), servo['channel'])}
                       for servo in self._draft.servos)
        # What was found was found of another servo.
        found = tuple(frozenset[str]() if servo != before else one for servo, before, one
                      in zip(servos, self._draft.servos, self._draft.found, strict=True))
        self._keep(replace(self._draft, servos=servos, found=found))
        self.message = f'channel {new}, relaxed: calibrate it, and the joint that had this channel'

    def _change(self, message: str, found: str | None, **values: float | int) -> None:
        servo = {**self._servo, **values}
        # The angles' range follows the pulses': what is reachable, within the joint's limits.
        limits = sorted(int(servo['direction']) * (float(servo[end]) - float(servo['zero_us']))
                        / float(servo['us_per_rad']) for end in ('min_us', 'max_us'))
        low, high = self._draft.joints.limits_rad(str(servo['joint']))
        servo['min_rad'] = min(max(limits[0], low), 0.0)
        servo['max_rad'] = max(min(limits[1], high), 0.0)
        servos = list(self._draft.servos)
        servos[self._index] = servo
        all_found = list(self._draft.found)
        all_found[self._index] |= {found} if found else set()
        if servo['direction'] != self._servo['direction']:
            all_found[self._index] -= {'direction'}
        self._keep(replace(self._draft, servos=tuple(servos), found=tuple(all_found)))
        self.message = message

    def _keep(self, draft: Draft) -> None:
        self._undo.append(self._draft)
        self._draft = draft
        self.saved = False

    def _take_back(self) -> None:
        if not self._undo:
            self.message = 'nothing to undo'
            return
        self.relax()
        self._draft = self._undo.pop()
        self._bank.set_oscillator(self._draft.board.oscillator_hz)
        self.saved = False
        self.message = 'undone, relaxed'
