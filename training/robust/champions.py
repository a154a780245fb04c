"""
Evolve controllers that obey, gate them in PyBullet, and keep the best.

  python -m training champions --body quadruped --out out/champions/quadruped --seeds 0-9

The quadruped's way from random numbers to a champion is told in module `lineage`. The physical
twin's: many short runs of the robust mode's first stage (module `search`), the best of them to the
end, then the gate: every word, trained and held out, in PyBullet, from 20 slightly different
starts. Leaves champion.json (a controller file), champion.md, table.json and the runs' directories;
the same command again goes on where it stopped. Exit code 0 if the champion passes, 1 if none does.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from training.evolution import checkpoint
from training.evolution.champion import WordOutcome, write_champion
from training.evolution.treatments import Words
from training.robust import gate
from training.robust.listening import Listening
from training.robust.scenarios import Randomisation
from training.robust.search import RobustConfig, Stage, train
from w2b_controller import __version__
from w2b_controller.network import Network
from w2b_sim import bodies
from w2b_sim.worlds import WORLDS

Array = NDArray[np.float64]


def _asking(behaviour: str, words: str) -> Words:
    return tuple((word, behaviour) for word in words.split())


#: What the physical twin is trained on. `halt`, `suspend` and the words of `HELD_OUT` never. The
#: quadruped's words are in `word_roles`.
TRAINED: Words = (
    *_asking('forward', 'forward'), *_asking('backward', 'backward'),
    *_asking('stop', 'stop cease discontinue stay interrupt terminate'))
HELD_OUT: Words = (
    *_asking('stop', 'halt suspend freeze pause'), *_asking('forward', 'forwards ahead onward'),
    *_asking('backward', 'backwards reverse rear'))
#: Stop words that were in the training set first, and that no controller has learnt beside the
#: others so far: reported in every table, required by none.
TRIED: Words = _asking('stop', 'quit desist wait refrain stopped')
#: How far the median start must get under a move word: half a metre, and one body length.
MOVE_M = {'quadruped': 0.5, 'physical_twin': 0.12}
#: A control period of the twin in 10 steps of 5 ms follows PyBullet's 50 closely enough to train
#: in. Without sensors, what it does hangs on its hidden layer alone: listening does most of it.
TWIN_STAGES = (Stage(320, 2, 1, 25, True, 0.3, vectors=False),)
PHYSICS_STEPS = {'physical_twin': 10}
#: Candidates of a run's last population that go through the gate.
CANDIDATES = 3


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    add = parser.add_argument
    add('--body', choices=sorted(MOVE_M), default='quadruped', help='default: %(default)s')
    add('--out', type=Path, required=True, metavar='DIR', help='where the runs and results go')
    add('--seeds', default='0-5', metavar='A-B', help='of the runs (default: %(default)s)')
    add('--keep', type=int, default=2, metavar='N',
        help='how many runs go on after the first stage (default: %(default)s)')
    add('--ears', type=int, default=24, metavar='N',
        help='runs of listening before the quadruped walks (default: %(default)s)')
    add('--vocabulary', default='default', help='name or file of the word vectors')
    add('--threads', type=int, default=1, metavar='N', help='changes no result (default: 1)')
    add('--effort', type=float, default=1.0, metavar='F',
        help='factor of all generations; below 1 for a quick look (default: 1)')


def parse_seeds(text: str) -> list[int]:
    """Return the seeds of `A-B`, both included, or of `A,B,...` (ValueError for anything else)."""
    try:
        if '-' in text:
            first, last = (int(part) for part in text.split('-'))
            seeds = list(range(first, last + 1))
        else:
            seeds = [int(part) for part in text.split(',')]
    except ValueError:
        seeds = []
    if not seeds or min(seeds) < 0:
        raise ValueError(f'seeds: expected A-B or A,B,... of numbers from 0, got {text!r}')
    return seeds


def config_of(body: str, seed: int, vocabulary: str = 'default',
              effort: float = 1.0) -> RobustConfig:
    """Return the robust run for one seed of a champion."""
    config = RobustConfig(body=body, seed=seed, words=TRAINED, vocabulary=vocabulary,
                          physics_steps=PHYSICS_STEPS.get(body, 0))
    if body == 'physical_twin':
        config = replace(config, population=20, listening=Listening(16, 400),
                         randomisation=Randomisation(contact=False, servos=False, pushes=False),
                         stages=TWIN_STAGES)
    listening = replace(config.listening,
                        generations=max(1, round(config.listening.generations * effort)))
    return replace(config, listening=listening, stages=tuple(
        replace(stage, generations=max(1, round(stage.generations * effort)))
        for stage in config.stages))


def main(args: argparse.Namespace) -> int:
    """Run the command; return the exit code: 0 passed, 1 none passed, 2 an error, 130 stopped."""
    try:
        if args.keep < 1:
            raise ValueError(f'keep: expected at least 1, got {args.keep}')
        if not 0 < args.effort <= 100:
            raise ValueError(f'effort: expected a factor above 0, got {args.effort}')
        return _champions(args)
    except (ValueError, OSError) as error:
        print(f'champions: {" ".join(str(error).split())}', file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(f'champions: interrupted; the same command goes on in {args.out}', file=sys.stderr)
        return 130


def _champions(args: argparse.Namespace) -> int:
    if args.body == 'quadruped':
        from training.robust import quadruped

        return 0 if quadruped.champion(
            args.out, ear_seeds=args.ears, seeds=parse_seeds(args.seeds), keep=args.keep,
            vocabulary=args.vocabulary, threads=args.threads, effort=args.effort) else 1
    from w2b_controller.vocabulary import Vocabulary

    vocabulary = Vocabulary.load(args.vocabulary)
    vectors = {word: vocabulary.vector(word) for word, _asked in TRAINED + HELD_OUT + TRIED}
    configs = [config_of(args.body, seed, args.vocabulary, args.effort)
               for seed in parse_seeds(args.seeds)]
    early = []
    for config in configs:
        if len(configs) <= args.keep:
            early.append(0.0)
            continue
        _networks, fitness = _train(config, args, vectors, stages=1)
        early.append(float(fitness[0]))
        print(f'seed {config.seed}: fitness {early[-1]:.2f} after the first stage', flush=True)
    best: tuple[float, int, Network, tuple[gate.Row, ...], float] | None = None
    for index in np.argsort(-np.array(early), kind='stable')[:args.keep]:
        config = configs[int(index)]
        networks, fitness = _train(config, args, vectors)
        print(f'seed {config.seed}: fitness {float(fitness[0]):.2f} at the end', flush=True)
        for candidate in range(min(CANDIDATES, len(fitness))):
            network = Network(networks.hidden_weights[candidate],
                              networks.motor_weights[candidate], networks.motor_time_constants)
            table = judge(network, config, vectors, args.threads)
            margin = gate.worst_margin(table, MOVE_M[config.body])
            print(f'seed {config.seed}, candidate {candidate}: '
                  f'{"passes" if gate.passes(table) else "fails"}, margin {margin:.2f}',
                  flush=True)
            if best is None or margin > best[0]:
                best = (margin, config.seed, network, table, float(fitness[candidate]))
                keep(args.out, config, network, table, float(fitness[candidate]), vectors)
            if gate.passes(table):
                break
    assert best is not None
    print(gate.to_markdown(best[3]))
    return 0 if gate.passes(best[3]) else 1


def _train(config: RobustConfig, args: argparse.Namespace, vectors: Mapping[str, Array],
           stages: int | None = None) -> tuple[Network, Array]:
    from training.evolution.progress import progress_bar

    total = sum(stage.generations for stage in config.stages[:stages])
    with progress_bar(total, f'{config.body} seed {config.seed}') as shown:
        return train(config, args.out / f'seed_{config.seed:04d}', shown, threads=args.threads,
                     vectors=vectors, stages=stages)


def judge(network: Network, config: RobustConfig, vectors: Mapping[str, Array],
          processes: int = 1) -> tuple[gate.Row, ...]:
    """Return the gate's table for one controller of a run."""
    return gate.gate(network, bodies.get(config.body), WORLDS[config.world], TRAINED,
                     HELD_OUT + TRIED, vectors, move_m=MOVE_M[config.body], processes=processes,
                     optional=tuple(word for word, _asked in TRIED))


