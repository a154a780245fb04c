"""The brain without ROS: hears commands, senses frames, and says where the joints shall go."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from w2b_core import network as neural
from w2b_core import periphery
from w2b_core.command import Answer, Ear
from w2b_core.controller.file import Controller
from w2b_core.frame_stream import FrameStream, Verdict
from w2b_core.sensor_frames import FrameAssembler, FrameError, OtherBodyError, SensorFrame
from w2b_core.status import Level, Status
from w2b_core.vocabulary import Vocabulary

#: How long an ignored frame stays a warning while others flow.
WARNING_S = 5.0
#: What is counted of frames.
COUNTED = ('answered', 'repeated', 'stale', 'malformed', 'other_body', 'restarts')


@dataclass(frozen=True)
class Targets:
    """Where the joints shall go, in answer to the frame with this stamp."""

    stamp_ns: int
    joints: tuple[str, ...]
    position_rad: NDArray[np.float64]
    period_s: float


@dataclass(frozen=True)
class Problem:
    """Why a frame was ignored, and when."""

    at_s: float
    level: Level
    message: str


class Brain:
    """
    One controller with its vocabulary, closing the loop one frame at a time.

    The targets that answer a frame are the motor neurons *before* the network hears that frame's
    sensors, as in the original program. Before any command, and after a stream of frames that
    started over, the motors are held at 0 and the robot stands.

    Parameters
    ----------
    controller, vocabulary
        What it thinks with and what it understands.
    frame_timeout_s
        Without a frame for this long the stream counts as lost.
    clock
        Monotonic seconds.

    """

    def __init__(self, controller: Controller, vocabulary: Vocabulary, *, frame_timeout_s: float,
                 clock: Callable[[], float]) -> None:
        self.controller = controller
        self._ear = Ear(controller, vocabulary)
        self._clock = clock
        self._joints = tuple(motor.joint for motor in controller.motors)
        links = tuple(source for kind, source in map(periphery.split, controller.sensors)
                      if kind == 'touch')
        self._assembler = FrameAssembler(self._joints, links)
        self._stream = FrameStream(controller.period_s, frame_timeout_s, clock)
        self._counts: Counter[str] = Counter()
        self._problem: Problem | None = None
        self._doing = 'standing: no command yet'
        self._state: neural.State | None = None
        self._last: Targets | None = None

    @property
    def uses_contacts(self) -> bool:
        """Whether the network has touch sensors, so that frames include `contacts`."""
        return any(sensor.startswith('touch:') for sensor in self.controller.sensors)

    def hear(self, text: str) -> Answer:
        """Prime the network with a command; a refused one changes nothing but the answer."""
        answer, signal = self._ear.hear(text)
        if signal is not None:
            self._state = neural.prime(self.controller.network, signal)
            self._doing = f'following {answer.values["words"]!r}'
        return answer

    def refuse(self, text: str, reason: str) -> Answer:
        """Answer a command without following it."""
        return self._ear.refuse(text, reason)

    def greet(self) -> Answer:
        """Return the answer that stands before the first command: the count so far."""
        return self._ear.greet()

    def stand(self, reason: str) -> None:
        """Forget the command; the robot stands until the next one."""
        self._state = None
        self._doing = f'standing: {reason}'

    def joint_states(self, stamp_ns: int, names: Sequence[str],
                     position_rad: Sequence[float]) -> Targets | None:
        """Take a `joint_states` message; return the targets if it completes a frame."""
        return self._take(lambda: self._assembler.joint_states(stamp_ns, names, position_rad))

    def contacts(self, stamp_ns: int, names: Sequence[str],
                 touching: Sequence[float]) -> Targets | None:
        """Take a `contacts` message; return the targets if it completes a frame."""
        return self._take(lambda: self._assembler.contacts(stamp_ns, names, touching))

    def _take(self, part: Callable[[], SensorFrame | None]) -> Targets | None:
        try:
            frame = part()
        except OtherBodyError as error:
            self._ignore('other_body', Level.ERROR, f'{error}; the controller is for '
                         f'{self.controller.body}: start both with the same body')
            return None
        except FrameError as error:
            self._ignore('malformed', Level.WARN, str(error))
            return None
        return None if frame is None else self.sense(frame)

    def sense(self, frame: SensorFrame) -> Targets | None:
        """Return the targets that answer a complete frame; None if it is ignored."""
        verdict = self._stream.judge(frame.stamp_ns)
        if verdict in (Verdict.STALE, Verdict.LEAP):
            self._ignore('stale', Level.WARN, f'a frame whose stamp is {verdict.value}')
            return None
        if verdict is Verdict.REPEATED:
            self._counts['repeated'] += 1
            return self._last
        if verdict is Verdict.RESTARTED:
            self._counts['restarts'] += 1
            self.stand('the sensor frames started over')
        self._counts['answered'] += 1
        self._forget_problem()
        self._last = self._think(frame)
        return self._last

    def _think(self, frame: SensorFrame) -> Targets:
        """Answer with the motors as they are, then let the network hear the sensors."""
        count = self.controller.network.motor_count
        state = self._state
        motors = np.zeros(count) if state is None else state.motors
        if state is not None:
            sensors = periphery.read(
                self.controller.sensors, frame.touching, frame.position_rad,
                dict(zip(self._joints, map(float, motors), strict=True)))
            self._state = neural.step(self.controller.network, state, sensors)
        else:
            hidden = np.zeros(self.controller.network.hidden_count)
            state = neural.State(hidden, hidden, motors, False)
        return Targets(frame.stamp_ns, self._joints, self.controller.targets_rad(state),
                       self.controller.period_s)

    def _ignore(self, kind: str, level: Level, reason: str) -> None:
        self._counts[kind] += 1
        self._problem = Problem(self._clock(), level, f'ignored: {reason}')

    def _forget_problem(self) -> None:
        """An accepted frame ends an error at once, and a warning when it was shown for a while."""
        problem = self._problem
        if problem is not None and (problem.level is Level.ERROR
                                    or self._clock() - problem.at_s >= WARNING_S):
            self._problem = None

    def frames_status(self) -> Status:
        """How the sensor frames are: the status `brain: frames`."""
        values = {name: str(self._counts[name]) for name in COUNTED}
        last = self._stream.last_stamp_ns
        values['last_stamp_s'] = 'none' if last is None else f'{last / 1e9:.9f}'
        level = Level.OK
        message = 'waiting for the first sensor frame' if last is None else 'sensor frames flow'
        if self._problem is not None:
            level, message = self._problem.level, self._problem.message
        if self._stream.lost:
            level, missing = Level.ERROR, self._assembler.missing
            detail = (f'; {message}' if self._problem is not None else
                      f'; {missing} do not come' if missing else '')
            message = f'no sensor frames{detail}'
        return Status(level, 'brain: frames', message, values)

    def command_status(self) -> Status:
        """What the brain does: the status `brain: command`."""
        warning = self._ear.warning
        return Status(Level.WARN if warning else Level.OK, 'brain: command',
                      self._doing + (f'; {warning}' if warning else ''),
                      {'received': str(self._ear.received), 'body': self.controller.body,
                       'vocabulary': self._ear.source})
