"""
The sim node without ROS: which frame is out, which targets answer it, when the body moves.

In lockstep the body moves when the targets for the frame that is out arrive, and not before: a run
over a network repeats an offline evaluation exactly, as fast as it is answered. Paced, the body
moves with the clock, towards the last targets that came.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from w2b_core.bodies.model import Body
from w2b_core.body_status import FRESH_PERIODS, BodyStatus
from w2b_core.sensor_frames import FrameError, named_values
from w2b_core.status import Level, Status
from w2b_sim.engines.interface import Frame, Simulation, Start

Array = NDArray[np.float64]

#: How far beyond a joint's limits a target may be: rounding, not intent.
LIMIT_TOLERANCE_RAD = 1e-6
#: Paced: targets in answer to a frame older than this are refused.
OLDEST_ANSWER_S = 0.5
#: Without targets for this long a warning is given; refused ones stay a warning for as long.
WARNING_S = 1.0


def reset_answer(stamp_ns: int) -> str:
    """Return what the service `~/reset` answers: where the frames of the new start begin."""
    return f'at the start; the first frame is stamped {stamp_ns / 1e9:.9f}'


def first_stamp_ns(answer: str) -> int:
    """Return the stamp in a `reset_answer`."""
    return round(float(answer.split()[-1]) * 1e9)


class TargetError(ValueError):
    """Targets that are refused; one line says why."""


class SimulatedRobot:
    """
    A simulated body, the frame it is in, and the targets it was given.

    Parameters
    ----------
    body, simulation
        What moves, and what moves it.
    next_start
        Called at each reset for the start pose to take.
    paced
        Whether the body moves with the clock instead of in lockstep.
    pause_after
        Frames after a reset until the clock stops by itself; 0 for never.
    clock
        Monotonic seconds, for warnings only.

    """

    def __init__(self, body: Body, simulation: Simulation, *, next_start: Callable[[], Start],
                 period_s: float, paced: bool, pause_after: int,
                 clock: Callable[[], float]) -> None:
        self.body = body
        self.paced = paced
        self._simulation = simulation
        self._next_start = next_start
        self._period_ns = round(period_s * 1e9)
        self._pause_after = pause_after
        self._clock = clock
        self._joints = tuple(joint.name for joint in body.joints)
        self._lower = np.array([joint.lower_rad for joint in body.joints])
        self._upper = np.array([joint.upper_rad for joint in body.joints])
        self._counts: Counter[str] = Counter()
        self._problem: tuple[float, str] | None = None
        self._answered_at_s = clock()
        self._taken_stamp_ns: int | None = None
        self.paused = False
        self.stamp_ns = 0
        self.reset()

    def reset(self) -> None:
        """Put the body at its start, at rest; time goes on."""
        self._simulation.reset(self._next_start())
        self._frame_number = 0
        self._answer: Array | None = None
        self._show()
        self._first_stamp_ns = self._answer_stamp_ns = self.stamp_ns
        self._targets: Array = self.frame.joint_position_rad

    def _show(self) -> None:
        """Make what the body senses now the frame that is out, one period later."""
        self.frame: Frame = self._simulation.observe()
        self.stamp_ns += self._period_ns
        self._frame_number += 1
        if self._frame_number == self._pause_after:
            self.paused = True

    @property
    def answered(self) -> bool:
        """Whether the frame that is out has its targets."""
        return self._answer is not None

    def body_status(self, epoch: str, real_time_factor: float) -> BodyStatus:
        """
        Return what the body says of itself.

        Parameters
        ----------
        epoch
            Of the simulation: one from its start, or a reset, to the next reset or its end.
        real_time_factor
            Simulated seconds in a second; 0 in lockstep, where at least real time is expected.

        """
        fresh_s = FRESH_PERIODS * self._period_ns / 1e9 / (real_time_factor or 1.0)
        fresh = (self._taken_stamp_ns is not None
                 and self._clock() - self._answered_at_s <= fresh_s)
        state, reason = ('PAUSED', 'asked to pause') if self.paused else \
            ('RUNNING', 'following targets' if fresh else 'waiting for targets')
        return BodyStatus(self.body.name, state, reason, fresh and not self.paused, epoch,
                          False, self._taken_stamp_ns)

    @property
    def may_move(self) -> bool:
        """Whether the body may move now: not paused and, in lockstep, with targets."""
        return not self.paused and (self.paced or self.answered)

    def pause(self, paused: bool) -> None:
        """Stop the body's clock, or let it go on."""
        if paused != self.paused:
            self.paused = paused
            self._answered_at_s = self._clock()

    def take(self, stamp_ns: int, names: Sequence[str],
             positions_rad: Sequence[Sequence[float]]) -> bool:
        """
        Take targets that answer the frame of `stamp_ns`: one point of joint positions.

        Returns whether they are new; targets that are not for this body or this moment are
        refused, and the body keeps what it had.
        """
        try:
            self._check_stamp(stamp_ns)
            targets = self._checked(names, positions_rad)
        except (TargetError, FrameError) as error:
            self.refuse(str(error))
            return False
        if self.answered and stamp_ns == self._answer_stamp_ns:
            self._counts['repeated'] += 1
            return False
        self._counts['taken'] += 1
        self._answered_at_s = self._clock()
        self._answer, self._answer_stamp_ns, self._targets = targets, stamp_ns, targets
        self._taken_stamp_ns = stamp_ns
        return True

    def refuse(self, reason: str) -> None:
        """Count targets that are refused, and keep the reason for the status."""
        self._counts['refused'] += 1
        self._problem = (self._clock(), reason)

    def _check_stamp(self, stamp_ns: int) -> None:
        if stamp_ns > self.stamp_ns:
            raise TargetError('targets from the future: no such frame was sent yet')
        oldest = self.stamp_ns
        if self.paced:
            oldest = max(self._first_stamp_ns, self._answer_stamp_ns,
                         self.stamp_ns - round(OLDEST_ANSWER_S * 1e9))
        elif self.answered:
            oldest = self._answer_stamp_ns
        if stamp_ns < oldest:
            raise TargetError('stale targets: they answer an older frame')

    def _checked(self, names: Sequence[str], points: Sequence[Sequence[float]]) -> Array:
        if len(points) != 1:
            raise TargetError(f'joint_trajectory: expected 1 point, got {len(points)}')
        values = named_values('joint_trajectory', names, points[0], self._joints)
        targets = np.array([values[joint] for joint in self._joints])
        beyond = ((targets < self._lower - LIMIT_TOLERANCE_RAD)
                  | (targets > self._upper + LIMIT_TOLERANCE_RAD))
        if beyond.any():
            joint = int(np.flatnonzero(beyond)[0])
            raise TargetError(
                f'joint_trajectory: expected {self._lower[joint]:.4f} to '
                f'{self._upper[joint]:.4f} rad for {self._joints[joint]}, '
                f'got {targets[joint]:.4f}')
        return targets

    def move(self) -> None:
        """Move the body for one period, towards its last targets, and show the next frame."""
        self._simulation.step(self._targets)
        self._answer = None
        self._show()

    def targets_status(self) -> Status:
        """How the targets are: the status `sim: targets`."""
        values = {name: str(self._counts[name]) for name in ('taken', 'repeated', 'refused')}
        now_s = self._clock()
        if self._problem is not None and now_s - self._problem[0] < WARNING_S:
            return Status(Level.WARN, 'sim: targets', f'ignored: {self._problem[1]}', values)
        if not self.paused and now_s - self._answered_at_s > WARNING_S:
            does = 'holds its last targets' if self.paced else 'waits'
            return Status(Level.WARN, 'sim: targets', f'no targets: the body {does}', values)
        message = 'targets come' if self._counts['taken'] else 'no targets yet'
        return Status(Level.OK, 'sim: targets', 'paused' if self.paused else message, values)

    def clock_status(self) -> Status:
        """How time goes: the status `sim: clock`."""
        message = f'{"paced" if self.paced else "lockstep"}{", paused" if self.paused else ""}'
        return Status(Level.OK, 'sim: clock', message, {
            'frames_since_reset': str(self._frame_number),
            'stamp_s': f'{self.stamp_ns / 1e9:.9f}'})
