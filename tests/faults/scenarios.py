"""
What a fault scenario is, and the steps that they share; `catalogue` has them all.

Each brings a walking robot into trouble and returns how many frames and milliseconds passed until
the safe outcome it states. Every pulse on the way is judged by `rig.Rig`: within limits, within the
slew limit, one servo energised at a time, none while not armed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.faults.rig import FRAME_S, Rig
from w2b_hw.safety import State


@dataclass(frozen=True)
class Outcome:
    """What was seen."""

    frames: int
    ms: float


@dataclass(frozen=True)
class Scenario:
    """A fault, the outcome that is safe, and the bounds on the way to it."""

    name: str
    safe: str
    most_frames: int
    most_ms: float
    run: Callable[[], Outcome]


SCENARIOS: list[Scenario] = []


def scenario(name: str, safe: str, *, frames: int, ms: float
             ) -> Callable[[Callable[[], Outcome]], Callable[[], Outcome]]:
    """Enter a function into the list."""
    def enter(run: Callable[[], Outcome]) -> Callable[[], Outcome]:
        SCENARIOS.append(Scenario(name, safe, frames, ms, run))
        return run
    return enter


@contextmanager
def walking() -> Iterator[Rig]:
    """Give a robot that is armed and walks."""
    with TemporaryDirectory() as folder:
        rig = Rig(Path(folder))
        rig.arm()
        assert not rig.off()
        yield rig


def until(rig: Rig, condition: Callable[[], bool]) -> Outcome:
    """Run frames until the condition holds."""
    started_s = rig.now_s
    frames = rig.frames_until(condition)
    return Outcome(frames, 1e3 * (rig.now_s - started_s))


def stays_off(rig: Rig, seconds: float = 2.0) -> None:
    """Run on, with a brain that answers: nothing may be driven again by itself."""
    rig.answer = rig.walk
    for _ in range(round(seconds / FRAME_S)):
        rig.frame()
        assert rig.off()
        assert rig.robot.safety.state in (State.FAULT, State.DISARMED)


def arms_again(rig: Rig) -> None:
    """Arm as a person would; servos come one by one (the rig judges)."""
    rig.answer = rig.walk
    rig.arm()
    assert rig.robot.safety.state is State.ACTIVE


def fault_and_off(rig: Rig) -> Callable[[], bool]:
    """Return the condition: FAULT, and not one pulse."""
    return lambda: rig.robot.safety.state is State.FAULT and rig.off()


def not_disturbed(rig: Rig, seconds: float = 1.0) -> Outcome:
    """Run on: the robot must go on walking, each frame with the pulses it was told."""
    lost = 0
    for _ in range(round(seconds / FRAME_S)):
        before = rig.pulses()
        rig.frame()
        assert rig.robot.safety.state is State.ACTIVE
        lost += rig.pulses() == before
    return Outcome(lost, 1e3 * FRAME_S * lost)
