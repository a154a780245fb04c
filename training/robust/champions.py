"""
Evolve controllers that obey, gate them in PyBullet, and keep the best.

  python -m training champions --body quadruped --out out/champions/quadruped --seeds 0-9

The quadruped's way from random numbers to a champion is told in module `lineage`, the physical
twin's in module `twin`: evolution under the trained words, a choice in PyBullet in which words take
part that were never heard, and last, once, the held-out words, from 20 slightly different starts.
Leaves champion.json (a controller file), champion.md, table.json, blind.json and the runs'
directories; the same command again goes on where it stopped. Exit code 0 if the champion passes,
1 if none does.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

#: Bodies that ship a champion.
BODIES = ('physical_twin', 'quadruped')


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    add = parser.add_argument
    add('--body', choices=BODIES, default='quadruped', help='default: %(default)s')
    add('--out', type=Path, required=True, metavar='DIR', help='where the runs and results go')
    add('--seeds', default='0-5', metavar='A-B', help='of the runs (default: %(default)s)')
    add('--keep', type=int, default=2, metavar='N',
        help='how many walks of the quadruped go on to touch (default: %(default)s)')
    add('--ears', type=int, default=24, metavar='N',
        help='runs of listening before anybody walks (default: %(default)s)')
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
    from training.robust import quadruped, twin

    seeds = parse_seeds(args.seeds)
    if args.body == 'quadruped':
        passed = quadruped.champion(
            args.out, ear_seeds=args.ears, seeds=seeds, keep=args.keep,
            vocabulary=args.vocabulary, threads=args.threads, effort=args.effort)
    else:
        passed = twin.champion(
            args.out, ear_seeds=args.ears, seeds=seeds, vocabulary=args.vocabulary,
            threads=args.threads, effort=args.effort)
    return 0 if passed else 1
