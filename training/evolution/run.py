"""
One evolutionary run: resumable at any moment, and the same champion for the same configuration.

One generation is one batch of evaluations. The directory holds config.json (what the run is),
checkpoint.npz (all that is needed to go on), and when the run is over champion.json (a controller
file), statistics.npz (per generation) and summary.json (champion under every word, times).
"""

from __future__ import annotations

import json
import zipfile
import zlib
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import asdict, dataclass
from io import BytesIO
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from training import carried_body
from training.evolution import checkpoint, rundir, treatments
from training.evolution.champion import WordOutcome, outcomes, write_champion
from training.evolution.config import RunConfig
from training.evolution.engines import (
    TimedEvaluator,
    make_evaluator,
    needs_complete,
    refuse_unsupported,
)
from training.evolution.exact import Exact
from training.evolution.loop import CLOCKS, HISTORY, Loop, Progress
from training.evolution.operators import Array, Layout
from training.evolution.optimisers import Optimiser, make_optimiser
from training.evolution.rundir import RunConflictError, RunDirectory
from training.evolution.starts import slightly_different
from w2b_core import __version__, bodies
from w2b_core.bodies.model import Body
from w2b_core.network import Network
from w2b_core.vocabulary import Vocabulary
from w2b_sim.engines.interface import Evaluator, Start
from w2b_sim.worlds import WORLDS

__all__ = ['CLOCKS', 'HISTORY', 'Progress', 'RunConfig', 'RunConflictError', 'RunResult',
           'load_result', 'run']

#: What helps where a finished run's results are damaged.
REMEDY = (f'delete {rundir.SUMMARY} beside it and start the run again: its results are written '
          'anew from the checkpoint')


@dataclass(frozen=True)
class RunResult:
    """
    What came of a run.

    Attributes
    ----------
    config
        What was run.
    network
        The champion: the fittest of the last population.
    fitness
        The champion's.
    outcomes
        The champion under every trained word, then under every held-out one.
    history
        Name of `HISTORY` -> array (generations,).
    evaluations
        Simulations in the whole run.
    seconds
        Wall time of the whole run, without compiling, by what it went into: a name of `CLOCKS`
        -> s.

    """

    config: RunConfig
    network: Network
    fitness: float
    outcomes: tuple[WordOutcome, ...]
    history: dict[str, Array]
    evaluations: int
    seconds: dict[str, float]


def run(config: RunConfig, directory: Path | str,
        progress: Callable[[Progress], None] | None = None, *, threads: int = 1,
        checkpoint_s: float = 10.0, checkpoint_generations: int | None = None,
        vectors: Mapping[str, ArrayLike] | None = None,
        evaluator: Evaluator | None = None, program: Mapping[str, str] | None = None,
        say: Callable[[str], None] | None = None) -> RunResult:
    """
    Run `config` in `directory`, or go on with it there, to its end.

    Parameters
    ----------
    config
        What to run. A directory that holds a run of fewer generations is taken further.
    directory
        Its own; made if missing.
    progress
        Called after every generation.
    threads
        Given to the engine; changes no result.
    checkpoint_s, checkpoint_generations
        A checkpoint is written when this many seconds, or generations, have gone by since the last.
    vectors
        Word -> vector (T,); the configuration's vocabulary if not given.
    evaluator
        Instead of the configuration's engine, of the same body and world.
    program
        What identifies the program, noted in config.json: another is refused there. Its version if
        not given.
    say
        Is told from which generation a run goes on, and that the engine is being compiled.

    Raises
    ------
    RunConflictError
        If the directory holds another run, or another process is working in it.
    CheckpointError
        If the checkpoint is damaged.
    ValueError
        If a word is not in the vocabulary, two words are one there, or the engine does not model
        the body.

    """
    if vectors is None:
        vocabulary = Vocabulary.load(config.vocabulary)
        config = config.spelt(vocabulary.known)
        vectors = {word: vocabulary.vector(word)
                   for word, _behaviour in config.words + config.held_out}
    names = [word for word, _behaviour in config.words + config.held_out]
    heard = treatments.treated(vectors, names, config.treatment, config.seed)
    identity = {'config': config.to_json(), **carried_body.identity(config.body),
                **(program or {'program_version': __version__}),
                'vectors': {name: treatments.vector_hash(vector)
                            for name, vector in zip(names, heard, strict=True)}}
    if evaluator is None:
        refuse_unsupported(config.engine, config.body)
    # What cannot be used is refused before anything is written.
    _start(config, Layout.of(bodies.get(config.body)), np.random.default_rng(0))
    with RunDirectory(Path(directory), identity) as place:
        # What is trained stays the same though its file be edited.
        body = bodies.get(carried_body.keep(config.body, place.path))
        finished = place.path / rundir.SUMMARY
        if finished.exists() and _summary(finished)['generations'] == config.generations:
            return load_result(place.path)
        with closing(TimedEvaluator(evaluator or make_evaluator(
                config.engine, body, WORLDS[config.world],
                precision=config.precision, threads=threads, say=say,
                complete=needs_complete(behaviour for _word, behaviour in
                                        config.words + config.held_out)))) as engine:
            loop = _evolve(config, body, heard, engine, place,
                           evaluator is None and config.engine == 'batched', say)
            loop.run(config.generations, progress, checkpoint_s=checkpoint_s,
                     checkpoint_generations=checkpoint_generations)
            _finish(config, body, heard, loop, place)
        return load_result(place.path)


