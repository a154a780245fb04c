"""What the demo says, and what was seen of each word."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, degrees, sin, tau

import numpy as np
from numpy.typing import NDArray

from demo.robot import Motion as Watched
from w2b_core.behaviours import BEHAVIOURS, Bounds
from w2b_core.controller.model import Controller
from w2b_core.hearing import Ear
from w2b_core.outcome import Motion

#: Of body lengths: what counts as having moved, and as having stayed.
MOVED, STAYED = 1.0, 0.8
#: No controller knows it: spelt wrong.
MISSPELT = 'forwrad'


@dataclass(frozen=True)
class Line:
    """A word of the script, what it asks for (empty: it must be refused), and how long it lasts."""

    word: str
    behaviour: str
    seconds: float


#: For a controller with an ear: words of all behaviours in one go. *halt*, *march* and *revert* are
#: of word families that were held out of every training, by a rule fixed before.
TALK = (Line('forward', 'forward', 4.0), Line('halt', 'stop', 2.0), Line('left', 'left', 4.0),
        Line('march', 'forward', 4.0), Line('banana', '', 1.5), Line('stop', 'stop', 2.0),
        Line('revert', 'backward', 4.0), Line('right', 'right', 4.0), Line('sit', 'sit', 3.0))
#: How long a robot of one's own turns.
OWN_TURN_S = 10.0
#: For one that is primed with words: three behaviours.
PRIMED = (Line('forward', 'forward', 25.0), Line('stop', 'stop', 25.0),
          Line('backward', 'backward', 25.0), Line('halt', 'stop', 25.0))


def script_of(controller: Controller) -> tuple[Line, ...]:
    """
    Return what to say to a controller: only behaviours that it has.

    A robot of one's own may turn slowly: it turns for as long as the judge lets it.
    """
    if not isinstance(controller.ear, Ear):
        return PRIMED
    lines = (line for line in TALK
             if not line.behaviour or line.behaviour in controller.behaviours)
    if controller.carried is None:
        return tuple(lines)
    return tuple(replace(line, seconds=OWN_TURN_S) if line.behaviour in ('left', 'right') else line
                 for line in lines)


def heard_in_training(controller: Controller, word: str) -> bool:
    """Return whether the controller's ear, or network, was trained on a word."""
    if isinstance(controller.ear, Ear):
        return word in controller.ear.words
    return word in {trained.word for trained in controller.words}


@dataclass(frozen=True)
class Seen:
    """What the robot did under a line, in the frame that it stood in when the word came."""

    line: Line
    answer: str
    trained: bool
    along_m: float
    away_m: float
    turned_deg: float
    height: float

    def obeyed(self, length_m: float) -> bool:
        """Return whether it did what was asked, for a body of this length."""
        bounds = Bounds(move_m=MOVED * length_m, still_m=STAYED * length_m)
        motion = Motion(np.asarray(self.along_m), np.asarray(self.away_m),
                        np.asarray(np.radians(self.turned_deg)), np.asarray(self.height))
        return bool(BEHAVIOURS.get(self.line.behaviour).obeyed(motion, bounds))


def seen(line: Line, answer: str, trained: bool, motion: Watched, stand_m: float,
         settle_s: float, period_s: float) -> Seen:
    """
    Return the figures of a motion.

    A stop word may use the first `settle_s` to come to rest; `stand_m` is the base's height while
    the robot stands.
    """
    positions, headings = motion.positions_m, motion.headings_rad
    rests = bool(line.behaviour) and not BEHAVIOURS.get(line.behaviour).moves
    begin = round(settle_s / period_s) if rests else 0
    ahead = np.array([cos(headings[begin]), sin(headings[begin])])
    moved = positions[-1, :2] - positions[begin, :2]
    return Seen(line, answer, trained, float(moved @ ahead), float(np.hypot(*moved)),
                degrees(turned(headings[begin:])), float(positions[-1, 2] / stand_m))


def turned(headings_rad: NDArray[np.float64]) -> float:
    """Return the turn from the first heading to the last, rad, unwrapped."""
    steps = (np.diff(headings_rad) + tau / 2) % tau - tau / 2
    return float(steps.sum())
