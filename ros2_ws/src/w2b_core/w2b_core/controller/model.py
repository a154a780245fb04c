"""A controller: a network with the body, wiring and words that it was evolved for."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field, fields
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from w2b_core import bodies, senses
from w2b_core.bodies import description
from w2b_core.bodies.model import Body
from w2b_core.courses import Course
from w2b_core.json_fields import JsonFileError, Text, expect
from w2b_core.network import LeakyNetwork, Network

Array = NDArray[np.float64]

#: Beyond these a sum of weighted neurons could overflow, and the network would think NaN.
MAX_WEIGHT = 1e6
#: No hinge turns farther than once.
MAX_ANGLE_RAD = 2 * np.pi


class WordVectors(Protocol):
    """What gives words their vectors: a `Vocabulary`."""

    def vector(self, word: str) -> Array:
        """Return the vector of `word`, or raise ValueError if there is none."""


class Ear(Protocol):
    """What a controller needs of an ear: see `w2b_core.hearing`."""

    @property
    def behaviours(self) -> tuple[str, ...]:
        """Names in the order of the command that it gives."""

    def to_json(self) -> dict[str, Any]:
        """Return the ear as a JSON object."""


def vector_sha256(vector: Array) -> str:
    """Return the SHA-256 of a vector's little-endian float32 bytes."""
    return hashlib.sha256(np.asarray(vector, dtype='<f4').tobytes()).hexdigest()


@dataclass(frozen=True)
class Motor:
    """A joint and the motor neuron that drives it; the neuron's -1..1 spans the limits."""

    joint: str
    lower_rad: float
    upper_rad: float
    time_constant: float


@dataclass(frozen=True)
class TrainedWord:
    """
    A word of the training set.

    `behaviour` is a name such as `forward`, `sha256` the `vector_sha256` of the vector that was
    heard, `score` the objective's value under this word, None if it was not recorded.
    """

    word: str
    behaviour: str
    sha256: str
    score: float | None = None


