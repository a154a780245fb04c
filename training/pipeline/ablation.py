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
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from training.evolution import checkpoint
from training.evolution.operators import Array, Layout
from training.evolution.treatments import Words
from training.pipeline import trials
from training.pipeline.ablation_table import to_markdown
from training.pipeline.candidates import population
from training.pipeline.command import parse_seeds
from training.pipeline.recipe import RECIPES, Recipe, load_recipe
from training.pipeline.table import Row, from_json, to_json, worst_margin
from training.robust import screening
from training.robust.config import RobustConfig
from training.robust.drawn import DrawnWorlds
from training.robust.scenarios import by_direction
from training.robust.search import LISTENERS, train
from training.robust.settings import Randomisation, Stage
from w2b_core import bodies
from w2b_core.network import Network

#: Whose words, bounds and training are taken.
RECIPE = RECIPES / 'quadruped.yaml'
#: What PyBullet is asked, beside the two moves.
STOPS = frozenset(['stop', 'cease', 'stopped', 'terminate'])
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
    recipe = _recipe()
    vectors = {word: vocabulary.vector(word) for word, _behaviour in recipe.words.known}
    words = screening.WordsToSort(recipe.words.trained, recipe.words.validation, vectors,
                                  recipe.training.move_noise, recipe.pretrain.screening)
    heard, _screen = screening.find(
        args.out / 'ears', words,
        Layout.of(bodies.get(recipe.body)), args.ears, recipe.pretrain.plan,
        say=lambda text: print(text, file=sys.stderr))
    rows: list[dict[str, Any]] = []
    chosen: list[dict[str, Any]] = []
    for treatment in ROWS:
        runs = [_run(args, treatment, seed, heard, vectors) for seed in parse_seeds(args.seeds)]
        rows.append({'row': treatment.name, 'runs': runs})
        if treatment.name == ALL:
            chosen = [{'row': f'all means, of every {GATED_RUNS} runs the best by the gate',
                       'runs': _gated(runs)}]
        checkpoint.write_json(args.out / 'ablation.json', {
            'body': recipe.body, 'generations': args.generations, 'starts': args.starts,
            'table': rows + chosen})
        checkpoint.write_atomically(args.out / 'ablation.md',
                                    to_markdown(rows + chosen).encode())
        print(to_markdown(rows[-1:]).splitlines()[-1], file=sys.stderr, flush=True)
    return to_markdown(rows + chosen)


def _gated(runs: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return of every `GATED_RUNS` runs the one that the gate prefers."""
    return [max(runs[first:first + GATED_RUNS],
                key=lambda run: worst_margin(from_json(run['choice']), _recipe().move_m))
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
    checkpoint.save_array(directory / LISTENERS, heard)
    config = config_of(treatment, seed, args.generations)
    networks, fitness = train(config, directory, threads=args.threads, vectors=vectors)
    network = population(seed, networks, fitness)[0].controller
    found = {'seed': seed, 'fitness': float(fitness[0]),
             'drawn_fitness': _examined(config, network, vectors, args.threads),
             'rows': to_json(_judge(network, vectors, args, JUDGE)),
             'choice': to_json(_judge(network, vectors, args, CHOICE))
             if treatment.name == ALL else []}
    checkpoint.write_json(kept, found)
    return found


def _examined(config: RobustConfig, network: Network, vectors: Mapping[str, Array],
              threads: int) -> float:
    """Return the default fitness in a draw with every means, the same for all rows of a seed."""
    same = replace(config, aggregate='balanced', randomisation=Randomisation(),
                   stages=(replace(config.stages[-1], clip_m=CLIP_M),))
    task = DrawnWorlds(same, by_direction(same.words, vectors), threads)
    genome = task.layout.genome(network)
    return float(task.examine(genome[None], same.randomisation)[0])


def config_of(treatment: Treatment, seed: int, generations: int) -> RobustConfig:
    """Return the run of a row's seed."""
    vectors = 'vectors' in treatment.means
    walk = Stage(generations, 6, 6, 15, False, treatment.clip_m, vectors=vectors,
                 stray_weight=3.0, free_stray_m=0.02)
    feel = replace(walk, generations=generations // 3, stops=9, touch=True)
    return replace(_recipe().config(seed), randomisation=Randomisation.only(*treatment.means),
                   aggregate=treatment.aggregate,
                   stages=(walk, feel) if treatment.touch else (walk,))


def _judge(network: Network, vectors: Mapping[str, Array], args: argparse.Namespace,
           seed: int) -> tuple[Row, ...]:
    recipe = _recipe()
    return trials.trial(network, bodies.get(recipe.body), recipe.world,
                        recipe.words.moves + _stops(recipe.words.trained), (), vectors,
                        move_m=recipe.move_m, starts=args.starts, seed=seed,
                        processes=args.threads, validation=_stops(recipe.words.validation))


def _stops(words: Words) -> Words:
    return tuple(pair for pair in words if pair[0] in STOPS)


@cache
def _recipe() -> Recipe:
    return load_recipe(RECIPE)
