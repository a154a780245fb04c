"""
A whole training: seeds side by side, stage by stage, the best go on; a champion comes out.

The directory holds `recipe.json` (what is run), `seeds/N/history.npz` (what each seed's candidates
earned), `stages/NAME.json` (how the seeds did, which go on and why others do not), `champion.npz`
and `champion.json`. It is safe to kill at any moment, and goes on where it was.
"""

from __future__ import annotations

import json
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from io import BytesIO
from pathlib import Path
from time import perf_counter, sleep
from typing import Any

import numpy as np
from numpy.typing import NDArray

from training import carried_body
from training.evolution.checkpoint import write_atomically, write_json
from training.evolution.rundir import RunDirectory
from training.legs.examine import examine, reason_to_drop
from training.legs.recipe import Recipe
from training.legs.search import Search, Step
from training.legs.task import Task
from w2b_core import __version__, bodies
from w2b_core.network.leaky import BLOCKS, LeakyNetwork

Array = NDArray[np.float64]

#: One thread a process: seeds run side by side. Set before numpy's libraries are loaded.
SINGLE_THREADED = dict.fromkeys(('OPENBLAS_NUM_THREADS', 'OMP_NUM_THREADS',
                                 'MKL_NUM_THREADS'), '1')


class NoChampionError(RuntimeError):
    """No seed was fit to go on; the message says why each was dropped."""


@dataclass(frozen=True)
class Champion:
    """The best seed's network, its genome (G,) and its examination."""

    seed: int
    genome: Array
    network: LeakyNetwork
    report: dict[str, Any]


def train(recipe: Recipe, directory: Path, *, workers: int,
          report: Callable[[str], None] = print) -> Champion:
    """
    Train a recipe's legs in `directory`, or go on there.

    Raises
    ------
    RunConflictError, CheckpointError
        If the directory belongs to another run or cannot be used.
    NoChampionError
        If every seed was dropped.

    """
    identity = {'config': recipe.model_dump(mode='json'), **carried_body.identity(recipe.body),
                'program_version': __version__}
    with RunDirectory(directory, identity, may_grow=()):
        # What is trained stays the same though its file be edited.
        given = recipe
        recipe = given.model_copy(update={'body': carried_body.keep(given.body, directory)})
        began = perf_counter()
        seeds = list(range(recipe.seeds))
        task = Task(recipe)
        task.compile()
        with _Workers(recipe, directory, workers, report) as pool:
            for number, stage in enumerate(recipe.stages):
                path = directory / 'stages' / f'{stage.name}.json'
                if path.exists():
                    seeds = json.loads(path.read_text(encoding='utf-8'))['kept']
                    continue
                reports = pool.run(seeds, number)
                seeds = _choose(recipe, number, reports, path, report)
            seed = seeds[0]
            final = directory / 'stages' / f'{recipe.stages[-1].name}.json'
            last = json.loads(final.read_text(encoding='utf-8'))['seeds'][str(seed)]
        search = Search(recipe, seed, directory / 'seeds' / str(seed), task)
        search.run(len(recipe.stages) - 1)
        champion = Champion(seed, search.genome, task.sharing.network(search.genome), last)
        _write(directory, given, champion, perf_counter() - began)
        return champion


def _choose(recipe: Recipe, number: int, reports: dict[int, dict[str, Any]], path: Path,
            report: Callable[[str], None]) -> list[int]:
    """Write how the seeds did, and return those that go on, best first."""
    stage = recipe.stages[number]
    dropped = {seed: reason for seed, found in reports.items()
               if (reason := reason_to_drop(found, recipe, recipe.drop)) is not None}
    ranked = sorted((seed for seed in reports if seed not in dropped),
                    key=lambda seed: -reports[seed]['fitness'])
    kept = ranked[:stage.keep]
    for seed in ranked[stage.keep:]:
        dropped[seed] = f'is not among the best {stage.keep}'
    path.parent.mkdir(parents=True, exist_ok=True)
    for seed in sorted(reports, key=lambda seed: -reports[seed]['fitness']):
        state = f'dropped: {dropped[seed]}' if seed in dropped else 'goes on'
        report(f'stage {stage.name}: seed {seed} fitness {reports[seed]["fitness"]:.3f}, {state}')
    if not kept:
        raise NoChampionError(
            f'stage {stage.name}: no seed of {len(reports)} may go on: '
            + '; '.join(f'seed {seed} {why}' for seed, why in sorted(dropped.items()))
            + '; try another --seed, more --seeds, or other aims')
    write_json(path, {'kept': kept, 'dropped': {str(seed): why for seed, why in dropped.items()},
                      'seeds': {str(seed): found for seed, found in reports.items()}})
    return kept