def keep(directory: Path, config: RobustConfig, network: Network, table: Sequence[gate.Row],
         fitness: float, vectors: Mapping[str, Array]) -> None:
    """Write the champion's controller file and tables."""
    world = WORLDS[config.world]
    judged = [WordOutcome(row.word, row.behaviour, row.trained, gate.score(row), (), (), ())
              for row in table]
    record: dict[str, Any] = {
        'mode': 'robust', 'engine': 'batched', 'precision': 'float32', 'world': world.name,
        'objective': 'robust', 'seed': config.seed, 'fitness': fitness,
        'program_version': __version__,
        'held_out': [list(pair) for pair in HELD_OUT],
        'tried': [list(pair) for pair in TRIED],
        'config': config.to_json(),
        'gate': {'engine': 'pybullet', 'starts': gate.STARTS, 'rows': gate.to_json(table)}}
    heard = np.array([vectors[row.word] for row in table])
    write_champion(directory / 'champion.json', bodies.get(config.body), world, network, judged,
                   heard, record)
    checkpoint.write_json(directory / 'table.json', {
        'body': config.body, 'world': world.name, 'seed': config.seed,
        'starts': gate.STARTS, 'passed': gate.passes(table), 'rows': gate.to_json(table)})
    checkpoint.write_atomically(directory / 'champion.md', gate.to_markdown(table).encode())
