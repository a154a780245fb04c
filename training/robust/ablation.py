"""
How robustness grows with each means of the robust mode.

  python -m training ablation --out out/ablation --seeds 0-4

Every row evolves walks from random motor weights and the same ears, several seeds each, with one
more means of randomisation than the row above; then with all of them, but another aggregate of the
three behaviours; then goes on with the touch sensors in use. The best of each run is judged in
PyBullet, which none has seen, under trained and validation words: held-out words take no part. The
last row chooses, of the runs with all means, by the PyBullet gate from other starts.

Writes ablation.md and ablation.json after every row; the same command again goes on there.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from training.evolution import checkpoint
from training.evolution.operators import Array, Layout
from training.robust import ears, gate
from training.robust.champions import parse_seeds
from training.robust.listening import Listening
from training.robust.scenarios import Randomisation
from training.robust.search import RobustConfig, Stage, train
from training.robust.word_roles import QUADRUPED
from w2b_controller.network import Network
from w2b_sim import bodies
from w2b_sim.worlds import WORLDS

BODY, MOVE_M = 'quadruped', 0.5
#: What PyBullet is asked, beside the two moves.
STOPS = ('stop', 'cease', 'stopped', 'terminate')
#: Starts of the judge, and of the gate that chooses in the last row.
JUDGE, CHOICE = 0, 1
CLIP_M = 1.0
EVERY = ('starts', 'vectors', 'friction', 'contact', 'bodies', 'servos', 'pushes')


@dataclass(frozen=True)
class Treatment:
    """One row: means in use, aggregate of the behaviours, and whether touch is used at the end."""

    name: str
    means: tuple[str, ...]
    aggregate: str = 'balanced'
    touch: bool = False


ROWS = (
    Treatment('no randomisation', ()),
    Treatment('+ starts', EVERY[:1]),
    Treatment('+ word vectors', EVERY[:2]),
    Treatment('+ friction', EVERY[:3]),
    Treatment('+ contact, mass, gravity, servos, pushes', EVERY),
    Treatment('the same, plain mean instead of mean and worst third', EVERY, 'mean'),
    Treatment('the same, worst behaviour instead of the sum', EVERY, 'worst_word'),
    Treatment('touch in use, without sensor faults', EVERY, touch=True),
    Treatment('touch in use, with sensor faults', (*EVERY, 'sensors'), touch=True),
)
#: Of these runs the last row chooses one by the gate.
GATED = ROWS[4].name


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    add = parser.add_argument
    add('--out', type=Path, required=True, metavar='DIR', help='where the runs and the table go')
    add('--ears', type=int, default=20, metavar='N',
        help='runs of listening before the first row (default: %(default)s)')
    add('--seeds', default='0-4', metavar='A-B', help='of each row (default: %(default)s)')
    add('--generations', type=int, default=300, metavar='N',
        help='of each run; a third more with touch (default: %(default)s)')
    add('--starts', type=int, default=4, metavar='K',
        help='in PyBullet, each word (default: %(default)s)')
    add('--threads', type=int, default=1, metavar='N', help='changes no result (default: 1)')


def main(args: argparse.Namespace) -> int:
    """Run the command; return the exit code: 0, or 2 for an error."""
    try:
        if args.generations < 3 or args.starts < 1 or args.ears < 1:
            raise ValueError('expected at least 3 generations, 1 start and 1 run of listening')
        print(_table(args))
    except (ValueError, OSError) as error:
        print(f'ablation: {" ".join(str(error).split())}', file=sys.stderr)
        return 2
    return 0


def _table(args: argparse.Namespace) -> str:
    from w2b_controller.vocabulary import Vocabulary

    vocabulary = Vocabulary.load()
    vectors = {word: vocabulary.vector(word) for word, _asked in QUADRUPED.trained
               + QUADRUPED.validation}
    heard, _screen = ears.find(args.out / 'ears', QUADRUPED, vectors, Layout.of(bodies.get(BODY)),
                               args.ears, say=lambda text: print(text, file=sys.stderr))
    rows = []
    chosen: list[dict[str, Any]] = []
    for treatment in ROWS:
        runs = [_run(args, treatment, seed, heard, vectors) for seed in parse_seeds(args.seeds)]
        rows.append({'row': treatment.name, 'runs': runs})
        if treatment.name == GATED:
            best = max(runs, key=lambda run: gate.worst_margin(gate.from_json(run['choice']),
                                                               MOVE_M))
            chosen = [{'row': f'all but touch, the best of {len(runs)} runs by the PyBullet gate',
                       'runs': [best]}]
        checkpoint.write_json(args.out / 'ablation.json', {
            'body': BODY, 'generations': args.generations, 'starts': args.starts,
            'table': rows + chosen})
        checkpoint.write_atomically(args.out / 'ablation.md',
                                    to_markdown(rows + chosen).encode())
        print(to_markdown(rows[-1:]).splitlines()[-1], file=sys.stderr, flush=True)
    return to_markdown(rows + chosen)


def _run(args: argparse.Namespace, treatment: Treatment, seed: int, heard: Array,
         vectors: Mapping[str, Array]) -> dict[str, Any]:
    """Evolve and judge one run of a row, or return what was found before."""
    directory = args.out / f'row_{ROWS.index(treatment)}_seed_{seed:04d}'
    kept = directory / 'judged.json'
    if kept.exists():
        done: dict[str, Any] = json.loads(kept.read_text(encoding='utf-8'))
        return done
    directory.mkdir(parents=True, exist_ok=True)
    checkpoint.save_array(directory / 'listeners.npy', heard)
    networks, fitness = train(config_of(treatment, seed, args.generations), directory,
                              threads=args.threads, vectors=vectors)
    network = Network(networks.hidden_weights[0], networks.motor_weights[0],
                      networks.motor_time_constants)
    found = {'seed': seed, 'fitness': float(fitness[0]),
             'rows': gate.to_json(_judge(network, vectors, args, JUDGE)),
             'choice': gate.to_json(_judge(network, vectors, args, CHOICE))
             if treatment.name == GATED else []}
    checkpoint.write_json(kept, found)
    return found


def config_of(treatment: Treatment, seed: int, generations: int) -> RobustConfig:
    """Return the run of a row's seed."""
    vectors = 'vectors' in treatment.means
    stages: tuple[Stage, ...] = (Stage(generations, 6, 6, 15, False, CLIP_M, vectors=vectors,
                                       stray_weight=3.0, free_stray_m=0.02),)
    if treatment.touch:
        stages += (Stage(generations // 3, 6, 9, 15, True, CLIP_M, stray_weight=3.0,
                         free_stray_m=0.02),)
    return RobustConfig(
        body=BODY, seed=seed, words=QUADRUPED.trained, listening=Listening(attempts=0),
        randomisation=Randomisation.only(*treatment.means), move_noise=ears.MOVE_NOISE,
        careful=True, aggregate=treatment.aggregate, stages=stages)


