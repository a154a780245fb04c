"""
Make a champion that is primed with words, by a recipe: pretrain, evolve, gate, choose, examine.

  python -m training champions --body quadruped --out out/champions/quadruped --seeds 0-9
  python -m training champions training/recipes/serial/quadruped.yaml --out out/champions/mine

The recipe says how: evolution under the trained words, a choice in PyBullet under words that
evolution did not use, too, and last, once, the held-out words, from 20 slightly different starts.
Leaves champion.json (a controller file), champion.md, table.json, blind.json and the runs'
directories; the same command again goes on where it stopped. Exit code 0 if the champion passes,
1 if none does.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from training.pipeline.parts import Gate, Pretrain
from training.pipeline.recipe import Recipe, load_recipe, shipped


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    add = parser.add_argument
    add('recipe', nargs='?', type=Path, help='YAML file (default: that of the shipped champion)')
    add('--body', choices=tuple(shipped()), default='quadruped',
        help='whose shipped recipe, if none is given (default: %(default)s)')
    add('--out', type=Path, required=True, metavar='DIR', help='where the runs and results go')
    add('--seeds', metavar='A-B', help="of the evolutions, in place of the recipe's")
    add('--keep', type=int, metavar='N',
        help="how many seeds pass the first gate, in place of the recipe's")
    add('--ears', type=int, metavar='N', help="runs of pretraining, in place of the recipe's")
    add('--vocabulary', help="name or file of the word vectors, in place of the recipe's")
    add('--threads', type=int, default=1, metavar='N', help='changes no result (default: 1)')
    add('--effort', type=float, default=1.0, metavar='F',
        help='factor of all generations; below 1 for a quick look (default: 1)')


def parse_seeds(text: str) -> tuple[int, ...]:
    """Return the seeds of `A-B`, both included, or of `A,B,...` (ValueError for anything else)."""
    try:
        if '-' in text:
            first, last = (int(part) for part in text.split('-'))
            seeds = tuple(range(first, last + 1))
        else:
            seeds = tuple(int(part) for part in text.split(','))
    except ValueError:
        seeds = ()
    if not seeds or min(seeds) < 0:
        raise ValueError(f'seeds: expected A-B or A,B,... of numbers from 0, got {text!r}')
    return seeds


def recipe_of(args: argparse.Namespace) -> Recipe:
    """Return the recipe that the options ask for (ValueError if they cannot be)."""
    if not 0 < args.effort <= 100:
        raise ValueError(f'effort: expected a factor above 0, got {args.effort}')
    for name in ('keep', 'ears', 'threads'):
        if getattr(args, name) is not None and getattr(args, name) < 1:
            raise ValueError(f'{name}: expected at least 1, got {getattr(args, name)}')
    recipe = load_recipe(args.recipe or shipped()[args.body])
    changes: dict[str, Any] = {}
    if args.seeds is not None:
        changes['seeds'] = parse_seeds(args.seeds)
    if args.vocabulary is not None:
        changes['vocabulary'] = args.vocabulary
    return _with_counts(recipe.model_copy(update=changes), args).shortened(args.effort)


def _with_counts(recipe: Recipe, args: argparse.Namespace) -> Recipe:
    """Return the recipe with the counts that were asked for."""
    steps, gates = [], 0
    for part in recipe.steps:
        if isinstance(part, Pretrain) and args.ears is not None:
            part = part.model_copy(update={'runs': args.ears})
        if isinstance(part, Gate):
            gates += 1
            if gates == 1 and args.keep is not None:
                part = part.model_copy(update={'keep': args.keep})
        steps.append(part)
    return recipe.model_copy(update={'steps': tuple(steps)})


def main(args: argparse.Namespace) -> int:
    """Run the command; return the exit code: 0 passed, 1 none passed, 2 an error, 130 stopped."""
    from training.pipeline.run import run

    try:
        champion = run(recipe_of(args), args.out, threads=args.threads,
                       say=lambda text: print(text, flush=True))
    except (ValueError, OSError) as error:
        print(f'champions: {" ".join(str(error).split())}', file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(f'champions: interrupted; the same command goes on in {args.out}', file=sys.stderr)
        return 130
    return 0 if champion else 1
