"""The maker's YAML: what a URDF does not say about a robot, checked field by field."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from w2b_core import plain_yaml
from w2b_core.bodies.model import Box, Capsule, Cylinder, Placed, Shape, Sphere, Vector
from w2b_core.bodies.robot_file.findings import Findings, shown
from w2b_core.bodies.wiring import Wiring, WiringError

#: Heading of the robot in its URDF -> the yaw that turns it to +x, in quarter turns.
FORWARD = {'+x': 0, '+y': -1, '-x': 2, '-y': 1}
FEET = ('front_left', 'front_right', 'back_left', 'back_right')
KEYS = ('urdf', 'body', 'name', 'forward', 'locked', 'stand', 'feet', 'servo', 'swing_rad',
        'weigh_kg', 'masses_kg', 'shapes', 'length_m', 'servos')
DEFAULT_SWING_RAD, DEFAULT_GAIN_PER_S = 0.4, 20.0
MAX_BYTES = 1_000_000
_SHAPES: dict[str, tuple[str, ...]] = {
    'box': ('size_m',), 'sphere': ('radius_m',), 'capsule': ('radius_m', 'length_m', 'axis'),
    'cylinder': ('radius_m', 'length_m', 'axis')}


@dataclass(frozen=True)
class Foot:
    """A foot: its link, and the radius of the sphere that it is; None: the link's own shapes."""

    link: str
    radius_m: float | None = None


@dataclass(frozen=True)
class ServoData:
    """What all servos of the robot can do, as measured or from a data sheet."""

    torque_nm: float
    speed_rad_s: float
    gain_per_s: float = DEFAULT_GAIN_PER_S


@dataclass(frozen=True)
class Settings:
    """
    A maker's file.

    Attributes
    ----------
    urdf, body
        The description: a file beside this one, or the name of a registered body. One of them.
    forward
        Where the robot faces in its URDF, a key of `FORWARD`.
    locked
        Patterns of joints that are held where they stand.
    stand_rad, swing_rad, masses_kg
        Pattern of joints or links -> value; of two that fit the later counts. Angles are the
        URDF's.
    feet
        Name of `FEET` -> foot.
    shapes
        URDF link -> shapes in its frame, in place of its own.
    weigh_kg, length_m
        What the whole robot weighs, and the body length; None: as described.
    wiring
        Joint -> output and pulses of its servo; empty where the file says nothing.

    """

    path: Path
    name: str
    urdf: Path | None
    body: str = ''
    forward: str = '+x'
    locked: tuple[str, ...] = ()
    stand_rad: dict[str, float] = field(default_factory=dict)
    feet: dict[str, Foot] = field(default_factory=dict)
    servo: ServoData | None = None
    swing_rad: dict[str, float] = field(default_factory=dict)
    weigh_kg: float | None = None
    masses_kg: dict[str, float] = field(default_factory=dict)
    shapes: dict[str, tuple[Placed, ...]] = field(default_factory=dict)
    length_m: float | None = None
    wiring: dict[str, Wiring] = field(default_factory=dict)


def of_pattern(values: Mapping[str, float], name: str) -> float | None:
    """Return the value of the last pattern that a name fits; None if it fits none."""
    fitting = [value for pattern, value in values.items() if fnmatchcase(name, pattern)]
    return fitting[-1] if fitting else None


def read_settings(path: Path, found: Findings, text: str | None = None) -> Settings:
    """
    Return what a maker's file says, or `text` that is to be written there.

    RobotFileError if it is not in order; every wrong field is among `found`.
    """
    try:
        if text is None and path.stat().st_size > MAX_BYTES:
            raise found.refuse('', f'more than {MAX_BYTES:,} bytes', 'give a YAML of a few lines')
        document = plain_yaml.load(path.read_text(encoding='utf-8') if text is None else text)
    except (OSError, UnicodeDecodeError, yaml.YAMLError, RecursionError) as error:
        reason = (isinstance(error, OSError) and error.strerror) or ' '.join(str(error).split())
        raise found.refuse('', f'expected a YAML file, got nothing readable ({reason[:200]})',
                           '`w2b robot init my_robot.urdf` drafts one') from None
    if not isinstance(document, dict):
        raise found.refuse('', f'expected fields such as urdf: my_robot.urdf, got '
                           f'{type(document).__name__}', '`w2b robot init` drafts them')
    reader = _Reader(document, path, found)
    settings = reader.settings()
    found.stop_at_errors()
    return settings


