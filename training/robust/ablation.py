"""
How robustness grows with each means of the robust mode.

  python -m training ablation --out out/ablation --seed 0

The same walkers (the first stage of a robust run, in one fixed draw) are hardened for the same
number of generations, each time with one more means of randomisation, and the best of each is
judged in PyBullet, which none of them has seen. Prints and writes a table (ablation.md,
ablation.json).
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from training.evolution import checkpoint
from training.evolution.operators import Layout
from training.robust import gate
from training.robust.champions import HELD_OUT, MOVE_M, TRAINED, config_of
from training.robust.scenarios import DIRECTION, Randomisation
from training.robust.search import RobustConfig, RobustSearch, Stage, train
from w2b_controller.network import Network
from w2b_sim import bodies
from w2b_sim.worlds import WORLDS

Array = NDArray[np.float64]

#: Row of the table -> (means that this row adds to those above, touch sensors in use).
ROWS: tuple[tuple[str, tuple[str, ...], bool], ...] = (
    ('none', (), False),
    ('starts', ('starts',), False),
    ('word vectors', ('vectors',), False),
    ('friction', ('friction',), False),
    ('contact, mass, gravity, servos, pushes', ('contact', 'bodies', 'servos', 'pushes'), False),
    ('touch, without sensor faults', (), True),
    ('touch, with sensor faults', ('sensors',), True),
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    add = parser.add_argument
    add('--body', choices=sorted(MOVE_M), default='quadruped', help='default: %(default)s')
    add('--out', type=Path, required=True, metavar='DIR', help='where the table goes')
    add('--seed', type=int, default=0, help='default: 0')
    add('--generations', type=int, default=80, metavar='N',
        help='of hardening, each row (default: %(default)s)')
    add('--starts', type=int, default=8, metavar='K',
        help='in PyBullet, each word (default: %(default)s)')
    add('--walkers', type=Path, default=None, metavar='FILE.npy',
        help='genomes (N, G) to harden, instead of the first stage of the seed')
    add('--vocabulary', default='default', help='name or file of the word vectors')
    add('--threads', type=int, default=1, metavar='N', help='changes no result (default: 1)')


def main(args: argparse.Namespace) -> int:
    """Run the command; return the exit code: 0, or 2 for an error."""
    try:
        if args.generations < 1 or args.starts < 1:
            raise ValueError('generations and starts: expected at least 1')
        print(_table(args))
    except (ValueError, OSError) as error:
        print(f'ablation: {" ".join(str(error).split())}', file=sys.stderr)
        return 2
    return 0


def _table(args: argparse.Namespace) -> str:
    from w2b_controller.vocabulary import Vocabulary

    vocabulary = Vocabulary.load(args.vocabulary)
    vectors = {word: vocabulary.vector(word) for word, _asked in TRAINED + HELD_OUT}
    config = config_of(args.body, args.seed, args.vocabulary)
    walkers = _walkers(args, config, vectors)
    judged = tuple(pair for pair in TRAINED if pair[0] in ('forward', 'backward', 'stop'))
    unheard = tuple(pair for pair in HELD_OUT if pair[0] in ('halt', 'suspend'))
    means: set[str] = set()
    rows: list[dict[str, Any]] = []
    for name, added, touch in ROWS:
        means |= set(added)
        network = _harden(config, Randomisation.only(*means), touch, walkers, vectors, args)
        table = gate.gate(network, bodies.get(config.body), WORLDS[config.world], judged, unheard,
                          vectors, move_m=MOVE_M[config.body], starts=args.starts,
                          processes=args.threads)
        rows.append({'means': name, 'touch': touch, 'rows': gate.to_json(table)})
        args.out.mkdir(parents=True, exist_ok=True)
        checkpoint.write_json(args.out / 'ablation.json', {
            'body': config.body, 'generations': args.generations, 'starts': args.starts,
            'table': rows})
        checkpoint.write_atomically(args.out / 'ablation.md', to_markdown(rows).encode())
        print(f'{name}: ' + ', '.join(f'{row.word} {row.median_x_m:+.2f}' for row in table),
              file=sys.stderr, flush=True)
    return to_markdown(rows)


def _walkers(args: argparse.Namespace, config: RobustConfig, vectors: dict[str, Array]) -> Array:
    if args.walkers is not None:
        return load_walkers(args.walkers, Layout.of(bodies.get(config.body)).size)
    networks, _fitness = train(config, args.out / 'walkers', vectors=vectors, stages=1,
                               threads=args.threads)
    return Layout.of(bodies.get(config.body)).genome(networks)


def load_walkers(path: Path, size: int) -> Array:
    """Return the genomes (N, `size`) in a .npy file (ValueError if there are none)."""
    try:
        walkers = np.load(path, allow_pickle=False)
    except (OSError, ValueError, EOFError) as error:
        raise ValueError(f'--walkers {path}: expected a .npy file of genomes, got none that can be '
                         f'read ({checkpoint.reason(error)})') from None
    if not (isinstance(walkers, np.ndarray) and walkers.dtype.kind == 'f' and walkers.ndim == 2
            and walkers.shape[0] > 0 and walkers.shape[1] == size):
        raise ValueError(f'--walkers {path}: expected numbers of shape (N, {size}), '
                         f'got {getattr(walkers, "shape", "an .npz file")}')
    return walkers.astype(np.float64)


def _harden(config: RobustConfig, means: Randomisation, touch: bool, walkers: Array,
            vectors: dict[str, Array], args: argparse.Namespace) -> Network:
    """Return the best network after hardening the walkers with some means."""
    stage = Stage(args.generations, 6, 6, 15, touch, 0.8)
    heard = {behaviour: np.array([vectors[word] for word, asked in config.words
                                  if asked == behaviour]) for behaviour in DIRECTION}
    search = RobustSearch(replace(config, randomisation=means, stages=(stage,), listening=replace(
        config.listening, attempts=0)), heard, None, args.threads)
    search.start_from(walkers)
    search.evolve()
    networks, _fitness = search.ranked()
    return Network(networks.hidden_weights[0], networks.motor_weights[0],
                   networks.motor_time_constants)


def to_markdown(rows: list[dict[str, Any]]) -> str:
    """Return the table: a row a set of means, final x in PyBullet."""
    words = [row['word'] for row in rows[0]['rows']]
    lines = ['| one more means in each row | ' + ' | '.join(
        f'{word}, median x (quartiles), m' if word in ('forward', 'backward')
        else f'{word}, 90 % within, m' for word in words) + ' |', '|---' * (len(words) + 1) + '|']
    for entry in rows:
        cells = []
        for row in entry['rows']:
            if row['behaviour'] == 'stop':
                far = row['p90_distance_m']
                cells.append('exploded' if far is None else f'{far:.3f}')
            else:
                cells.append(f'{row["median_x_m"]:+.2f} ({row["lower_quartile_x_m"]:+.2f} to '
                             f'{row["upper_quartile_x_m"]:+.2f})')
        lines.append(f'| {entry["means"]} | ' + ' | '.join(cells) + ' |')
    return '\n'.join(lines) + '\n'
