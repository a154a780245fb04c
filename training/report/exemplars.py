"""Three champions shown as examples, chosen by a stated rule, with all that their figure needs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from training.evolution.treatments import treated
from training.report.behaviour import sorted_out
from training.report.comparisons import Panel, select
from training.study.store import parse_run_id
from w2b_core import bodies
from w2b_core.bodies.model import Body
from w2b_core.network import Network, prime
from w2b_sim.engines.interface import Start
from w2b_sim.worlds import WORLDS

Array = NDArray[np.float64]

#: (treatment, what is asked of its champions, what the exemplar stands for in the paper).
KINDS = (
    ('experimental', 'word2vec: right under every trained word and under the unheard one'),
    ('control', 'control: wrong under a trained word and under the unheard one'),
    ('control', 'control: right under every trained word, wrong under the unheard one'),
)
RULE = ('Of the champions of a kind (right and wrong as in the robustness tables), the one with '
        'the median fitness; of two in the middle, the fitter. A kind without any champion shows '
        'the fittest other one of its treatment instead, and says so.')


@dataclass(frozen=True)
class Exemplar:
    """A chosen run, of a kind that `count` of the treatment's `among` champions are of."""

    run: str
    kind: str
    count: int
    among: int

    @property
    def met(self) -> bool:
        """Whether the run is of the kind."""
        return self.count > 0


def choose(table: pd.DataFrame, outcomes: pd.DataFrame, thresholds: Mapping[str, float],
           panel: Panel = ('paper', 'quadruped')) -> list[Exemplar]:
    """Return the exemplars of a panel, by `RULE`; none where a treatment has no run."""
    state = select(sorted_out(outcomes, dict(thresholds)), panel).set_index('run')
    trained, unheard = state.trained, state.unheard
    asked = (trained & unheard, ~trained & ~unheard, trained & ~unheard)
    chosen: list[Exemplar] = []
    for (treatment, kind), mask in zip(KINDS, asked, strict=True):
        arm = select(table, panel, treatment).set_index('run').sort_values('fitness')
        fitting = arm.index[mask.reindex(arm.index, fill_value=False)]
        if len(fitting):
            run = fitting[len(fitting) // 2]
        elif len(arm):
            # Not one that is shown already, where there is another.
            others = [run for run in arm.index if run not in {one.run for one in chosen}]
            run = (others or list(arm.index))[-1]
        else:
            continue
        chosen.append(Exemplar(str(run), kind, len(fitting), len(arm)))
    return chosen


@dataclass(frozen=True)
class Shown:
    """
    What an exemplar's figure shows, for W words.

    Attributes
    ----------
    words
        The trained words, then the held-out one.
    hidden: shape (W, T, H)
        The hidden neurons while the T elements of each vector pass.
    trajectories: shape (W, P, 2)
        x and y of the body in metres at P moments of its movement, evenly spaced.

    """

    words: tuple[str, ...]
    hidden: Array
    trajectories: Array


def show(run: str, network: Network, vectors: Mapping[str, ArrayLike], engine: str,
         precision: str) -> Shown:
    """Return what the champion `network` of `run` does under its words, in the run's `engine`."""
    spec = parse_run_id(run)
    trained, held_out = spec.words()
    words = tuple(word for word, _ in trained + held_out)
    heard = treated(vectors, words, spec.treatment, spec.evolution_seed)
    hidden = np.stack([prime(network, heard[:, :count + 1]).hidden
                       for count in range(heard.shape[1])], axis=1)
    body = bodies.get(spec.body)
    record = _in_pybullet if engine == 'pybullet' else _in_batched
    return Shown(words, hidden, record(network, body, heard, precision)[..., :2])


def _in_batched(network: Network, body: Body, heard: Array, precision: str) -> Array:
    from w2b_sim.engines.batched import BatchedEngine

    engine = BatchedEngine(body, WORLDS[body.world], precision=precision)
    way = engine.record(network.batched(), heard, [Start()])
    position: Array = way.position_m[0, :, 0].astype(np.float64)
    return position


def _in_pybullet(network: Network, body: Body, heard: Array, _precision: str) -> Array:
    from w2b_sim.engines.pybullet_engine import PyBulletSimulation
    from w2b_sim.rollout import rollout

    simulation = PyBulletSimulation(body, WORLDS[body.world])
    try:
        ways = []
        for signal in heard:
            simulation.reset()
            ways.append(rollout(simulation, body, network, signal,
                                WORLDS[body.world].steps).position_m)
        return np.array(ways)
    finally:
        simulation.close()
