"""
How robustness grows with each means of the robust mode.

  python -m training ablation --out out/ablation --seeds 0-11

Every row evolves walks from random motor weights and the same ears, several seeds each, with one
more means of randomisation than the row above; then with all of them, but another fitness; then
goes on with the touch sensors in use. The best of each run is judged twice: in the batched engine
in situations that are drawn anew with every means, the same for all rows, and in PyBullet, which
none has seen, under trained and validation words: held-out words take no part. The last row
chooses, of each few runs with all means, the best by the PyBullet gate from other starts.

Writes ablation.md and ablation.json after every row; the same command again goes on there.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import fisher_exact, mannwhitneyu

from training.evolution import checkpoint
from training.evolution.operators import Array, Layout
from training.robust import ears, gate
from training.robust.champions import parse_seeds
from training.robust.config import RobustConfig, Stage
from training.robust.listening import Listening
from training.robust.scenarios import Randomisation
from training.robust.search import RobustSearch, train, vectors_by_behaviour
from training.robust.word_roles import QUADRUPED
from w2b_core import bodies
from w2b_core.network import Network
from w2b_sim.worlds import WORLDS

BODY, MOVE_M = 'quadruped', 0.5
#: What PyBullet is asked, beside the two moves.
STOPS = ('stop', 'cease', 'stopped', 'terminate')
#: Starts of the judge, and of the gate that chooses in the last row.
JUDGE, CHOICE = 0, 1
CLIP_M, NO_CLIP_M = 1.0, 100.0
EVERY = ('starts', 'vectors', 'friction', 'contact', 'bodies', 'servos', 'pushes')
#: Of so many runs the last row chooses one by the gate.
GATED_RUNS = 3


@dataclass(frozen=True)
class Treatment:
    """One row: means in use, how fitness is made of progress, and whether touch is used."""

    name: str
    means: tuple[str, ...]
    aggregate: str = 'balanced'
    clip_m: float = CLIP_M
    touch: bool = False


ROWS = (
    Treatment('no randomisation', ()),
    Treatment('+ starts', EVERY[:1]),
    Treatment('+ word vectors', EVERY[:2]),
    Treatment('+ friction', EVERY[:3]),
    Treatment('+ contact', EVERY[:4]),
    Treatment('+ mass and gravity', EVERY[:5]),
    Treatment('+ servos', EVERY[:6]),
    Treatment('+ pushes: all means', EVERY),
    Treatment('all means, plain mean instead of mean and worst third', EVERY, 'mean'),
    Treatment('all means, progress without a clip', EVERY, clip_m=NO_CLIP_M),
    Treatment('all means, worst behaviour instead of the sum', EVERY, 'worst_word'),
    Treatment('all means, touch in use, without sensor faults', EVERY, touch=True),
    Treatment('all means, touch in use, with sensor faults', (*EVERY, 'sensors'), touch=True),
)
ALL = next(row.name for row in ROWS if row.means == EVERY)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    add = parser.add_argument
    add('--out', type=Path, required=True, metavar='DIR', help='where the runs and the table go')
    add('--ears', type=int, default=20, metavar='N',
        help='runs of listening before the first row (default: %(default)s)')
    add('--seeds', default='0-11', metavar='A-B', help='of each row (default: %(default)s)')
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
    from w2b_core.vocabulary import Vocabulary

    vocabulary = Vocabulary.load()
    vectors = {word: vocabulary.vector(word) for word, _asked in QUADRUPED.trained
               + QUADRUPED.validation}
    heard, _screen = ears.find(args.out / 'ears', QUADRUPED, vectors, Layout.of(bodies.get(BODY)),
                               args.ears, say=lambda text: print(text, file=sys.stderr))
    rows: list[dict[str, Any]] = []
    chosen: list[dict[str, Any]] = []
    for treatment in ROWS:
        runs = [_run(args, treatment, seed, heard, vectors) for seed in parse_seeds(args.seeds)]
        rows.append({'row': treatment.name, 'runs': runs})
        if treatment.name == ALL:
            chosen = [{'row': f'all means, of every {GATED_RUNS} runs the best by the gate',
                       'runs': _gated(runs)}]
        checkpoint.write_json(args.out / 'ablation.json', {
            'body': BODY, 'generations': args.generations, 'starts': args.starts,
            'table': rows + chosen})
        checkpoint.write_atomically(args.out / 'ablation.md',
                                    to_markdown(rows + chosen).encode())
        print(to_markdown(rows[-1:]).splitlines()[-1], file=sys.stderr, flush=True)
    return to_markdown(rows + chosen)


def _gated(runs: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return of every `GATED_RUNS` runs the one that the gate prefers."""
    return [max(runs[first:first + GATED_RUNS],
                key=lambda run: gate.worst_margin(gate.from_json(run['choice']), MOVE_M))
            for first in range(0, len(runs), GATED_RUNS)]


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
    config = config_of(treatment, seed, args.generations)
    networks, fitness = train(config, directory, threads=args.threads, vectors=vectors)
    network = Network(networks.hidden_weights[0], networks.motor_weights[0],
                      networks.motor_time_constants)
    found = {'seed': seed, 'fitness': float(fitness[0]),
             'drawn_fitness': _examined(config, network, vectors, args.threads),
             'rows': gate.to_json(_judge(network, vectors, args, JUDGE)),
             'choice': gate.to_json(_judge(network, vectors, args, CHOICE))
             if treatment.name == ALL else []}
    checkpoint.write_json(kept, found)
    return found


