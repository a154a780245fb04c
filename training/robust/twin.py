"""
The physical twin's champion: ears, walks, choice in PyBullet, blind look.

  python -m training champions --body physical_twin --out out/champions/twin --ears 5 --seeds 0

The twin has no sensors, so what its motors do follows from the word alone: with ears that sort the
words (module `ears`), random motor weights walk both ways within a few generations. The way from
there is that of the quadruped (module `lineage`) without touch: the same roles of the words, the
best of each run in PyBullet under trained and validation words, one choice, and only then the
held-out words, once. The final table is kept word by word: the same command goes on where it
stopped.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from training.evolution import checkpoint
from training.evolution.operators import Array, Layout
from training.evolution.treatments import Words
from training.robust import blind, ears, gate, record
from training.robust.config import RobustConfig, Stage
from training.robust.lineage import CHOICE_GATE, FINAL_GATE
from training.robust.listening import Listening
from training.robust.scenarios import Randomisation
from training.robust.search import train
from training.robust.word_roles import QUADRUPED as ROLES
from w2b_core import bodies
from w2b_core.network import Network
from w2b_core.vocabulary import Vocabulary
from w2b_sim.engines.interface import Evaluator
from w2b_sim.worlds import WORLDS, World

#: A body length in 10 s is asked for.
BODY, MOVE_M = 'physical_twin', 0.12
#: A control period in 20 steps of 2.5 ms follows PyBullet's 50 closely enough to train in.
PHYSICS_STEPS = 20
#: Walk both ways for half of the time; then for twice of it, in which who walks in a circle gets
#: nowhere, under more of the stop words.
STAGES = (Stage(80, 2, 3, 0, False, 0.4, vectors=False, length=0.5),
          Stage(70, 3, 6, 15, False, 0.8, vectors=False, length=2.0))
#: Starts in PyBullet for the choice: a body without sensors does much the same from each.
CHOICE_STARTS = 1


@dataclass(frozen=True)
class Candidate:
    """The best of a run, and what the gate said of it."""

    seed: int
    network: Network
    fitness: float
    table: tuple[gate.Row, ...]

    @property
    def order(self) -> tuple[float, float]:
        """Trained and validation words obeyed, then the shorter of the two ways; least first."""
        return -sum(row.passed for row in self.table), -gate.shorter_way(self.table)


def config_of(seed: int, vocabulary: str, effort: float) -> RobustConfig:
    """Return the robust run of one seed."""
    return RobustConfig(
        body=BODY, seed=seed, words=ROLES.trained, vocabulary=vocabulary,
        physics_steps=PHYSICS_STEPS, population=30, listening=Listening(attempts=0),
        move_noise=ears.MOVE_NOISE, careful=True,
        randomisation=Randomisation(contact=False, servos=False, pushes=False),
        stages=tuple(replace(stage, generations=max(1, round(stage.generations * effort)))
                     for stage in STAGES))


def champion(directory: Path, *, ear_seeds: int, seeds: list[int], vocabulary: str, threads: int,
             effort: float, say: Callable[[str], None] = print) -> bool:
    """
    Make the champion in `directory` (champion.json, champion.md, table.json, blind.json).

    Returns whether it obeys every trained word and every held-out stop word. If the best candidate
    does not obey every trained word, no held-out word is looked up.
    """
    words = Vocabulary.load(vocabulary)
    vectors = {word: words.vector(word) for word, _asked in ROLES.trained + ROLES.validation}
    heard, _screen = ears.find(directory / 'ears', ROLES, vectors, Layout.of(bodies.get(BODY)),
                               ear_seeds, ears.shorter(ears.PLAN, effort), say)
    candidates = [_candidate(directory / f'seed_{seed:04d}', config_of(seed, vocabulary, effort),
                             heard, vectors, threads, say) for seed in seeds]
    best = min(candidates, key=lambda candidate: candidate.order)
    table = final(directory, best.network, vectors, threads)
    if not gate.passes(table):
        say(f'seed {best.seed} fails; no held-out word was asked\n{gate.to_markdown(table)}')
        return False
    unheard, opened = blind.look(directory, best.network, bodies.get(BODY), _world(),
                                 ROLES.held_out, words, move_m=MOVE_M, seed=FINAL_GATE,
                                 processes=threads)
    table += unheard
    later = gate.later(best.network, bodies.get(BODY), _world(), ROLES.trained, vectors,
                       processes=threads)
    made = record.Champion(config_of(best.seed, vocabulary, effort), best.network, best.fitness,
                           table, opened, later)
    record.write(directory, made, ROLES, words)
    say(f'{gate.to_markdown(table)}\ncandidates that were asked held-out words, this one '
        f'included: {opened}')
    return gate.passes(table)


def _candidate(directory: Path, config: RobustConfig, heard: Array, vectors: Mapping[str, Array],
               threads: int, say: Callable[[str], None]) -> Candidate:
    """Evolve a run; return its best with its gate, which is kept."""
    from training.evolution.progress import progress_bar

    listeners = directory / 'listeners.npy'
    if not listeners.exists():
        directory.mkdir(parents=True, exist_ok=True)
        checkpoint.save_array(listeners, heard)
    with progress_bar(config.generations, f'{BODY} seed {config.seed}') as shown:
        networks, fitness = train(config, directory, shown, threads=threads, vectors=vectors)
    network = replace(networks, hidden_weights=networks.hidden_weights[0],
                      motor_weights=networks.motor_weights[0])
    kept = directory / 'choice.json'
    if not kept.exists():
        checkpoint.write_json(kept, {'rows': gate.to_json(_rows(
            network, ROLES.trained, ROLES.validation, vectors, CHOICE_STARTS, CHOICE_GATE,
            threads))})
    table = gate.from_json(json.loads(kept.read_text(encoding='utf-8'))['rows'])
    found = Candidate(config.seed, network, float(fitness[0]), table)
    say(f'seed {config.seed}: fitness {found.fitness:.2f}, {-found.order[0]} of {len(table)} '
        f'words in PyBullet, shorter way {-found.order[1]:+.2f} m')
    return found


def final(directory: Path, network: Network, vectors: Mapping[str, Array], processes: int
          ) -> tuple[gate.Row, ...]:
    """Return the rows of trained and validation words from all starts; what is done is kept."""
    from w2b_sim.engines.pybullet_evaluator import PyBulletEvaluator

    kept = directory / 'final.json'
    weights = blind.weights_sha256(network)
    done: dict[str, Any] = {'weights_sha256': weights, 'rows': []}
    if kept.exists():
        read = json.loads(kept.read_text(encoding='utf-8'))
        done = read if read['weights_sha256'] == weights else done
    table = list(gate.from_json(done['rows']))
    left = (ROLES.trained + ROLES.validation)[len(table):]
    if not left:
        return tuple(table)
    with PyBulletEvaluator(bodies.get(BODY), _world(), processes=processes) as evaluator:
        for pair in left:
            trained = pair in ROLES.trained
            table += _rows(network, (pair,) if trained else (), () if trained else (pair,),
                           vectors, gate.STARTS, FINAL_GATE, processes, evaluator)
            checkpoint.write_json(kept, {'weights_sha256': weights, 'rows': gate.to_json(table)})
    return tuple(table)


def _rows(network: Network, words: Words, validation: Words, vectors: Mapping[str, Array],
          starts: int, seed: int, processes: int, evaluator: Evaluator | None = None
          ) -> tuple[gate.Row, ...]:
    return gate.gate(network, bodies.get(BODY), _world(), words, (), vectors, move_m=MOVE_M,
                     starts=starts, seed=seed, processes=processes, evaluator=evaluator,
                     validation=validation)


def _world() -> World:
    return WORLDS[bodies.get(BODY).world]
