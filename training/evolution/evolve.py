"""
Evolve one controller: `python -m training evolve --body quadruped --out out/run`.

The same command again goes on where a killed run stopped, and ends in the same champion as a run
that was never stopped; more --generations take a finished run further. Results, in the directory:
champion.json (a controller file), statistics.npz, summary.json. With the batched engine a
paper-sized run takes about a minute; PyBullet manages 6 evaluations a second a core of the
quadruped, 22 of the spheres.
"""

from __future__ import annotations

import argparse
import sys
from math import inf
from pathlib import Path
from typing import Any

from training.evolution.config import RunConfig
from training.evolution.engines import ENGINES, PRECISIONS
from training.evolution.objectives import AGGREGATES, OBJECTIVES
from training.evolution.optimisers import OPTIMISERS, PAPER
from training.evolution.treatments import TREATMENTS, WORD_SETS, Words, draw_words


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    add = parser.add_argument
    add('--body', default='quadruped',
        help='a registered body, or a file such as my_robot.yaml (default: %(default)s)')
    add('--out', type=Path, required=True, metavar='DIR', help="the run's own directory")
    add('--seed', type=int, default=0, help='everything random follows from it (default: 0)')
    add('--generations', type=int, default=6000, metavar='N', help="default: the paper's 6000")
    add('--population', type=int, default=50, metavar='N', help="default: the paper's 50")
    add('--engine', choices=ENGINES, default='batched', help='default: %(default)s')
    add('--precision', choices=PRECISIONS, default='float32', help='of the batched engine')
    add('--world', default='', help="default: the body's own")
    add('--word-set', choices=sorted(WORD_SETS), default=None,
        help="the study's words, one stop word drawn to be held out (default: paper)")
    add('--words', metavar='WORD=BEHAVIOUR,...', default=None,
        help='train on these words instead, e.g. forward=forward,back=backward,stop=stop')
    add('--held-out', metavar='WORD=BEHAVIOUR,...', default=None,
        help='judge the champion under these words too; only with --words')
    add('--treatment', choices=TREATMENTS, default='experimental',
        help="control: every word's vector shuffled by its own permutation")
    add('--optimiser', choices=OPTIMISERS.names(), default=PAPER,
        help='; '.join(f'{name}: {OPTIMISERS.get(name).about}' for name in OPTIMISERS)
        + ' (default: %(default)s)')
    add('--objective', choices=sorted(OBJECTIVES), default='program', help='default: %(default)s')
    add('--aggregate', choices=AGGREGATES, default='sum',
        help='worst: each word counts as the worst of its kind (default: %(default)s)')
    add('--starts', type=int, default=1, metavar='K',
        help='average over K slightly different starts (default: 1, the exact start pose)')
    add('--vocabulary', default='default', help='name or file of the word vectors')
    add('--threads', type=int, default=1, metavar='N',
        help='threads (PyBullet: processes); changes no result (default: 1)')
    add('--checkpoint-seconds', type=float, default=10.0, metavar='S',
        help='at most this much work is lost to a kill (default: 10)')
    add('--checkpoint-generations', type=int, default=None, metavar='N',
        help='and at most this many generations')


def parse_words(text: str) -> Words:
    """
    Return the (word, behaviour) pairs of `word=behaviour,...`.

    Raises
    ------
    ValueError
        If a part is not of that form.

    """
    pairs = []
    for part in text.split(','):
        word, equals, behaviour = part.strip().partition('=')
        if not (word and equals and behaviour):
            raise ValueError(f'words: expected WORD=BEHAVIOUR,..., got {part!r}')
        pairs.append((word.strip(), behaviour.strip()))
    return tuple(pairs)


def config_of(args: argparse.Namespace) -> RunConfig:
    """Return the run that the options ask for (ValueError if they contradict each other)."""
    if args.words is not None and args.word_set is not None:
        raise ValueError('--words and --word-set exclude each other; give one of them')
    if args.held_out is not None and args.words is None:
        raise ValueError('--held-out needs --words; a word set draws its own held-out word')
    if args.engine == 'pybullet' and args.precision != 'float32':
        raise ValueError("--precision is the batched engine's; PyBullet always computes in double")
    if args.words is not None:
        words = parse_words(args.words)
        held_out = parse_words(args.held_out) if args.held_out else ()
    else:
        words, held_out = draw_words(args.word_set or 'paper', args.seed)
    return RunConfig(
        body=args.body, seed=args.seed, words=words, held_out=held_out,
        generations=args.generations, population=args.population, treatment=args.treatment,
        optimiser=args.optimiser, objective=args.objective, aggregate=args.aggregate,
        starts=args.starts, engine=args.engine, precision=args.precision, world=args.world,
        vocabulary=args.vocabulary)


def main(args: argparse.Namespace) -> int:
    """Run the command; return the exit code: 0, 2 for an error, 130 if interrupted."""
    try:
        if not 0 < args.checkpoint_seconds < inf:
            raise ValueError('--checkpoint-seconds: expected a number above 0, '
                             f'got {args.checkpoint_seconds}')
        if args.checkpoint_generations is not None and args.checkpoint_generations < 1:
            raise ValueError('--checkpoint-generations: expected an integer >= 1, '
                             f'got {args.checkpoint_generations}')
        result = _run(config_of(args), args)
    except OSError as error:
        print(f'evolve: {args.out}: cannot be written or read ({error.strerror or error}); put '
              'that right and give the same command again: it goes on from the last checkpoint',
              file=sys.stderr)
        return 2
    except ValueError as error:
        print(f'evolve: {" ".join(str(error).split())}', file=sys.stderr)
        return 2
    except MemoryError as error:
        print(f'evolve: the run does not fit into memory ({error}); ask for a smaller '
              '--population or fewer --generations, in another directory', file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(f'evolve: interrupted; the same command goes on from the last checkpoint in '
              f'{args.out}', file=sys.stderr)
        return 130
    print_result(result, args.out)
    return 0


def _run(config: RunConfig, args: argparse.Namespace) -> Any:
    from training.evolution.progress import progress_bar
    from training.evolution.run import run

    with progress_bar(config.generations, f'{config.body} seed {config.seed}') as shown:
        return run(config, args.out, shown, threads=args.threads,
                   checkpoint_s=args.checkpoint_seconds,
                   checkpoint_generations=args.checkpoint_generations,
                   say=lambda text: print(f'evolve: {text}', file=sys.stderr, flush=True))


def print_result(result: Any, directory: Path) -> None:
    """Print the champion under every word, and where it is."""
    from rich.console import Console
    from rich.table import Table

    table = Table(title=f'champion: fitness {result.fitness:.3f}')
    for column in ('word', 'asks for', 'in training', 'final x, m', 'final y, m', 'path, m'):
        table.add_column(column, justify='left' if column in ('word', 'asks for') else 'right')
    for word in result.outcomes:
        count = len(word.final_position_m)
        x, y = (sum(row[axis] for row in word.final_position_m) / count for axis in (0, 1))
        table.add_row(word.word, word.behaviour, 'yes' if word.trained else 'no', f'{x:+.3f}',
                      f'{y:+.3f}', f'{sum(word.path_length_m) / count:.3f}')
    console = Console()
    console.print(table)
    seconds = result.seconds
    share = seconds['engine'] / max(seconds['total'], 1e-9)
    console.print(f'{result.evaluations} evaluations in {seconds["total"]:.1f} s, '
                  f'{share:.0%} of it in the engine; controller file: {directory}/champion.json')
