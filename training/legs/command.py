"""
Train legs by a recipe: a commanded leaky network that moves a body.

    python -m training legs training/recipes/twin.yaml --out out/legs_twin

Seeds run side by side, a process each; those that stand or vibrate are dropped, the best go on.
Killed at any moment, the same command goes on where it was. The same recipe and seed give the same
champion. `champion.npz` in the directory has the network, `champion.json` how it was made.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from time import perf_counter

from training.evolution.checkpoint import CheckpointError
from training.evolution.rundir import RunConflictError
from training.legs.recipe import RecipeError, load_recipe


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add this command's options."""
    parser.add_argument('recipe', type=Path, help='YAML file, see training/recipes')
    parser.add_argument('--out', type=Path, required=True, help='directory of the run')
    parser.add_argument('--body', help="a body or file such as my_robot.yaml, not the recipe's")
    parser.add_argument('--seed', type=int, help="base seed in place of the recipe's")
    parser.add_argument('--seeds', type=int, help="number of seeds in place of the recipe's")
    parser.add_argument('--workers', type=int, default=len(os.sched_getaffinity(0)),
                        help='processes side by side (default: one a core)')


def main(args: argparse.Namespace) -> int:
    """Run the command; return the exit code."""
    changes = {name: getattr(args, name) for name in ('body', 'seed', 'seeds')
               if getattr(args, name) is not None}
    if args.workers < 1:
        print(f'legs: --workers: expected at least 1, got {args.workers}', file=sys.stderr)
        return 2
    from training.legs.run import NoChampionError, train

    began = perf_counter()

    def report(line: str) -> None:
        print(f'{perf_counter() - began:6.0f} s  {line}', flush=True)
    try:
        recipe = load_recipe(args.recipe, **changes)
        champion = train(recipe, args.out, workers=args.workers, report=report)
    except (RecipeError, RunConflictError, CheckpointError, NoChampionError) as error:
        print(f'legs: {error}', file=sys.stderr)
        return 1
    report(f'champion: seed {champion.seed}, fitness {champion.report["fitness"]:.3f}')
    for behaviour, figures in champion.report['behaviours'].items():
        torque = figures['mean_torque_nm']
        print(f'  {behaviour:10s} score {figures["score"]:.2f}  '
              f'{figures["body_lengths_per_s"]:+.2f} body lengths/s  '
              f'{figures["turning_deg_s"]:+.1f} deg/s  '
              f'fastest joint {figures["fastest_joint_hz"]:.1f} Hz  '
              + (f'torque {torque:.3f} N m' if torque is not None else ''))
    print(f'{args.out / "champion.npz"}')
    return 0
