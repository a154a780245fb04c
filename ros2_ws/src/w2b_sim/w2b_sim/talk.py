"""
Say words to a controller and get the walk as arrays, in one call and without ROS.

    from w2b_sim.talk import talk
    walk = talk('physical_twin', ['march', 'halt'], seconds=10)
    walk.recording.position_m      # (frames, 3), metres
    walk.plot('walk.png')
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from w2b_core.command import Answer, listener_of
from w2b_core.controller import file as controller_file
from w2b_core.controller.model import Controller
from w2b_core.vocabulary import Vocabulary
from w2b_sim.engines.registry import DEFAULT, make_simulation
from w2b_sim.recording import PhaseOutcome, Recording, phase_outcome
from w2b_sim.walking import Phase, walk
from w2b_sim.worlds import WORLDS


class RefusedError(ValueError):
    """The controller does not understand a text; one line says why."""


@dataclass(frozen=True)
class Talk:
    """
    A walk under one text after the other.

    Attributes
    ----------
    texts
        What was said, in order.
    answers
        What the controller understood of each.
    recording
        The whole walk; see `Recording` for arrays, shapes and units.
    frames
        Number of frames under each text.

    """

    texts: tuple[str, ...]
    answers: tuple[Answer, ...]
    recording: Recording
    frames: int

    def path_m(self, index: int) -> NDArray[np.float64]:
        """Return the path (frames + 1, 2) in x and y under the text of an index."""
        first = index * self.frames
        path: NDArray[np.float64] = self.recording.position_m[first:first + self.frames + 1, :2]
        return path

    def outcome(self, index: int) -> PhaseOutcome:
        """Return what the robot did under the text of an index."""
        return phase_outcome(self.recording, index * self.frames, (index + 1) * self.frames)

    def plot(self, path: str | Path) -> None:
        """
        Draw the paths seen from above, one colour a text.

        Raises
        ------
        ModuleNotFoundError
            If matplotlib is missing: it comes with the extra `train`.

        """
        from matplotlib.figure import Figure
        figure = Figure(figsize=(6, 4), layout='constrained')
        axes = figure.subplots()
        for index, text in enumerate(self.texts):
            axes.plot(*self.path_m(index).T, label=text)
        axes.set(xlabel='x (m)', ylabel='y (m)', aspect='equal')
        axes.legend()
        figure.savefig(path, dpi=150)


def talk(controller: str | Path | Controller, texts: Sequence[str], *, seconds: float = 10.0,
         engine: str = DEFAULT, world: str | None = None,
         vocabulary: str | Path = 'default') -> Talk:
    """
    Return the walk of a controller's body under texts, each for some seconds.

    Parameters
    ----------
    controller
        Name of a controller that ships, a file, or a loaded one.
    texts
        Said one after the other; the robot goes on from where it is.
    seconds
        How long each lasts.
    engine
        Name of a step-wise engine.
    world
        Name of a world; the body's own if None.
    vocabulary
        As `Vocabulary.load` takes it.

    Raises
    ------
    RefusedError
        If a text is not understood; nothing moves then.
    JsonFileError, VocabularyError, EngineError
        If a file, vocabulary or engine cannot be used.
    ValueError
        If there is no text, or no time for two control periods.

    """
    if not isinstance(controller, Controller):
        controller = controller_file.load(controller_file.resolve(str(controller)))
    body = controller.described()
    place = WORLDS[world or body.world]
    frames = round(seconds / place.control_period_s)
    if not texts or frames < 2:
        raise ValueError(f'talk: expected texts and at least {2 * place.control_period_s:g} s '
                         f'for each, got {len(texts)} texts and {seconds:g} s')
    listener = listener_of(controller, Vocabulary.load(vocabulary))
    answers, phases = [], []
    for text in texts:
        answer, heard = listener.hear(text)
        if heard is None:
            raise RefusedError(answer.message)
        answers.append(answer)
        phases.append(Phase(heard, frames))
    recording = walk(make_simulation(engine, body, place), body, controller, phases,
                     period_s=place.control_period_s)
    return Talk(tuple(texts), tuple(answers), recording, frames)