class _Reader:
    def __init__(self, document: dict[str, Any], path: Path, found: Findings) -> None:
        self._top, self._path, self._found = document, path, found

    def settings(self) -> Settings:
        top, found = self._top, self._found
        for key in top:
            if key not in KEYS:
                found.error(shown(key)[1:-1], 'is no field of a robot',
                            f'the fields are {", ".join(KEYS)}')
        urdf, body = (top.get(name) for name in ('urdf', 'body'))
        if (urdf is None) == (body is None) or not isinstance(urdf or body, str):
            raise found.refuse('urdf', 'expected the name of a URDF beside this file, got '
                               f'{shown(urdf)}', 'or `body:` with the name of a registered body')
        name = top.get('name') or re.sub(r'\W', '_', self._path.stem)
        if not isinstance(name, str) or not re.fullmatch(r'[A-Za-z][A-Za-z0-9_]{0,99}', name):
            found.error('name', f'expected a letter, then letters, digits and _, got {shown(name)}',
                        'rename it')
            name = 'robot'
        forward = top.get('forward', '+x')
        if forward not in FORWARD:
            found.error('forward', f'expected one of {", ".join(FORWARD)}, got {shown(forward)}',
                        'say where the robot faces in its URDF')
            forward = '+x'
        locked = top.get('locked', [])
        if not isinstance(locked, list) or not all(isinstance(joint, str) for joint in locked):
            found.error('locked', f'expected a list of joints, got {shown(locked)}', 'as in [head]')
            locked = []
        return Settings(
            self._path, name, self._inside('urdf', urdf) if urdf else None, body or '', forward,
            tuple(locked), self._by_pattern('stand', -10.0, 10.0), self._feet(), self._servo(),
            self._by_pattern('swing_rad', 0.01, 3.2, default='*'),
            self._number('weigh_kg', top.get('weigh_kg'), 0.01, 100.0),
            self._by_pattern('masses_kg', 1e-5, 50.0), self._shapes(),
            self._number('length_m', top.get('length_m'), 0.01, 3.0), self._wiring())

    def _inside(self, where: str, name: str) -> Path:
        """Return a path beside this file; one that leaves the folder is an error."""
        return inside(self._path.parent, name, where, self._found)

    def _number(self, where: str, value: Any, low: float, high: float) -> float | None:
        if value is None:
            return None
        if isinstance(value, bool) or not isinstance(value, int | float) or not (
                isfinite(value) and low <= value <= high):
            self._found.error(where, f'expected a number, {low:g} to {high:g}, got {shown(value)}',
                              'correct it')
            return None
        return float(value)

    def _mapping(self, where: str, value: Any, known: tuple[str, ...] = ()) -> dict[str, Any]:
        if value is None:
            return {}
        if not isinstance(value, dict):
            self._found.error(where, f'expected names and values, got {shown(value)}',
                              'as in {name: value}')
            return {}
        for key in value:
            if known and key not in known:
                self._found.error(f'{where}.{shown(key)[1:-1]}', 'is no field here',
                                  f'expected some of {", ".join(known)}')
        return value

    def _by_pattern(self, key: str, low: float, high: float, default: str = ''
                    ) -> dict[str, float]:
        values = {}
        for pattern, value in self._mapping(key, self._top.get(key)).items():
            number = self._number(f'{key}.{pattern}', value, low, high)
            if number is not None:
                values[default if default and pattern == 'default' else pattern] = number
        if default and default in values:  # the general one first: later ones count
            values = {default: values.pop(default), **values}
        return values

    def _feet(self) -> dict[str, Foot]:
        feet = {}
        for name, value in self._mapping('feet', self._top.get('feet'), FEET).items():
            part = {'link': value} if isinstance(value, str) else self._mapping(
                f'feet.{name}', value, ('link', 'radius_m'))
            if not isinstance(part.get('link'), str):
                self._found.error(f'feet.{name}', f'expected a link, got {shown(part.get("link"))}',
                                  'as in {link: fl_foot, radius_m: 0.01}')
                continue
            feet[name] = Foot(part['link'], self._number(
                f'feet.{name}.radius_m', part.get('radius_m'), 1e-4, 0.5))
        return feet

    def _servo(self) -> ServoData | None:
        if 'servo' not in self._top:
            return None
        part = self._mapping('servo', self._top['servo'], ('torque_nm', 'speed_rad_s',
                                                           'gain_per_s'))
        torque = self._number('servo.torque_nm', part.get('torque_nm'), 0.001, 100.0)
        speed = self._number('servo.speed_rad_s', part.get('speed_rad_s'), 0.1, 100.0)
        gain = self._number('servo.gain_per_s', part.get('gain_per_s'), 1.0, 200.0)
        if torque is None or speed is None:
            return None
        return ServoData(torque, speed, gain or DEFAULT_GAIN_PER_S)

    def _shapes(self) -> dict[str, tuple[Placed, ...]]:
        shapes = {}
        for link, parts in self._mapping('shapes', self._top.get('shapes')).items():
            where = f'shapes.{link}'
            if not isinstance(parts, list) or not parts:
                self._found.error(where, f'expected a list of shapes, got {shown(parts)}',
                                  'as in [{box: {size_m: [0.1, 0.1, 0.04]}}]')
                continue
            made = [self._shape(f'{where}[{number}]', part) for number, part in enumerate(parts)]
            shapes[link] = tuple(placed for placed in made if placed is not None)
        return shapes

    def _shape(self, where: str, value: Any) -> Placed | None:
        part = self._mapping(where, value, (*_SHAPES, 'at_m', 'rpy_rad'))
        kinds = [kind for kind in _SHAPES if kind in part]
        if len(kinds) != 1:
            self._found.error(where, f'expected one of {", ".join(_SHAPES)}, got {shown(value)}',
                              'as in {sphere: {radius_m: 0.01}}')
            return None
        (kind,) = kinds
        sizes = self._mapping(f'{where}.{kind}', part[kind], _SHAPES[kind])
        def size(name: str) -> float:
            number = self._number(f'{where}.{kind}.{name}', sizes.get(name, ''), 1e-5, 5.0)
            return number or 1.0
        axis = self._vector(f'{where}.{kind}.axis', sizes.get('axis', [0, 0, 1]))
        norm = float(np.linalg.norm(axis))
        if not norm > 1e-6:
            self._found.error(f'{where}.{kind}.axis', 'expected a direction, got zeros',
                              'as in [0, 0, 1]')
            norm = 1.0
        axis = axis[0] / norm, axis[1] / norm, axis[2] / norm
        shape: Shape
        if kind == 'box':
            shape = Box(self._vector(f'{where}.box.size_m', sizes.get('size_m'), least=1e-5))
        elif kind == 'sphere':
            shape = Sphere(size('radius_m'))
        else:
            shape = (Capsule if kind == 'capsule' else Cylinder)(
                size('length_m'), size('radius_m'), axis)
        return Placed(shape, self._vector(f'{where}.at_m', part.get('at_m', [0, 0, 0])),
                      self._vector(f'{where}.rpy_rad', part.get('rpy_rad', [0, 0, 0])))

    def _vector(self, where: str, value: Any, least: float = -10.0) -> Vector:
        if not isinstance(value, list) or len(value) != 3:
            self._found.error(where, f'expected 3 numbers, got {shown(value)}', 'as in [0, 0, 1]')
            return 1.0, 1.0, 1.0
        x, y, z = (self._number(f'{where}[{number}]', part, least, 10.0)
                   for number, part in enumerate(value))
        return x or 0.0, y or 0.0, z or 0.0

    def _wiring(self) -> dict[str, Wiring]:
        wiring = {}
        fields = ('channel', 'direction', 'zero_us', 'us_per_rad')
        for joint, value in self._mapping('servos', self._top.get('servos')).items():
            part = self._mapping(f'servos.{joint}', value, fields)
            try:
                wiring[joint] = Wiring(**{name: part[name] for name in fields if name in part})
            except (WiringError, TypeError) as error:
                self._found.error(f'servos.{joint}', str(error) if isinstance(error, WiringError)
                                  else 'expected a channel', 'as in {channel: 0, direction: 1}')
        channels = [one.channel for one in wiring.values()]
        for channel in sorted({one for one in channels if channels.count(one) > 1}):
            self._found.error('servos', f'channel {channel} is given to more than one joint',
                              'give each servo its own')
        return wiring


def inside(folder: Path, name: str, where: str, found: Findings) -> Path:
    """Return a path in `folder`; one that leaves it is noted as an error."""
    path = folder / name
    try:
        home = folder.resolve()
        leaves = Path(name).is_absolute() or not path.resolve().is_relative_to(home)
    except (OSError, ValueError, RuntimeError):
        leaves = True
    if leaves or '\0' in name:
        raise found.refuse(where, f'{shown(name)} leaves the folder of the file that names it',
                           'put it beside that file')
    return path
