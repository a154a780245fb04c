"""The champion of a run: judged under every word, and written as a controller file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from training.evolution.objectives import scores
from training.evolution.treatments import Words, vector_hash
from w2b_core import bodies
from w2b_core.bodies.model import Body
from w2b_core.network import Network
from w2b_sim.engines.interface import Evaluator, Start
from w2b_sim.worlds import World

Array = NDArray[np.float64]


@dataclass(frozen=True)
class WordOutcome:
    """
    A controller under one word, from K starts.

    `score` is the mean over the starts; positions (K, 3), paths (K,) and steps (K,) are in metres,
    as in `Evaluation`.
    """

    word: str
    behaviour: str
    trained: bool
    score: float
    final_position_m: tuple[tuple[float, float, float], ...]
    path_length_m: tuple[float, ...]
    largest_step_m: tuple[float, ...]

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> WordOutcome:
        """Return the outcome that was written as the JSON object `value`."""
        plain = dict(value)
        plain['final_position_m'] = tuple(tuple(row) for row in plain['final_position_m'])
        plain['path_length_m'] = tuple(plain['path_length_m'])
        plain['largest_step_m'] = tuple(plain['largest_step_m'])
        return cls(**plain)


def outcomes(evaluator: Evaluator, network: Network, words: Words, held_out: Words,
             heard: Array, starts: Sequence[Start], objective: str) -> tuple[WordOutcome, ...]:
    """
    Judge one controller under the trained `words`, then under the `held_out` ones.

    `heard` (W, T) holds their vectors in that order.
    """
    pairs = words + held_out
    outcome = evaluator.evaluate(network.batched(), heard, starts)
    earned = scores(outcome, [behaviour for _word, behaviour in pairs], objective)[0]
    return tuple(
        WordOutcome(word, behaviour, index < len(words), float(earned[index]),
                    tuple((float(x), float(y), float(z))
                          for x, y, z in outcome.final_position_m[0, index]),
                    tuple(outcome.path_length_m[0, index].tolist()),
                    tuple(outcome.largest_step_m[0, index].tolist()))
        for index, (word, behaviour) in enumerate(pairs))


def write_champion(path: Path, body: Body, world: World, network: Network,
                   judged: Sequence[WordOutcome], heard: Array,
                   record: Mapping[str, Any]) -> None:
    """
    Write `network` as a controller file with the trained words among `judged` and a `record`.

    `heard` (W, T) holds the vectors of `judged`, in that order: what this controller was trained
    to, which for a permuted treatment is not what the vocabulary says.
    """
    from w2b_core.controller import file as controller_file

    controller_file.save(controller_file.Controller(
        body=body.name, network=network, sensors=body.sensors,
        motors=tuple(controller_file.Motor(joint.name, joint.lower_rad, joint.upper_rad,
                                           joint.time_constant) for joint in body.joints),
        period_s=world.control_period_s,
        words=tuple(controller_file.TrainedWord(word.word, word.behaviour, vector_hash(vector),
                                                word.score)
                    for word, vector in zip(judged, heard, strict=True) if word.trained),
        record=dict(record), vector_length=heard.shape[-1], carried=bodies.to_carry(body)), path)