def _examined(config: RobustConfig, network: Network, vectors: Mapping[str, Array],
              threads: int) -> float:
    """Return the default fitness in a draw with every means, the same for all rows of a seed."""
    same = replace(config, aggregate='balanced', randomisation=Randomisation(),
                   stages=(replace(config.stages[-1], clip_m=CLIP_M),))
    search = RobustSearch(same, vectors_by_behaviour(same, vectors), None, threads)
    genome = search.layout.genome(network)
    return float(search.examine(genome[None], same.randomisation)[0])


def config_of(treatment: Treatment, seed: int, generations: int) -> RobustConfig:
    """Return the run of a row's seed."""
    vectors = 'vectors' in treatment.means
    walk = Stage(generations, 6, 6, 15, False, treatment.clip_m, vectors=vectors,
                 stray_weight=3.0, free_stray_m=0.02)
    feel = replace(walk, generations=generations // 3, stops=9, touch=True)
    return RobustConfig(
        body=BODY, seed=seed, words=QUADRUPED.trained, listening=Listening(attempts=0),
        randomisation=Randomisation.only(*treatment.means), move_noise=ears.MOVE_NOISE,
        careful=True, aggregate=treatment.aggregate,
        stages=(walk, feel) if treatment.touch else (walk,))


def _judge(network: Network, vectors: Mapping[str, Array], args: argparse.Namespace,
           seed: int) -> tuple[gate.Row, ...]:
    trained = tuple(pair for pair in QUADRUPED.trained if pair[1] != 'stop' or pair[0] in STOPS)
    validation = tuple(pair for pair in QUADRUPED.validation if pair[0] in STOPS)
    body = bodies.get(BODY)
    return gate.gate(network, body, WORLDS[body.world], trained, (), vectors, move_m=MOVE_M,
                     starts=args.starts, seed=seed, processes=args.threads,
                     validation=validation)


def to_markdown(rows: Sequence[Mapping[str, Any]]) -> str:
    """
    Return the table, a row a treatment: medians over its runs, and tests against the first row.

    *Drawn worlds* is the fitness in situations with every means. The columns to its right are
    PyBullet's: medians over the runs of each run's result, for *shorter way* with the quartiles.
    Both have the p of a one-sided Mann-Whitney test against the first row. *Both ways* counts
    the runs whose median start gets `MOVE_M` in each direction (p: Fisher's exact test against the
    first row, one-sided), *obey* those that also stay within the gate's bound under the stop words.
    """
    lines = ['| means | runs | fitness, own worlds | fitness, drawn worlds (p) | forward, m | '
             'backward, m | shorter way, m (quartiles; p) | farthest under a stop word, m | '
             'both ways (p) | obey |',
             '|---' * 10 + '|']
    first = _judged(rows[0])
    for row in rows:
        runs = row['runs']
        judged = _judged(row)
        low, middle, high = np.quantile(judged.shorter_m, [0.25, 0.5, 0.75])
        against = judged.against(first) if row is not rows[0] else ('', '', '')
        lines.append(
            f'| {row["row"]} | {len(runs)} | {np.median([run["fitness"] for run in runs]):.2f} | '
            f'{np.median(judged.drawn):.2f}{against[2]} | '
            f'{np.median(judged.forward_m):+.2f} | {-np.median(judged.backward_m):+.2f} | '
            f'{middle:+.2f} ({low:+.2f} to {high:+.2f}{against[0]}) | '
            f'{np.median(judged.farthest_m):.2f} | {judged.both_ways}{against[1]} | '
            f'{judged.obey} |')
    return '\n'.join(lines) + '\n'


@dataclass(frozen=True)
class _Judged:
    """Of a row's runs, (R,): fitness in drawn worlds; ways and distances in PyBullet; a count."""

    drawn: Array
    forward_m: Array
    backward_m: Array
    farthest_m: Array
    obey: int

    @property
    def shorter_m(self) -> Array:
        return np.minimum(self.forward_m, self.backward_m)

    @property
    def both_ways(self) -> int:
        return int((self.shorter_m >= MOVE_M).sum())

    def against(self, first: _Judged) -> tuple[str, str, str]:
        """Return p of the shorter way, of the count and of the fitness against the first row's."""
        way, drawn = (mannwhitneyu(mine, theirs, alternative='greater').pvalue for mine, theirs in
                      ((self.shorter_m, first.shorter_m), (self.drawn, first.drawn)))
        table = [[judged.both_ways, len(judged.shorter_m) - judged.both_ways]
                 for judged in (self, first)]
        count = fisher_exact(table, alternative='greater').pvalue
        return f'; {way:.2g}', f' ({count:.2g})', f' ({drawn:.2g})'


def _judged(row: Mapping[str, Any]) -> _Judged:
    tables = [gate.from_json(run['rows']) for run in row['runs']]

    def ways(behaviour: str) -> Array:
        return np.array([next(gate.score(line) for line in table if line.behaviour == behaviour)
                         for table in tables])
    farthest = np.array([max(line.p90_distance_m for line in table if line.behaviour == 'stop')
                         for table in tables])
    drawn = np.array([run['drawn_fitness'] for run in row['runs']])
    return _Judged(drawn, ways('forward'), ways('backward'), farthest,
                   sum(map(gate.passes, tables)))
