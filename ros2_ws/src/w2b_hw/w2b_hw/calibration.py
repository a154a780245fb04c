"""
Calibration: what makes a pulse of an angle, for each servo, and what the board's clock runs at.

Kept as YAML that people can read, with a checksum over everything else in it: a file that was cut
short or edited by hand does not arm the robot.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import yaml

from w2b_core import plain_yaml
from w2b_core.bodies.chips import SERVO_BOARD
from w2b_core.bodies.wiring import NOMINAL_US_PER_RAD, NOMINAL_ZERO_US, Wiring
from w2b_core.files import write_atomically
from w2b_core.sensor_frames import shown
from w2b_core.shell import w2b_command
from w2b_hw.joints import TWIN, JointList

#: Where the robot's own calibration is kept.
DEFAULT_PATH = Path('~/.config/w2b/calibration.yaml')
FORMAT, VERSION = 'w2b-calibration', 1
#: No servo of this class is driven beyond these, whatever a file says.
SHORTEST_US, LONGEST_US = 500.0, 2500.0
#: What servos turn by: those of 270 and of 120 degrees are within it, a wrong mark is often not.
PLAUSIBLE_US_PER_RAD = (400.0, 900.0)
_ROUNDING_US = 5.0
HOW_TO_FINISH = ('find zero (z), mark (m) and direction (t) of each with '
                 f'`{w2b_command("calibrate")}`')
HOW_TO_MAKE = f'make one with `{w2b_command("calibrate")}`'


class CalibrationError(ValueError):
    """No usable calibration: one line says what is wrong, and `fix` what to do about it."""

    def __init__(self, problem: str, fix: str = '') -> None:
        super().__init__(f'{problem}: {fix}' if fix else problem)
        self.problem, self.fix = problem, fix


@dataclass(frozen=True)
class Board:
    """The PCA9685 board: `oscillator_hz` is measured, boards are off by up to 8%."""

    address: int = SERVO_BOARD.addresses[0]
    oscillator_hz: float = 25e6
    frequency_hz: float = 50.0

    def __post_init__(self) -> None:
        """Check the ranges (CalibrationError)."""
        _expect_whole('board', 'address', self.address, 0x40, 0x7F)
        _expect('board', 'oscillator_hz', self.oscillator_hz, 20e6, 30e6)
        _expect('board', 'frequency_hz', self.frequency_hz, 40.0, 60.0)


@dataclass(frozen=True)
class Servo:
    """
    One servo: pulse = zero_us + direction * us_per_rad * angle.

    Attributes
    ----------
    joint, channel
        The joint it turns, and its output on the board.
    direction
        1 if a longer pulse turns the joint in its positive sense, else -1.
    zero_us, us_per_rad
        Pulse at angle 0, and how much it changes for a radian.
    min_us, max_us, min_rad, max_rad
        The range in which it turns freely, as pulses and as angles. Both hold.
    calibrated
        Whether a person found its zero and its mark on this robot, and said that its positive
        direction is the body's. The servos of the emulated, ideal robot count as calibrated.

    """

    joint: str
    channel: int
    direction: int = 1
    zero_us: float = NOMINAL_ZERO_US
    us_per_rad: float = NOMINAL_US_PER_RAD
    min_us: float = SHORTEST_US
    max_us: float = LONGEST_US
    min_rad: float = -math.radians(45)
    max_rad: float = math.radians(45)
    calibrated: bool = True

    def __post_init__(self) -> None:
        """Check the ranges, and that pulses and angles agree (CalibrationError)."""
        if not isinstance(self.joint, str):
            raise CalibrationError(f'servo: joint: expected a name, got {self.joint!r}')
        name = f'servo {self.joint}'
        _expect_whole(name, 'channel', self.channel, 0, 15)
        if type(self.direction) is not int or self.direction not in (1, -1):
            raise CalibrationError(f'{name}: direction: expected 1 or -1, got {self.direction!r}')
        if not isinstance(self.calibrated, bool):
            raise CalibrationError(f'{name}: calibrated: expected true or false, '
                                   f'got {self.calibrated!r}')
        _expect(name, 'us_per_rad', self.us_per_rad, 200.0, 2000.0)
        _expect(name, 'min_us', self.min_us, SHORTEST_US, LONGEST_US)
        _expect(name, 'max_us', self.max_us, self.min_us, LONGEST_US)
        _expect(name, 'zero_us', self.zero_us, self.min_us, self.max_us)
        _expect(name, 'min_rad', self.min_rad, -math.pi, 0.0)
        _expect(name, 'max_rad', self.max_rad, 0.0, math.pi)
        for field, angle_rad in (('min_rad', self.min_rad), ('max_rad', self.max_rad)):
            pulse_us = self._unlimited_us(angle_rad)
            if not self.min_us - _ROUNDING_US <= pulse_us <= self.max_us + _ROUNDING_US:
                raise CalibrationError(
                    f'{name}: {field} {angle_rad:.3f} rad needs a pulse of {pulse_us:.0f} us, '
                    f'outside its {self.min_us:.0f}..{self.max_us:.0f} us', 'calibrate it again')

    @property
    def doubt(self) -> str:
        """What about it is implausible; empty if nothing is."""
        low, high = PLAUSIBLE_US_PER_RAD
        if low <= self.us_per_rad <= high:
            return ''
        return (f'{self.joint}: {self.us_per_rad:.0f} us/rad, where servos have {low:.0f} to '
                f'{high:.0f}: was it really at its mark?')

    def pulse_us(self, angle_rad: float) -> float:
        """Return the pulse for an angle, within the servo's limits whatever the angle."""
        angle_rad = min(max(angle_rad, self.min_rad), self.max_rad)
        return min(max(self._unlimited_us(angle_rad), self.min_us), self.max_us)

    def angle_rad(self, pulse_us: float) -> float:
        """Return the angle that a pulse turns the joint to."""
        return self.direction * (pulse_us - self.zero_us) / self.us_per_rad

    def _unlimited_us(self, angle_rad: float) -> float:
        return self.zero_us + self.direction * self.us_per_rad * angle_rad


