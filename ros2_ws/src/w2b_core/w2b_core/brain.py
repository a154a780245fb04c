"""The brain without ROS: hears commands, senses frames, and says where the joints shall go."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from w2b_core import senses
from w2b_core.body_status import BodyStatus
from w2b_core.command import Answer, listener_of
from w2b_core.controller.file import Controller
from w2b_core.following import BodyWatch, Following, Follows
from w2b_core.frame_rate import FrameRate
from w2b_core.frame_stream import FrameStream, Verdict
from w2b_core.mind import mind_of
from w2b_core.sensor_frames import FrameAssembler, FrameError, OtherBodyError, SensorFrame
from w2b_core.status import Level, Status
from w2b_core.vocabulary import Vocabulary

#: How long an ignored frame stays a warning while others flow.
WARNING_S = 5.0
#: What is counted of frames.
COUNTED = ('answered', 'repeated', 'stale', 'malformed', 'other_body', 'restarts')


@dataclass(frozen=True)
class Targets:
    """
    Where the joints shall go, in answer to the frame with this stamp.

    `word_epoch` is the epoch of the body in which the word was said that they follow: empty if its
    state was not known then, None if they follow no word.
    """

    stamp_ns: int
    joints: tuple[str, ...]
    position_rad: NDArray[np.float64]
    period_s: float
    word_epoch: str | None = None


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
    sensors, as in the original program. Before any command the motors are held at 0 and the robot
    stands; so it does again, until a new word is said, when the body began a new epoch, when frames
    started over, were missing for `frame_timeout_s` of their own time or come at another rate than
    the controller's, and when the word is older than `command_timeout_s`.

    Parameters
    ----------
    controller, vocabulary
        The network with its joints, and the words that it understands.
    frame_timeout_s
        Without a frame for this long the stream counts as lost.
    command_timeout_s
        How long a word lasts; 0 for as long as nothing else ends it.
    clock
        Monotonic seconds.

    """

    def __init__(self, controller: Controller, vocabulary: Vocabulary, *, frame_timeout_s: float,
                 clock: Callable[[], float], command_timeout_s: float = 0.0) -> None:
        self.controller = controller
        self._ear = listener_of(controller, vocabulary)
        self._clock = clock
        self._frame_timeout_s = frame_timeout_s
        self._command_timeout_s = command_timeout_s
        self._watch = BodyWatch(clock)
        #: Epoch that the word was said in, empty if the body's state was not known then.
        self._word_epoch = ''
        #: Stamp of the first target that follows the word.
        self._word_stamp_ns: int | None = None
        self._heard_at_s = clock()
        #: When the word was last kept up, which makes it no newer: see `renew`.
        self._renewed_at_s = clock()
        self._stopped: Answer | None = None
        self._answer: Answer | None = None
        self._told: Following | None = None
        self._joints = tuple(motor.joint for motor in controller.motors)
        links = tuple(source for kind, source in map(senses.split, controller.sensors)
                      if kind == 'touch')
        self._assembler = FrameAssembler(self._joints, links, imu=self.uses_imu)
        self._rate = FrameRate(controller.period_s)
        self._stream = FrameStream(controller.period_s, frame_timeout_s, clock)
        self._counts: Counter[str] = Counter()
        self._problem: Problem | None = None
        self._doing = 'standing: no command yet'
        self._mind = mind_of(controller)
        self._last: Targets | None = None

    @property
    def uses_contacts(self) -> bool:
        """Whether the network has touch sensors, so that frames include `contacts`."""
        return 'contacts' in self.controller.topics

    @property
    def uses_imu(self) -> bool:
        """Whether the network senses heading, turn or tilt, so that frames include `imu/data`."""
        return 'imu/data' in self.controller.topics

    def set_timeouts(self, *, frame_s: float, command_s: float) -> None:
        """Change `frame_timeout_s` and `command_timeout_s`, see the class."""
        self._frame_timeout_s = self._stream.timeout_s = frame_s
        self._command_timeout_s = command_s

    def hear(self, text: str) -> Answer:
        """
        Prime the network with a command; a refused one changes nothing but the answer.

        The words that are followed already are renewed: the gait goes on as it is.
        """
        answer, heard = self._ear.hear(text)
        if heard is None:
            return answer
        self._heard_at_s = self._clock()
        epoch = '' if self._watch.last is None else self._watch.last.epoch
        answer = replace(answer, repeated=(
            self._mind.follows and self._answer is not None and self._word_epoch == epoch
            and self._answer.values['words'] == answer.values['words']))
        self._answer = answer
        if not answer.repeated:
            self._mind.hear(heard)
            self._doing = f'following {answer.follows!r}'
            self._word_epoch, self._word_stamp_ns = epoch, None
        return answer

    def renew(self) -> None:
        """
        Let the word last longer: whoever asked for it still does.

        For `command_timeout_s` only. In which epoch of the body it was said stays as it is.
        """
        self._renewed_at_s = self._clock()

    def body(self, status: BodyStatus) -> None:
        """Take what the body says of itself: a new epoch ends the word said before it."""
        before = self._watch.last
        self._watch.take(status)
        if not self._mind.follows or status.epoch == self._word_epoch:
            return
        first = before is None and not status.needs_arming
        if first or self._clock() - self._heard_at_s < status.epoch_age_s:
            # The word was said in this epoch, which the brain learns of only now; or to the first
            # simulation there is, which starts more slowly than its brain.
            self._word_epoch = status.epoch
            return
        self.stand(f'the body is {status.state} ({status.reason}) since the last word: '
                   'say it again to go on')

    def following(self, body_there: bool = True) -> Following:
        """Return whether a body follows the last word; `body_there`: whether one is discovered."""
        if not self._mind.follows:
            return Following(Follows.NO, self._doing, self._watch.state)
        status = self.frames_status()
        fault = status.message if status.level is Level.ERROR else ''
        return self._watch.following(self._word_stamp_ns, there=body_there, frames_fault=fault)

    def with_following(self, answer: Answer, body_there: bool = True) -> Answer:
        """Return the answer to a word that is followed with whether a body follows it, and why."""
        following = self._told = self.following(body_there)
        message = answer.message
        if following.follows is Follows.NO:
            message += f'; no body follows: {following.reason}'
        return replace(answer, message=message, values={**answer.values, **following.to_values()})

    def news(self, body_there: bool = True) -> Answer | None:
        """Return an updated answer to the last word if whether a body follows it has changed."""
        answer = self._answer
        if not self._mind.follows or answer is None or answer.received != self._ear.received:
            return None
        following, told = self.following(body_there), self._told
        if told is not None and (following.follows, following.body_state) == (
                told.follows, told.body_state):
            return None
        return self.with_following(answer, body_there)

    def stopped(self) -> Answer | None:
        """Return, once, the answer that takes the place of that to a word which ended by itself."""
        answer, self._stopped = self._stopped, None
        return answer

    def refuse(self, text: str, reason: str) -> Answer:
        """Answer a command without following it."""
        return self._ear.refuse(text, reason)

    def greet(self) -> Answer:
        """Return the answer that stands before the first command: the count so far."""
        return self._ear.greet()

    def stand(self, reason: str) -> None:
        """Forget the command; the robot stands until the next one."""
        if self._mind.follows and self._answer is not None:
            values = Following(Follows.NO, reason, self._watch.state).to_values()
            self._stopped = replace(self._answer, level=Level.WARN, message=f'standing: {reason}',
                                    values={**self._answer.values, **values})
        self._mind.forget()
        self._last = None
        self._doing = f'standing: {reason}'

    def joint_states(self, stamp_ns: int, names: Sequence[str],
                     position_rad: Sequence[float]) -> Targets | None:
        """Take a `joint_states` message; return the targets if it completes a frame."""
        return self._take(lambda: self._assembler.joint_states(stamp_ns, names, position_rad))

    def contacts(self, stamp_ns: int, names: Sequence[str],
                 touching: Sequence[float]) -> Targets | None:
        """Take a `contacts` message; return the targets if it completes a frame."""
        return self._take(lambda: self._assembler.contacts(stamp_ns, names, touching))

    def imu(self, stamp_ns: int, orientation_xyzw: Sequence[float] | None,
            angular_velocity_rad_s: Sequence[float]) -> Targets | None:
        """Take an `imu/data` message; return the targets if it completes a frame."""
        return self._take(lambda: self._assembler.imu(
            stamp_ns, orientation_xyzw, angular_velocity_rad_s))

    def _take(self, part: Callable[[], SensorFrame | None]) -> Targets | None:
        try:
            frame = part()
        except OtherBodyError as error:
            if self._answering:
                # Beside this body's frames: another publisher's joints on a shared topic.
                self._counts['other_body'] += 1
            else:
                self._ignore('other_body', Level.ERROR, f'{error}; the controller is for '
                             f'{self.controller.body}: start both with the same body')
            return None
        except FrameError as error:
            self._ignore('malformed', Level.WARN, str(error))
            return None
        return None if frame is None else self.sense(frame)

    @property
    def _answering(self) -> bool:
        """Whether frames of this body come and are answered."""
        return self._stream.last_stamp_ns is not None and not self._stream.lost

    def sense(self, frame: SensorFrame) -> Targets | None:
        """Return the targets that answer a complete frame; None if it is ignored."""
        last_ns, lost = self._stream.last_stamp_ns, self._stream.lost
        verdict = self._stream.judge(frame.stamp_ns)
        if verdict in (Verdict.STALE, Verdict.LEAP):
            self._ignore('stale', Level.WARN, f'a frame whose stamp is {verdict.value}')
            return None
        if verdict is Verdict.REPEATED:
            self._counts['repeated'] += 1
            if self._last is None:
                # The word that it was answered with has ended since.
                self._last = self._think(frame)
            return self._last
        if verdict is Verdict.RESTARTED:
            self._counts['restarts'] += 1
            self.stand('the sensor frames started over')
        if verdict is Verdict.RESTARTED or lost or last_ns is None:
            self._rate.restart()
        else:
            self._rate.take(frame.stamp_ns - last_ns)
        if last_ns is not None and self._mind.follows:
            self._end_word(frame.stamp_ns - last_ns if lost else 0)
        self._counts['answered'] += 1
        self._forget_problem()
        self._last = self._think(frame)
        return self._last

    def _end_word(self, gap_ns: int) -> None:
        """Stand if frames were missing so long that much may have happened, or the word is old."""
        if gap_ns > self._frame_timeout_s * 1e9:
            self.stand(f'sensor frames were missing for {gap_ns / 1e9:.1f} s: '
                       'say the word again to go on')
        elif self._rate.steady:
            # The network would run faster or slower than it was evolved for.
            self.stand(f'{self._rate.fault}: say the word again when they come as they should')
        else:
            self.end_old_word()

    def end_old_word(self) -> None:
        """Stand if the word is older than `command_timeout_s`, whether frames come or not."""
        age_s = self._clock() - max(self._heard_at_s, self._renewed_at_s)
        if self._mind.follows and 0 < self._command_timeout_s < age_s:
            self.stand(f'the last word was said {self._command_timeout_s:g} s ago: '
                       'say it again to go on')

    def _think(self, frame: SensorFrame) -> Targets:
        """Answer with the motors as they are, then let the network hear the sensors."""
        word_epoch = self._word_epoch if self._mind.follows else None
        if self._mind.follows and self._word_stamp_ns is None:
            self._word_stamp_ns = frame.stamp_ns
        motors = self._mind.motors
        self._mind.feel(frame.readings)
        return Targets(frame.stamp_ns, self._joints, self.controller.targets_rad(motors),
                       self.controller.period_s, word_epoch)

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
        elif self._rate.fault:
            level, message = Level.WARN, self._rate.fault
        if self._watch.paused and self._problem is None:
            level, message = Level.OK, 'the body is paused'
        elif self._stream.lost:
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