def _judge(network: Network, vectors: Mapping[str, Array], args: argparse.Namespace,
           seed: int) -> tuple[gate.Row, ...]:
    trained = tuple(pair for pair in QUADRUPED.trained if pair[1] != 'stop' or pair[0] in STOPS)
    validation = tuple(pair for pair in QUADRUPED.validation if pair[0] in STOPS)
    body = bodies.get(BODY)
    return gate.gate(network, body, WORLDS[body.world], trained, (), vectors, move_m=MOVE_M,
                     starts=args.starts, seed=seed, processes=args.threads,
                     validation=validation)


def to_markdown(rows: Iterable[Mapping[str, Any]]) -> str:
    """
    Return the table, a row a treatment: medians over its runs of each run's result in PyBullet.

    *Both ways* counts the runs whose median start gets `MOVE_M` in each direction, *obey* those
    that also stay within the gate's bound under the trained stop words.
    """
    lines = ['| means | runs | fitness in training | forward, m | backward, m | '
             'the shorter way of a run, m | farthest under a stop word, m | both ways | obey |',
             '|---' * 9 + '|']
    for row in rows:
        tables = [gate.from_json(run['rows']) for run in row['runs']]
        ways = np.array([[gate.score(line) for line in table if line.behaviour != 'stop']
                         for table in tables])
        far = [max(line.p90_distance_m for line in table if line.behaviour == 'stop')
               for table in tables]
        both = (ways >= MOVE_M).all(axis=1)
        forward, backward = np.median(ways, axis=0)
        lines.append(
            f'| {row["row"]} | {len(tables)} | '
            f'{np.median([run["fitness"] for run in row["runs"]]):.2f} | {forward:+.2f} | '
            f'{-backward:+.2f} | {np.median(ways.min(axis=1)):+.2f} | {np.median(far):.2f} | '
            f'{both.sum()} | {sum(map(gate.passes, tables))} |')
    return '\n'.join(lines) + '\n'