@dataclass(frozen=True)
class Calibration:
    """Board and servos of one robot, the servos in the order of its body's joints."""

    board: Board
    servos: tuple[Servo, ...]
    joints: JointList = TWIN

    def __post_init__(self) -> None:
        """Check that every joint has one servo and a channel of its own (CalibrationError)."""
        joints, names = [servo.joint for servo in self.servos], self.joints.names
        if sorted(joints) != sorted(names):
            missing = sorted(set(names) - set(joints))
            unknown = sorted(set(joints) - set(names))
            raise CalibrationError(
                f'servos: expected each of the {len(names)} joints once, got {len(joints)}; '
                f'missing {missing or "none"}, unknown {unknown or "none"}')
        channels = [servo.channel for servo in self.servos]
        if len(set(channels)) != len(channels):
            twice = sorted({c for c in channels if channels.count(c) > 1})
            raise CalibrationError(f'servos: channel {twice[0]} is used by more than one servo')
        ordered = sorted(self.servos, key=lambda servo: names.index(servo.joint))
        object.__setattr__(self, 'servos', tuple(ordered))

    @property
    def problem(self) -> str:
        """Why it must not drive a robot though all values are in order; empty if it may."""
        lacking = [servo.joint for servo in self.servos if not servo.calibrated]
        if not lacking:
            return ''
        return (f'{len(self.servos) - len(lacking)} of {len(self.servos)} servos are calibrated; '
                f'not {shown(lacking)}')


def nominal(calibrated: bool = True, joints: JointList = TWIN) -> Calibration:
    """
    Return what an ideal robot of these joints has, wired as the body's file says.

    To start calibrating from, it is not `calibrated`.
    """
    return Calibration(Board(), tuple(
        _nominal(joint, low, high, wired, calibrated) for joint, low, high, wired in zip(
            joints.names, joints.lower_rad, joints.upper_rad, joints.wiring, strict=True)), joints)


def _nominal(joint: str, low: float, high: float, wired: Wiring, calibrated: bool) -> Servo:
    least, most = sorted(wired.direction * (end_us - wired.zero_us) / wired.us_per_rad
                         for end_us in (SHORTEST_US, LONGEST_US))
    return Servo(joint, wired.channel, wired.direction, wired.zero_us, wired.us_per_rad,
                 min_rad=min(max(low, least), 0.0), max_rad=max(min(high, most), 0.0),
                 calibrated=calibrated)


def load(path: Path, joints: JointList = TWIN) -> Calibration:
    """
    Return the calibration in a file, of a robot with these joints.

    Raises
    ------
    CalibrationError
        If the file is missing, cannot be read, has another format or version, a field is missing,
        unknown or out of range, or the checksum does not fit.

    """
    document = _document(path)
    try:
        return _parsed(document, joints)
    except CalibrationError as error:
        raise CalibrationError(f'{path}: {error.problem}', error.fix) from None


