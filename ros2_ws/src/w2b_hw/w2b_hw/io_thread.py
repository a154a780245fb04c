"""
The one thread that owns the bus: a frame every 50 ms, and a pose at once when a target comes.

Other threads hand it requests and get reports; none of them touches the bus.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable

from w2b_hw.clocks import Answer, Clock, WallClock
from w2b_hw.robot import Report, Robot
from w2b_hw.safety import DRIVEN, Pose

#: Frames without an answer after which none is expected any more.
SILENT_FRAMES = 4
#: How long a service waits for the thread's answer; two frames.
ANSWER_WITHIN_S = 0.1


class IoThread:
    """
    Runs a robot.

    Parameters
    ----------
    robot
        Already connected. From `start` on it belongs to the thread.
    period_s
        Time between frames.
    on_frame
        Gets the report of every frame, and on_pose that of every pose in between; called in the
        thread, so they must be short.
    sign_of_life
        Called in every frame with whether servos are driven: watchdogs.
    clock
        What frames run by; None for the machine's.

    """

    def __init__(self, robot: Robot, *, period_s: float, on_frame: Callable[[Report], None],
                 on_pose: Callable[[Report], None],
                 sign_of_life: Callable[[bool], None] = lambda driven: None,
                 clock: Clock | None = None) -> None:
        self._robot = robot
        self._clock = clock or WallClock()
        #: Frames since the last target.
        self._unanswered = SILENT_FRAMES
        self._period_s = period_s
        self._on_frame = on_frame
        self._on_pose = on_pose
        self._sign_of_life = sign_of_life
        self._wake = threading.Condition()
        self._target: tuple[Pose, str | None] | None = None
        self._requests: deque[Callable[[float], None]] = deque()
        self._stopping = False
        self._thread = threading.Thread(target=self._run, name='i2c', daemon=True)
        #: The exception that ended the thread, if one did.
        self.error: BaseException | None = None
        #: How late each of the last frames began.
        self.lateness_s: deque[float] = deque(maxlen=200)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def alive(self) -> bool:
        """Whether the thread runs."""
        return self._thread.is_alive()

    def stop(self) -> None:
        """End the thread; servos are off when this returns."""
        with self._wake:
            self._stopping = True
            self._wake.notify()
        self._thread.join()

    def target(self, pose: Pose, word_epoch: str | None = None) -> None:
        """Hand over a checked target, see `Safety.take_target`; the latest counts."""
        with self._wake:
            self._target = pose, word_epoch
            self._wake.notify()

    def ask(self, request: Callable[[float], str | None]) -> str | None:
        """
        Run a request in the thread, between frames; return its answer.

        The request gets the time and returns None, or why it refuses.
        """
        answered = threading.Event()
        answer: list[str | None] = []

        def run(now_s: float) -> None:
            answer.append(request(now_s))
            answered.set()

        with self._wake:
            self._requests.append(run)
            self._wake.notify()
        if not answered.wait(ANSWER_WITHIN_S):
            return 'the I/O thread does not answer; look at the diagnostics'
        return answer[0]

    def _run(self) -> None:
        try:
            self._loop()
        except BaseException as error:
            self.error = error
        finally:
            self._turn_off()

    def _loop(self) -> None:
        clock = self._clock
        due_s = clock.now()
        while True:
            now_s = clock.now()
            if now_s >= due_s:
                self.lateness_s.append(now_s - due_s)
                report = self._robot.frame(now_s)
                self._unanswered += 1
                self._sign_of_life(report.state in DRIVEN)
                self._on_frame(report)
                # Frames that were missed are not made up for.
                due_s = max(due_s + self._period_s, clock.now())
            with self._wake:
                if not self._stopping and self._target is None and not self._requests:
                    # Command loss does not wait for the next frame.
                    wake_s = min(due_s, self._robot.safety.due_s())
                    clock.wait_until(self._wake, wake_s, self._answer())
                stopping, target, self._target = self._stopping, self._target, None
                requests = list(self._requests)
                self._requests.clear()
            if stopping:
                return
            now_s = clock.now()
            if target is not None:
                self._unanswered = 0
                pose, word_epoch = target
                self._robot.safety.take_target(pose, now_s, word_epoch)
            if target is not None or self._robot.safety.due_s() <= now_s < due_s:
                self._on_pose(self._robot.drive(now_s))
            for request in requests:
                request(clock.now())

    def _answer(self) -> Answer:
        """Return what is known of the answer to the last frame."""
        if self._unanswered == 0:
            return Answer.CAME
        return Answer.AWAITED if self._unanswered <= SILENT_FRAMES else Answer.NONE

    def _turn_off(self) -> None:
        """Whatever ended the thread: off, tried until it works or the guard has to."""
        ends = time.monotonic() + 0.5
        while time.monotonic() < ends:
            try:
                self._robot.relax()
                return
            except Exception as error:
                self.error = self.error or error
                time.sleep(0.005)
