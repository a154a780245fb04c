"""
A controller's network closing the loop with a body, one control period at a time.

The same for both architectures: `hear` a command, then for every frame read `motors` and `feel`
what the body senses. The motors that answer a frame are those *before* the network feels it, as in
the original program.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from w2b_core import senses
from w2b_core.controller.model import Controller
from w2b_core.courses import Course, held
from w2b_core.hearing.heard import Heard
from w2b_core.network import LeakyNetwork, LeakyState, Network, State, leaky, serial
from w2b_core.senses import Readings, Reference

Array = NDArray[np.float64]


class Mind(Protocol):
    """What closes the loop; see the module."""

    @property
    def motors(self) -> Array:
        """The motor neurons (M,) now, -1..1; zeros, the middle of the joints, while it stands."""

    @property
    def follows(self) -> bool:
        """Whether it follows a command."""

    def hear(self, heard: Heard) -> None:
        """Follow a command from now on (ValueError if it is of the other kind of network)."""

    def forget(self) -> None:
        """Stand until the next command."""

    def feel(self, readings: Readings) -> None:
        """Take one step with what is measured now."""


def mind_of(controller: Controller) -> Mind:
    """Return the mind of a controller, standing."""
    network = controller.network
    if isinstance(network, LeakyNetwork):
        return LeakyMind(network, controller.sensors, controller.courses, controller.joints)
    return SerialMind(network, controller.sensors, controller.joints)


class SerialMind:
    """The paper's: a word is primed into the hidden neurons, then the loop is closed."""

    def __init__(self, network: Network, sensors: tuple[str, ...],
                 joints: tuple[str, ...]) -> None:
        self._network, self._sensors, self._joints = network, sensors, joints
        self._state: State | None = None

    @property
    def motors(self) -> Array:
        """See `Mind`."""
        return np.zeros(self._network.motor_count) if self._state is None else self._state.motors

    @property
    def follows(self) -> bool:
        """See `Mind`."""
        return self._state is not None

    def hear(self, heard: Heard) -> None:
        """See `Mind`."""
        if heard.signal is None:
            raise ValueError('a serial network: expected the signal of words, got a command')
        self._state = serial.prime(self._network, heard.signal)

    def forget(self) -> None:
        """See `Mind`."""
        self._state = None

    def feel(self, readings: Readings) -> None:
        """See `Mind`."""
        if self._state is None:
            return
        values = senses.read(self._sensors, with_motors(readings, self._joints, self.motors))
        self._state = serial.step(self._network, self._state, values)


class LeakyMind:
    """The legs: a command drives leaky neurons at every step, and its heading is held."""

    def __init__(self, network: LeakyNetwork, sensors: tuple[str, ...],
                 course_of_each: tuple[Course, ...], joints: tuple[str, ...]) -> None:
        self._network, self._sensors, self._joints = network, sensors, joints
        self._courses = course_of_each
        self._state: LeakyState | None = None
        self._command: Array | None = None
        self._drive = network.drive(np.zeros(len(course_of_each)))
        self._reference: Reference | None = None

    @property
    def motors(self) -> Array:
        """See `Mind`."""
        if self._state is None:
            return np.zeros(self._network.motor_leak.shape[-1])
        return self._state.motors

    @property
    def follows(self) -> bool:
        """See `Mind`."""
        return self._state is not None

    def hear(self, heard: Heard) -> None:
        """See `Mind`; the heading to hold is that of the next frame."""
        if heard.command is None:
            raise ValueError('a leaky network: expected a command, got the signal of words')
        self._drive = self._network.drive(heard.command)
        self._command = heard.command
        self._reference = None
        if self._state is None:
            self._state = self._network.initial_state()

    def forget(self) -> None:
        """See `Mind`."""
        self._state = self._command = self._reference = None

    def feel(self, readings: Readings) -> None:
        """See `Mind`."""
        if self._state is None or self._command is None:
            return
        if self._reference is None:
            hold, direction = held(self._courses, self._command)
            self._reference = Reference(readings.heading_rad, float(hold), float(direction))
        values = senses.read(self._sensors, with_motors(readings, self._joints, self.motors),
                             self._reference)
        self._state = leaky.step(self._network, self._state, self._drive, values)


def with_motors(readings: Readings, joints: tuple[str, ...], motors: Array) -> Readings:
    """Return the readings with what the network itself knows: its motor neurons, by joint."""
    return Readings(readings.touching, readings.position_rad,
                    dict(zip(joints, map(float, motors), strict=True)), readings.heading_rad,
                    readings.yaw_rate_rad_s, readings.gravity)