@dataclass(frozen=True, eq=False)
class Controller:
    """
    One evolved controller.

    Attributes
    ----------
    body
        Name of the body that it was evolved for.
    network
        A single one: serial, primed with words, or leaky, driven by an ear's command.
    sensors
        S names in the order of the sensor neurons, see `w2b_core.senses`.
    motors
        M joints in the order of the motor neurons.
    period_s
        Of one step of the network.
    words
        That the controller was trained on.
    record
        How it came about: any JSON object.
    vector_length
        Of a word's vector.
    behaviours, courses
        K names in the order of a leaky network's command, and where each takes the body.
    ear
        What turns words into that command; None for a serial network, which hears by itself.
    carried
        The body itself, where it is none that comes with the program: a maker's file, a plugin.

    Raises
    ------
    JsonFileError
        If the parts do not belong together, or a value is not one that a file can hold.

    """

    body: str
    network: Network | LeakyNetwork
    sensors: tuple[str, ...]
    motors: tuple[Motor, ...]
    period_s: float
    words: tuple[TrainedWord, ...]
    record: dict[str, Any] = field(default_factory=dict)
    vector_length: int = 300
    behaviours: tuple[str, ...] = ()
    courses: tuple[Course, ...] = ()
    ear: Ear | None = None
    carried: Body | None = None

    def __post_init__(self) -> None:
        """Check what the types alone do not say."""
        expect(_is_name(self.body), 'body', 'a name of letters, digits and _', self.body)
        expect(1e-6 <= self.period_s <= 10, 'period_s',
               'more than 0 (at least 1e-6) and at most 10 s', self.period_s)
        expect(self.vector_length >= 1, 'network.vector_length', 'at least 1', self.vector_length)
        self._check_sensors()
        self._check_motors()
        self._check_carried()
        if isinstance(self.network, LeakyNetwork):
            self._check_leaky(self.network)
        else:
            self._check_serial(self.network)
        self._check_words()

    def _check_carried(self) -> None:
        if self.carried is None:
            return
        expect(self.carried.name == self.body, 'body_description.name', repr(self.body),
               self.carried.name)
        joints = tuple(joint.name for joint in self.carried.joints)
        expect(set(self.joints) == set(joints), 'body_description.joints',
               f'those of the motors, {", ".join(self.joints)}', Text(', '.join(joints)))

    def _check_motors(self) -> None:
        seen: set[str] = set()
        for index, motor in enumerate(self.motors):
            name = f'network.motors[{index}]'
            expect(_is_name(motor.joint), f'{name}.joint', 'a name', motor.joint)
            expect(motor.joint not in seen, f'{name}.joint', 'a joint not named before',
                   motor.joint)
            seen.add(motor.joint)
            expect(motor.lower_rad <= motor.upper_rad, f'{name}.upper_rad',
                   f'at least lower_rad, {motor.lower_rad!r}', motor.upper_rad)
            expect(max(-motor.lower_rad, motor.upper_rad) <= MAX_ANGLE_RAD, f'{name}.upper_rad',
                   'limits of at most one turn, 6.2832 rad',
                   max(-motor.lower_rad, motor.upper_rad))
            expect(0 < motor.time_constant <= MAX_WEIGHT, f'{name}.time_constant',
                   f'more than 0 and at most {MAX_WEIGHT:g}', motor.time_constant)

    def _check_sensors(self) -> None:
        joints = [motor.joint for motor in self.motors]
        for index, sensor in enumerate(self.sensors):
            name = f'network.sensors[{index}]'
            try:
                kind, place = senses.split(sensor)
            except ValueError as error:
                raise JsonFileError(f'{name}: {error}') from None
            expect(not place or _is_name(place), name, 'names of letters, digits and _', sensor)
            expect(senses.SENSES.get(kind).source != 'joint' or place in joints, name,
                   'a joint of network.motors', sensor)
            expect(sensor not in self.sensors[:index], name, 'a sensor not named before', sensor)

    def _check_leaky(self, network: LeakyNetwork) -> None:
        expect(network.hidden.ndim == 2, 'network.hidden', 'one controller, (H, H)',
               network.hidden.shape)
        sizes = network.sizes
        for axis, name, count in (('K', 'behaviours', len(self.behaviours)),
                                  ('S', 'network.sensors', len(self.sensors)),
                                  ('M', 'network.motors', len(self.motors))):
            expect(sizes[axis] == count, name, f'{sizes[axis]}, as the network has', count)
        expect(len(self.courses) == len(self.behaviours), 'behaviours',
               'a course of each', len(self.courses))
        for index, name in enumerate(self.behaviours):
            expect(_is_name(name) and name not in self.behaviours[:index],
                   f'behaviours[{index}].name', 'a name not listed before', name)
            course = self.courses[index]
            expect(course.along in (-1, 0, 1) and course.turn in (-1, 0, 1),
                   f'behaviours[{index}]', 'along and turn of -1, 0 or 1', tuple(course))
        expect(self.ear is not None, 'ear', 'an ear, for a network that takes commands',
               Text('none'))
        assert self.ear is not None
        expect(tuple(self.ear.behaviours) == self.behaviours, 'ear.behaviours',
               f'those of the controller, {", ".join(self.behaviours)}',
               Text(', '.join(self.ear.behaviours)))

    def _check_serial(self, network: Network) -> None:
        hidden, motor = network.hidden_weights, network.motor_weights
        expect(self.ear is None, 'ear', 'none, for a network that is primed', self.ear)
        expect(hidden.ndim == 2, 'network.hidden_weights', 'one controller, (H, H + 1 + S)',
               hidden.shape)
        for name, weights in (('hidden', hidden), ('motor', motor)):
            expect(bool(np.isfinite(weights).all()), f'network.{name}_weights', 'finite numbers',
                   Text('NaN or infinity'))
            expect(bool((np.abs(weights) <= MAX_WEIGHT).all()), f'network.{name}_weights',
                   f'numbers of at most {MAX_WEIGHT:g}', float(np.abs(weights).max()))
        count = len(hidden)
        expect(network.sensor_count == len(self.sensors), 'network.hidden_weights',
               f'rows of {count + 1 + len(self.sensors)} ({count} hidden neurons, 1 auditory, '
               f'{len(self.sensors)} sensors)', Text(f'rows of {hidden.shape[1]}'))
        expect(len(motor) == len(self.motors), 'network.motor_weights',
               f'{len(self.motors)} rows, one for each of network.motors',
               Text(f'{len(motor)} rows'))
        constants = tuple(motor.time_constant for motor in self.motors)
        expect(tuple(network.motor_time_constants.tolist()) == constants,
               'network.motor_time_constants', f'those of the motors, {constants}',
               network.motor_time_constants.tolist())

    def _check_words(self) -> None:
        seen: set[str] = set()
        for index, word in enumerate(self.words):
            name = f'words[{index}]'
            expect(0 < len(word.word) <= 100 and word.word.isprintable(), f'{name}.word',
                   '1 to 100 printable characters', word.word)
            expect(word.word not in seen, f'{name}.word', 'a word not listed before', word.word)
            seen.add(word.word)
            expect(_is_name(word.behaviour), f'{name}.behaviour',
                   'a name of letters, digits and _', word.behaviour)
            expect(len(word.sha256) == 64 and not set(word.sha256) - set('0123456789abcdef'),
                   f'{name}.sha256', '64 lower-case hexadecimal digits', word.sha256)

    def __eq__(self, other: object) -> bool:
        """Return whether both are the same to the last bit."""
        return isinstance(other, Controller) and self._parts() == other._parts()

    __hash__ = None  # type: ignore[assignment]

    def _parts(self) -> tuple[object, ...]:
        parts = (vars(self.network)[name.name] for name in fields(self.network))
        return (self.body, self.sensors, self.motors, self.period_s, self.words, self.record,
                self.vector_length, self.behaviours, self.courses,
                None if self.ear is None else self.ear.to_json(), self.carried, type(self.network),
                *((part.shape, part.tobytes()) for part in parts))

    @property
    def serial(self) -> Network:
        """The network of a controller that is primed with words (JsonFileError if not)."""
        if not isinstance(self.network, Network):
            raise JsonFileError('network: expected one that is primed with words, '
                                'got one that an ear commands')
        return self.network

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints, in the order of the motor neurons."""
        return tuple(motor.joint for motor in self.motors)

    def described(self) -> Body:
        """Return the body: the one that it carries, else the registered one (ValueError)."""
        return bodies.get(self.body) if self.carried is None else self.carried

    def refuse_another_body(self, body: Body) -> None:
        """Raise JsonFileError, with both hashes, if `body` is not the one it carries."""
        if self.carried is None or body.name != self.body:
            expect(body.name == self.body, 'body', f'{self.body}, which the controller moves',
                   body.name)
            return
        mine, yours = description.sha256(self.carried), description.sha256(body)
        expect(mine == yours, 'body', f'{body.name} as it was when the controller was made '
               f'({mine[:12]})', Text(f'{body.name} changed since ({yours[:12]}): train it again, '
                                      'or use the body that the controller carries'))

    @property
    def topics(self) -> frozenset[str]:
        """Topics that its senses are measured on."""
        return frozenset(senses.SENSES.get(senses.split(sensor)[0]).topic
                         for sensor in self.sensors) - {''}

    def targets_rad(self, motors: Array) -> Array:
        """Return the joint angles (..., M) that motor neurons (..., M) ask for."""
        lower = np.array([motor.lower_rad for motor in self.motors])
        upper = np.array([motor.upper_rad for motor in self.motors])
        targets: Array = lower + (motors + 1) / 2 * (upper - lower)
        return targets

    def changed_words(self, vocabulary: WordVectors) -> tuple[str, ...]:
        """Return the trained words whose vectors are missing in `vocabulary` or are others."""
        changed = []
        for word in self.words:
            try:
                same = vector_sha256(vocabulary.vector(word.word)) == word.sha256
            except ValueError:
                same = False
            if not same:
                changed.append(word.word)
        return tuple(changed)


def _is_name(text: str) -> bool:
    return 0 < len(text) <= 100 and text.isascii() and text.replace('_', 'a').isalnum()