def _write(directory: Path, recipe: Recipe, champion: Champion, seconds: float) -> None:
    buffer = BytesIO()
    np.savez(buffer, genome=champion.genome, **{
        block.name: getattr(champion.network, block.name) for block in BLOCKS})
    write_atomically(directory / 'champion.npz', buffer.getvalue())
    write_json(directory / 'champion.json', {
        'recipe': recipe.name, 'recipe_sha256': recipe.sha256(), 'seed': champion.seed,
        'base_seed': recipe.seed, 'body': bodies.get(recipe.body).name,
        'behaviours': list(recipe.behaviours), 'senses': list(recipe.senses),
        'examination': champion.report,
        'seconds_of_last_call': round(seconds, 1), 'program_version': __version__})


class _Workers:
    """Processes that run seeds, one thread each; they end with this process, however it ends."""

    def __init__(self, recipe: Recipe, directory: Path, count: int,
                 report: Callable[[str], None]) -> None:
        self._recipe, self._directory, self._report = recipe, directory, report
        self._context = multiprocessing.get_context('spawn')
        self._count = count

    def __enter__(self) -> _Workers:
        before = {name: os.environ.get(name) for name in SINGLE_THREADED}
        os.environ.update(SINGLE_THREADED)
        self._queue = self._context.Queue()
        self._pool = ProcessPoolExecutor(self._count, self._context, _start,
                                         (os.getpid(), self._recipe, self._queue))
        self._before = before
        return self

    def __exit__(self, *_error: object) -> None:
        self._pool.shutdown(wait=True, cancel_futures=True)
        for name, value in self._before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value

    def run(self, seeds: list[int], stage: int) -> dict[int, dict[str, Any]]:
        """Return each seed's examination after a stage; report on the way."""
        futures = {seed: self._pool.submit(_run_seed, seed, stage,
                                           str(self._directory / 'seeds' / str(seed)))
                   for seed in seeds}
        waiting = set(seeds)
        while waiting:
            self._tell(1.0)
            for seed in [seed for seed in waiting if futures[seed].done()]:
                futures[seed].result()
                waiting.discard(seed)
        self._tell(0.0)
        return {seed: future.result() for seed, future in futures.items()}

    def _tell(self, wait_s: float) -> None:
        from queue import Empty

        try:
            while True:
                self._report(line_of(Step(**self._queue.get(timeout=wait_s))))
                wait_s = 0.01
        except Empty:
            return


def line_of(step: Step) -> str:
    """Return a line of progress: what each behaviour earns."""
    rate = step.evaluations / step.seconds if step.seconds > 0 else 0.0
    scores = '  '.join(f'{name} {score:.2f}' for name, score in step.scores.items())
    return (f'seed {step.seed}  {step.stage} {step.generation}/{step.generations}  '
            f'fitness {step.best:.3f}  {scores}  step {step.sigma:.3f}  {rate:.0f} evaluations/s')


_HELD: list[Any] = []


def _start(parent: int, recipe: Recipe, queue: Any) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    _HELD[:] = [Task(recipe), queue]


def _end_with(parent: int) -> None:
    """End this process when its parent is gone: a killed one cannot say so."""
    while os.getppid() == parent:
        sleep(1.0)
    os._exit(1)


def _run_seed(seed: int, stage: int, directory: str) -> dict[str, Any]:
    task, queue = _HELD
    recipe = task.recipe
    task.evaluations = 0
    search = Search(recipe, seed, Path(directory), task)
    search.run(stage, lambda step: queue.put(asdict(step)))
    return examine(task, search.genome, recipe.stages[stage].physics_steps)
