"""
From random numbers to a champion, each stage from what the one before made.

  python -m training champions --body quadruped --out out/champions/quadruped --seeds 0-11

1. *Ears* (module `ears`): hidden weights that sort the trained words, screened on validation words.
2. *Walks*: many short runs of the robust mode, touch sensors off, newcomers from the ears, children
   careful of their hearing (module `careful`). What stays below `LEAST_FITNESS` is discarded.
3. *Gate of the walks*: PyBullet, trained words, few starts. The best `--keep` go on.
4. *Touch*: the same runs go on with the touch synapses in use, from small ones.
5. *Choice*: of those runs' populations, who gets farthest both ways in PyBullet; then these
   candidates there under trained and validation words. One is chosen.
6. *Blind*: the held-out words are asked of the chosen one, once (module `blind`).

Held-out words are not even looked up before the last step, and no controller enters from outside
the directory. The same command again goes on where it stopped.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from training.evolution import checkpoint
from training.evolution.operators import Array, Layout
from training.evolution.treatments import GATE, Words, generator
from training.robust import ears, gate
from training.robust.config import RobustConfig, Stage
from training.robust.listening import Listening
from training.robust.search import train
from training.robust.word_roles import WordRoles
from w2b_core import bodies
from w2b_core.network import Network
from w2b_sim.worlds import WORLDS

#: Walk both ways, half as long; harden, also against strange vectors, and stand still; feel the
#: feet. PyBullet's robots slip about twice as far as these while they settle: hence the 2 cm.
STAGES = (Stage(400, 6, 3, 0, False, 0.6, vectors=False, length=0.5),
          Stage(300, 9, 12, 15, False, 1.0, stray_weight=3.0, free_stray_m=0.02),
          Stage(250, 9, 16, 12, True, 1.2, stray_weight=2.0, free_stray_m=0.02))
#: Runs below it after the first stage, and after hardening, in metres of both moves less what stops
#: stray, are discarded: most of those that will walk both ways do so early.
LEAST_FITNESS = (0.15, 0.4)
#: How many of the ears a run's newcomers are drawn from.
EARS_OF_A_RUN = 5
#: Starts in PyBullet for a walk, for a candidate, and for the final table.
WALK_STARTS, CHOICE_STARTS = 2, 2
#: Seeds of the starts: none of those that choose is one of the final table.
WALK_GATE, CHOICE_GATE, SCOUT_GATE, FINAL_GATE = 1, 2, 3, 0
#: How many of a run's best walk in PyBullet, from how many starts, and how many of them go on.
SCOUTED, SCOUT_STARTS, CANDIDATES = 20, 4, 2


@dataclass(frozen=True)
class Walk:
    """What the gate said of a run's walk."""

    seed: int
    table: tuple[gate.Row, ...]


@dataclass(frozen=True)
class Candidate:
    """A controller of a run with touch, and what the gate said of it."""

    seed: int
    rank: int
    network: Network
    fitness: float
    table: tuple[gate.Row, ...]


def config_of(body: str, seed: int, roles: WordRoles, vocabulary: str,
              effort: float = 1.0) -> RobustConfig:
    """Return the robust run of one seed."""
    return RobustConfig(
        body=body, seed=seed, words=roles.trained, vocabulary=vocabulary,
        listening=Listening(attempts=0), move_noise=ears.MOVE_NOISE, careful=True,
        stages=tuple(replace(stage, generations=max(1, round(stage.generations * effort)))
                     for stage in STAGES))


