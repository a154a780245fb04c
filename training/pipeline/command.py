"""
Make a champion by a recipe.

  python -m training champions --body my_robot.yaml --out out/champions/my_robot
  python -m training champions --body quadruped --out out/champions/quadruped --seeds 0-9
  python -m training champions training/recipes/serial/quadruped.yaml --out out/champions/mine

A robot of one's own gets legs, by training/recipes/own_robot.yaml or another recipe of legs, and an
ear. What gets less than half of its evolved way in PyBullet or in MuJoCo, or falls, does not ship.
Leaves champion.json (a controller file that carries its body), champion.md, gate.json and legs/.

A body with a recipe in training/recipes/serial gets a controller that is primed with words:
pretrain, evolve, gate, choose, examine. The recipe says how: evolution under the trained words, a
choice in PyBullet under words that evolution did not use, too, and last, once, the held-out words,
from 20 slightly different starts.
Leaves champion.json (a controller file), champion.md, table.json, blind.json and the runs'
directories.

The same command again goes on where it stopped. Exit code 0 if the champion passes, 1 if none does.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from training.configuration import read_recipe
from training.pipeline.parts import Gate, Pretrain
from training.pipeline.recipe import Recipe, load_recipe, shipped

DEFAULT_BODY = 'quadruped'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    add = parser.add_argument
    add('recipe', nargs='?', type=Path,
        help='YAML file (default: that of the body, or that of any robot)')
    add('--body', metavar='NAME_OR_FILE',
        help=f'{", ".join(shipped())}, or a file such as my_robot.yaml (default: {DEFAULT_BODY})')
    add('--out', type=Path, required=True, metavar='DIR', help='where the runs and results go')
    add('--seeds', metavar='A-B', help="of the evolutions, in place of the recipe's")
    add('--keep', type=int, metavar='N',
        help="how many seeds pass the first gate, in place of the recipe's")
    add('--ears', type=int, metavar='N', help="runs of pretraining, in place of the recipe's")
    add('--starts', type=int, metavar='N', help='of the gate of legs (default: 10)')
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


def _check_counts(args: argparse.Namespace) -> None:
    if not 0 < args.effort <= 100:
        raise ValueError(f'effort: expected a factor above 0, got {args.effort}')
    for name in ('keep', 'ears', 'threads', 'starts'):
        if getattr(args, name) is not None and getattr(args, name) < 1:
            raise ValueError(f'{name}: expected at least 1, got {getattr(args, name)}')


def recipe_of(args: argparse.Namespace) -> Recipe:
    """Return the recipe that the options ask for (ValueError if they cannot be)."""
    _check_counts(args)
    if args.starts is not None:
        raise ValueError('starts: expected none for a controller that is primed with words, whose '
                         f'recipe has them, got {args.starts}')
    if args.recipe is not None and args.body is not None:
        raise ValueError(f'--body: expected none beside {args.recipe}, which is for its own '
                         f'body, got {args.body!r}')
    recipe = load_recipe(args.recipe or shipped()[args.body or DEFAULT_BODY])
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


def has_legs(args: argparse.Namespace) -> bool:
    """Return whether legs are asked for: by a recipe of legs, or a body that no other is of."""
    if args.recipe is not None:
        return 'stages' in read_recipe(args.recipe)
    return args.body is not None and args.body not in shipped()


def _with_legs(args: argparse.Namespace) -> bool:
    """Make a champion with legs; return whether it ships (ValueError)."""
    from training.legs import gate
    from training.legs.champion import OWN_ROBOT, make, shortened
    from training.legs.recipe import load_recipe as load_legs

    for name in ('keep', 'ears', 'vocabulary'):
        if getattr(args, name) is not None:
            raise ValueError(f'{name}: expected none for legs, which have no such step, '
                             f'got {getattr(args, name)}')
    _check_counts(args)
    changes: dict[str, Any] = {} if args.body is None else {'body': args.body}
    if args.seeds is not None:
        seeds = parse_seeds(args.seeds)
        if seeds != tuple(range(len(seeds))):
            raise ValueError(f'seeds: expected 0-N for legs, got {args.seeds!r}; another base seed '
                             'is a field of the recipe')
        changes['seeds'] = len(seeds)
    recipe = load_legs(args.recipe or OWN_ROBOT, **changes)
    return make(shortened(recipe, args.effort), args.out, workers=args.threads,
                starts=args.starts or gate.STARTS, say=lambda text: print(text, flush=True))


def main(args: argparse.Namespace) -> int:
    """Run the command; return the exit code: 0 passed, 1 none passed, 2 an error, 130 stopped."""
    from training.legs.run import NoChampionError
    from training.pipeline.run import run

    try:
        if has_legs(args):
            return 0 if _with_legs(args) else 1
        champion = run(recipe_of(args), args.out, threads=args.threads,
                       say=lambda text: print(text, flush=True))
    except NoChampionError as error:
        print(f'champions: {error}', file=sys.stderr)
        return 1
    except (ValueError, OSError) as error:
        print(f'champions: {" ".join(str(error).split())}', file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(f'champions: interrupted; the same command goes on in {args.out}', file=sys.stderr)
        return 130
    return 0 if champion else 1