def _document(path: Path) -> Any:
    try:
        return plain_yaml.load(path.read_text(encoding='utf-8'))
    except FileNotFoundError:
        raise CalibrationError(f'no calibration file at {path}', HOW_TO_MAKE) from None
    except RecursionError:
        raise CalibrationError(f'{path} cannot be read (too deep)', HOW_TO_MAKE) from None
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        reason = (isinstance(error, OSError) and error.strerror) or str(error).splitlines()[0]
        raise CalibrationError(f'{path} cannot be read ({reason})', HOW_TO_MAKE) from None


def save(calibration: Calibration, path: Path) -> None:
    """
    Write the file, whole or not at all, and read it back.

    Raises
    ------
    OSError
        If it cannot be written.
    CalibrationError
        If what is read back is not what was written.

    """
    body: dict[str, Any] = {'format': FORMAT, 'version': VERSION,
                            'board': asdict(calibration.board),
                            'servos': [asdict(servo) for servo in calibration.servos]}
    text = yaml.safe_dump({**body, 'checksum': checksum(body)}, sort_keys=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(path, text.encode())
    if load(path, calibration.joints) != calibration:
        raise CalibrationError(f'{path} does not hold what was written', 'save it elsewhere')


def checksum(body: Mapping[str, Any]) -> str:
    """Return the SHA-256 of everything in the file but the checksum, as canonical JSON."""
    return hashlib.sha256(
        json.dumps(body, sort_keys=True, separators=(',', ':')).encode()).hexdigest()


def _parsed(document: Any, joints: JointList) -> Calibration:
    body = dict(_mapping('file', document, ('format', 'version', 'board', 'servos', 'checksum')))
    _check_version(body)
    stated = body.pop('checksum')
    try:
        actual = checksum(body)
    except (TypeError, ValueError):
        raise CalibrationError('expected plain values only', HOW_TO_MAKE) from None
    if stated != actual:
        raise CalibrationError('the checksum does not fit, so the file was cut short or edited by '
                               'hand', 'calibrate again, or check every value and seal it with '
                               f'`{w2b_command("calibrate --seal")}`')
    return _built(body, joints)


def seal(path: Path, joints: JointList = TWIN) -> Calibration:
    """
    Give a file that was edited by hand a new checksum, if all else in it is in order; return it.

    Raises what `load` does.
    """
    document = _document(path)
    try:
        built = _built(dict(_mapping('file', document,
                                     ('format', 'version', 'board', 'servos', 'checksum'))),
                       joints)
    except CalibrationError as error:
        raise CalibrationError(f'{path}: {error.problem}', error.fix) from None
    save(built, path)
    return built


def _built(body: Mapping[str, Any], joints: JointList) -> Calibration:
    _check_version(body)
    if not isinstance(body['servos'], list):
        raise CalibrationError(f'servos: expected a list, got {type(body["servos"]).__name__}')
    board = Board(**_mapping('board', body['board'], _names(Board)))
    # A file from before servos were marked says of none that it was calibrated.
    servos = [Servo(**_mapping(f'servos[{n}]', {'calibrated': False, **servo}
                               if isinstance(servo, dict) else servo, _names(Servo)))
              for n, servo in enumerate(body['servos'])]
    return Calibration(board, tuple(servos), joints)


def _check_version(body: Mapping[str, Any]) -> None:
    given = (body['format'], body['version'])
    if given != (FORMAT, VERSION) or type(body['version']) is not int:
        raise CalibrationError(f'expected {FORMAT} version {VERSION}, got {given[0]!r} '
                               f'version {given[1]!r}', HOW_TO_MAKE)


def _names(kind: type[Board] | type[Servo]) -> Sequence[str]:
    return [field.name for field in fields(kind)]


def _mapping(where: str, value: Any, names: Sequence[str]) -> Mapping[str, Any]:
    if not isinstance(value, dict):
        raise CalibrationError(f'{where}: expected fields, got {type(value).__name__}',
                               HOW_TO_MAKE)
    if set(value) != set(names):
        missing = [name for name in names if name not in value]
        unknown = [str(name) for name in value if name not in names]
        raise CalibrationError(f'{where}: missing {missing or "none"}, unknown '
                               f'{unknown or "none"}', HOW_TO_MAKE)
    return value


def _expect_whole(where: str, field: str, value: Any, low: int, high: int) -> None:
    if not isinstance(value, int) or isinstance(value, bool) or not low <= value <= high:
        raise CalibrationError(f'{where}: {field}: expected {low} to {high}, got {value!r}'
                               + ('' if isinstance(value, int) else ', which is no whole number'))


def _expect(where: str, field: str, value: Any, low: float, high: float) -> None:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if not number or not low <= value <= high or not math.isfinite(value):
        raise CalibrationError(f'{where}: {field}: expected {low:g} to {high:g}, got {value!r}')