class Lineage:
    """
    The stages up to the choice, in one directory.

    Parameters
    ----------
    directory
        Holds all that the stages make.
    body, roles, vocabulary
        Who learns which words.
    vectors
        Of the trained and validation words; others are not needed and should not be there.
    move_m
        How far the median start must get under a move word.
    threads, effort, say
        Of the engines; factor of all generations; is told what happens.

    """

    def __init__(self, directory: Path, body: str, roles: WordRoles, vocabulary: str,
                 vectors: Mapping[str, Array], move_m: float, *, threads: int = 1,
                 effort: float = 1.0, say: Callable[[str], None] = print) -> None:
        self.directory, self.body, self.roles = directory, bodies.get(body), roles
        self.vocabulary, self.vectors, self.move_m = vocabulary, vectors, move_m
        self.threads, self.effort, self.say = threads, effort, say
        self.world = WORLDS[self.body.world]

    def evolve(self, ear_seeds: int, seeds: list[int], keep: int) -> list[Candidate]:
        """Return the candidates of the last stage, best first in PyBullet (none: all failed)."""
        heard, _screen = ears.find(
            self.directory / 'ears', self.roles, self.vectors, Layout.of(self.body), ear_seeds,
            ears.shorter(ears.PLAN, self.effort), self.say)
        walks = [walk for seed in seeds if (walk := self._walk(seed, heard)) is not None]
        walks.sort(key=lambda walk: -gate.worst_margin(walk.table, self.move_m))
        candidates = [candidate for walk in walks[:keep] for candidate in self._feel(walk.seed)]
        return sorted(candidates, key=self.order)

    def order(self, candidate: Candidate) -> tuple[float, float]:
        """Trained and validation words obeyed, then the shorter of the two ways."""
        obeyed = sum(row.passed for row in candidate.table)
        return -obeyed, -gate.shorter_way(candidate.table)

    def _walk(self, seed: int, heard: Array) -> Walk | None:
        """Evolve a walk; return it with its gate, or None if it is discarded in training."""
        config = config_of(self.body.name, seed, self.roles, self.vocabulary, self.effort)
        directory = self.directory / f'seed_{seed:04d}'
        listeners = directory / 'listeners.npy'
        if not listeners.exists():
            directory.mkdir(parents=True, exist_ok=True)
            rng = generator(seed, GATE)
            chosen = rng.choice(len(heard), min(EARS_OF_A_RUN, len(heard)), replace=False)
            checkpoint.save_array(listeners, heard[np.sort(chosen)])
        # Kept, as a run that has gone on cannot tell any more how it walked before.
        kept = directory / 'walk.json'
        if kept.exists():
            walked = json.loads(kept.read_text(encoding='utf-8'))
        else:
            for stage, least in enumerate(LEAST_FITNESS, 1):
                networks, fitness = self._train(config, stage)
                walked = {'fitness': float(fitness[0]), 'stages': stage, 'rows': None}
                if walked['fitness'] < least:
                    break
            else:
                walked['rows'] = gate.to_json(self._gate(
                    _one(networks, 0), self.roles.trained, (), WALK_STARTS, WALK_GATE))
            checkpoint.write_json(kept, walked)
        if walked['rows'] is None:
            self.say(f'walk {seed}: fitness {walked["fitness"]:.2f} after stage '
                     f'{walked["stages"]}, discarded')
            return None
        table = gate.from_json(walked['rows'])
        self.say(f'walk {seed}: fitness {walked["fitness"]:.2f}, {_told(table)}')
        return Walk(seed, table)

    def _feel(self, seed: int) -> list[Candidate]:
        """Go on with touch; return the run's candidates with their gates."""
        config = config_of(self.body.name, seed, self.roles, self.vocabulary, self.effort)
        networks, fitness = self._train(config, None)
        candidates = []
        for rank in self._scouted(networks):
            network = _one(networks, rank)
            table = self._gate(network, self.roles.trained, self.roles.validation, CHOICE_STARTS,
                               CHOICE_GATE)
            self.say(f'touch {seed}, candidate {rank}: fitness {float(fitness[rank]):.2f}, '
                     f'{_told(table)}')
            candidates.append(Candidate(seed, rank, network, float(fitness[rank]), table))
        return candidates

    def _scouted(self, networks: Network) -> list[int]:
        """Return the ranks of those of a run's best that get farthest both ways in PyBullet."""
        moves = tuple(pair for pair in self.roles.trained if pair[1] != 'stop')
        ways = [gate.shorter_way(self._gate(_one(networks, rank), moves, (), SCOUT_STARTS,
                                            SCOUT_GATE))
                for rank in range(min(SCOUTED, len(networks.hidden_weights)))]
        return np.argsort(-np.array(ways), kind='stable')[:CANDIDATES].tolist()

    def _train(self, config: RobustConfig, stages: int | None) -> tuple[Network, Array]:
        from training.evolution.progress import progress_bar

        total = sum(stage.generations for stage in config.stages[:stages])
        with progress_bar(total, f'{config.body} seed {config.seed}') as shown:
            return train(config, self.directory / f'seed_{config.seed:04d}', shown,
                         threads=self.threads, vectors=self.vectors, stages=stages)

    def final(self, candidate: Candidate) -> tuple[gate.Row, ...]:
        """Return the final table of a candidate, without the held-out words."""
        return self._gate(candidate.network, self.roles.trained, self.roles.validation,
                          gate.STARTS, FINAL_GATE)

    def later(self, candidate: Candidate) -> tuple[gate.Later, ...]:
        """Return where a candidate gets under the trained move words, much later."""
        return gate.later(candidate.network, self.body, self.world, self.roles.trained,
                          self.vectors, processes=self.threads)

    def numb(self, candidate: Candidate) -> tuple[gate.Row, ...]:
        """Return what a candidate does, from a few starts, when its touch synapses are cut."""
        cut = candidate.network.hidden_weights.copy()
        cut[:, candidate.network.hidden_count + 1:] = 0.0
        words = tuple(pair for pair in self.roles.trained
                      if pair[0] in ('forward', 'backward', 'stop'))
        return self._gate(replace(candidate.network, hidden_weights=cut), words, (),
                          CHOICE_STARTS, FINAL_GATE)

    def _gate(self, network: Network, words: Words, validation: Words, starts: int,
              seed: int) -> tuple[gate.Row, ...]:
        return gate.gate(network, self.body, self.world, words, (), self.vectors,
                         move_m=self.move_m, starts=starts, seed=seed, processes=self.threads,
                         validation=validation)


def _one(networks: Network, index: int) -> Network:
    return Network(networks.hidden_weights[index], networks.motor_weights[index],
                   networks.motor_time_constants)


def _told(table: tuple[gate.Row, ...]) -> str:
    """Say in one line what a table says."""
    moves = ', '.join(f'{row.word} {row.median_x_m:+.2f}' for row in table
                      if row.behaviour != 'stop')
    deaf = [f'{row.word} ({row.p90_distance_m:.2f})' for row in table
            if row.behaviour == 'stop' and not row.passed]
    return f'{moves} m; moves under {", ".join(deaf) if deaf else "no stop word"}'