def load_result(directory: Path | str) -> RunResult:
    """Return what came of the finished run in `directory` (RunConflictError if it is not over)."""
    path = Path(directory)
    from w2b_core.controller import file as controller_file

    if not (path / rundir.SUMMARY).exists():
        raise RunConflictError(f'{path}: holds no finished run; start it again to go on with it')
    summary = _summary(path / rundir.SUMMARY)
    try:
        with np.load(path / rundir.STATISTICS, allow_pickle=False) as file:
            history = {name: np.array(file[name], dtype=np.float64) for name in HISTORY}
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise _damaged(path / rundir.STATISTICS, error) from None
    try:
        return RunResult(
            RunConfig.from_json(summary['config']),
            controller_file.load(path / rundir.CHAMPION).serial, summary['fitness'],
            tuple(WordOutcome.from_json(value) for value in summary['outcomes']), history,
            summary['evaluations'], summary['seconds'])
    except controller_file.JsonFileError as error:
        raise RunConflictError(f'{error}; {REMEDY}') from None
    except (KeyError, TypeError, ValueError) as error:
        raise _damaged(path / rundir.SUMMARY, error) from None


def _start(config: RunConfig, layout: Layout, rng: np.random.Generator) -> Optimiser:
    return make_optimiser(config.optimiser, layout, rng, capacity=config.population)


def _evolve(config: RunConfig, body: Body, heard: Array, engine: TimedEvaluator,
            place: RunDirectory, prepare: bool, say: Callable[[str], None] | None) -> Loop:
    """Return the loop of a run, where it was left; `prepare`: let the engine compile first."""
    starts = (Start(),) if config.starts == 1 else slightly_different(
        treatments.generator(config.seed, treatments.STARTS), config.starts)
    layout = Layout.of(body)
    rng = treatments.generator(config.seed, treatments.EVOLUTION)
    task = Exact(layout, engine, heard[:len(config.words)],
                 [behaviour for _word, behaviour in config.words], starts, config.objective,
                 config.aggregate)
    loop = Loop(_start(config, layout, rng), task, rng, place)
    loop.reserve(config.generations)
    if loop.optimiser.generation and say is not None:
        say(f'goes on from generation {loop.optimiser.generation} of {config.generations}')
    if prepare:
        task.prepare()
    return loop


def _finish(config: RunConfig, body: Body, heard: Array, loop: Loop, place: RunDirectory) -> None:
    """Judge the champion under every word and write what came of the run."""
    task, population = cast(Exact, loop.task), loop.optimiser.population
    best = population.best
    network = task.layout.network(population.genomes[best])
    judged = outcomes(task.engine, network, config.words, config.held_out, heard, task.starts,
                      config.objective)
    fitness = float(population.fitness[best])
    write_champion(place.path / rundir.CHAMPION, body, WORLDS[config.world], network, judged, heard,
                   {**config.to_json(), 'fitness': fitness, 'program_version': __version__})
    _write_statistics(place.path / rundir.STATISTICS, loop.history)
    # The last file: a run with a summary is over.
    checkpoint.write_json(place.path / rundir.SUMMARY, {
        'config': config.to_json(), 'generations': config.generations, 'fitness': fitness,
        'age': int(population.ages[best]), 'outcomes': [asdict(word) for word in judged],
        'evaluations': int(loop.history[:, HISTORY.index('evaluations')].sum()),
        'seconds': loop.clocks, 'program_version': __version__})


def _write_statistics(path: Path, history: Array) -> None:
    buffer = BytesIO()
    np.savez_compressed(buffer, **{  # type: ignore[arg-type]
        name: history[:, column] for column, name in enumerate(HISTORY)})
    checkpoint.write_atomically(path, buffer.getvalue())


def _summary(path: Path) -> dict[str, Any]:
    try:
        summary: dict[str, Any] = json.loads(path.read_text(encoding='utf-8'))
        if not isinstance(summary['generations'], int):
            raise TypeError('generations: expected an integer')
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise _damaged(path, error) from None
    return summary


def _damaged(path: Path, error: Exception) -> RunConflictError:
    return RunConflictError(f'{path}: damaged ({checkpoint.reason(error)}); {REMEDY}')
