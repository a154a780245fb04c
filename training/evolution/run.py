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
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from training import carried_body
from training.evolution import checkpoint, rundir, treatments
from training.evolution.afpo import Afpo
from training.evolution.champion import WordOutcome, outcomes, write_champion
from training.evolution.config import RunConfig
from training.evolution.engines import (
    TimedEvaluator,
    make_evaluator,
    needs_complete,
    refuse_unsupported,
)
from training.evolution.objectives import aggregate, scores
from training.evolution.operators import Layout, random_genomes
from training.evolution.rundir import RunConflictError, RunDirectory
from training.evolution.starts import slightly_different
from w2b_core import __version__, bodies
from w2b_core.network import Network
from w2b_core.vocabulary import Vocabulary
from w2b_sim.engines.interface import Evaluator, Start
from w2b_sim.worlds import WORLDS

__all__ = ['Progress', 'RunConfig', 'RunConflictError', 'RunResult', 'load_result', 'run']

Array = NDArray[np.float64]
HISTORY = ('best_fitness', 'median_fitness', 'best_age', 'survivors', 'evaluations')
CLOCKS = ('total', 'engine', 'evolution', 'checkpoint')
#: What helps where a finished run's results are damaged.
REMEDY = (f'delete {rundir.SUMMARY} beside it and start the run again: its results are written '
          'anew from the checkpoint')


@dataclass(frozen=True)
class Progress:
    """How far a run is; `seconds` and `evaluations` count from where this process took it up."""

    generation: int
    generations: int
    best_fitness: float
    evaluations: int
    seconds: float


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
    with RunDirectory(Path(directory), identity) as place:
        carried_body.keep(config.body, place.path)
        finished = place.path / rundir.SUMMARY
        if finished.exists() and _summary(finished)['generations'] == config.generations:
            return load_result(place.path)
        with closing(TimedEvaluator(evaluator or make_evaluator(
                config.engine, bodies.get(config.body), WORLDS[config.world],
                precision=config.precision, threads=threads, say=say,
                complete=needs_complete(behaviour for _word, behaviour in
                                        config.words + config.held_out)))) as engine:
            work = _Run(config, heard, engine, place)
            if work.afpo.generation and say is not None:
                say(f'goes on from generation {work.afpo.generation} of {config.generations}')
            if evaluator is None and config.engine == 'batched':
                work.prepare()
            work.evolve(progress, checkpoint_s, checkpoint_generations)
            work.finish()
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
    except controller_file.ControllerFileError as error:
        raise RunConflictError(f'{error}; {REMEDY}') from None
    except (KeyError, TypeError, ValueError) as error:
        raise _damaged(path / rundir.SUMMARY, error) from None


class _Run:
    """A run in memory."""

    def __init__(self, config: RunConfig, heard: Array, engine: TimedEvaluator,
                 place: RunDirectory) -> None:
        self.config, self.heard, self.engine, self.place = config, heard, engine, place
        self.behaviours = [behaviour for _word, behaviour in config.words]
        self.starts = (Start(),) if config.starts == 1 else slightly_different(
            treatments.generator(config.seed, treatments.STARTS), config.starts)
        self.layout = Layout.of(bodies.get(config.body))
        self.rng = treatments.generator(config.seed, treatments.EVOLUTION)
        self.afpo = Afpo(self.layout, self.rng, capacity=config.population)
        self.history = np.zeros((config.generations, len(HISTORY)))
        self.clocks = dict.fromkeys(CLOCKS, 0.0)
        state = place.resume(self.rng)
        if state is not None:
            self._restore(state)

    def _restore(self, state: dict[str, NDArray[Any]]) -> None:
        try:
            self.afpo.restore(state)
            done = self.afpo.generation
            self.history[:done] = state['history'][:done]
            self.clocks = dict(zip(CLOCKS, state['clocks'].tolist(), strict=True))
        except (KeyError, ValueError) as error:
            raise checkpoint.CheckpointError(
                f'{self.place.path / rundir.CHECKPOINT}: does not belong to this run ({error}); '
                'delete it to start again from the first generation') from None

    def prepare(self) -> None:
        """Let the engine compile or load its code now: that is not in the run's seconds."""
        genomes = random_genomes(np.random.default_rng(0), 1, self.layout)
        self.engine.prepare(self.layout.network(genomes), self.heard[:1], self.starts[:1])

    def evolve(self, progress: Callable[[Progress], None] | None, checkpoint_s: float,
               checkpoint_generations: int | None) -> None:
        """Run the generations that are left."""
        config, afpo = self.config, self.afpo
        began = mark = saved = perf_counter()
        saved_generation = afpo.generation
        while afpo.generation < config.generations:
            genomes = afpo.ask()
            in_engine = self.engine.seconds
            outcome = self.engine.evaluate(self.layout.network(genomes),
                                           self.heard[:len(config.words)], self.starts)
            earned = scores(outcome, self.behaviours, config.objective)
            afpo.tell(aggregate(earned, self.behaviours, config.aggregate))
            self._record(outcome.path_length_m.size)
            now = perf_counter()
            self.clocks['engine'] += self.engine.seconds - in_engine
            self.clocks['evolution'] += now - mark - (self.engine.seconds - in_engine)
            self.clocks['total'] += now - mark
            mark = now
            if (now - saved >= checkpoint_s or afpo.generation - saved_generation
                    == checkpoint_generations or afpo.generation == config.generations):
                self._save()
                saved, saved_generation = perf_counter(), afpo.generation
                self.clocks['checkpoint'] += saved - mark
                self.clocks['total'] += saved - mark
                mark = saved
            if progress is not None:
                progress(Progress(afpo.generation, config.generations,
                                  float(afpo.population.fitness[afpo.population.best]),
                                  self.engine.evaluations, mark - began))
                # Its time is not the run's: it may wait, as a study that is paused does.
                mark = perf_counter()

    def _record(self, evaluations: int) -> None:
        population, row = self.afpo.population, self.afpo.generation - 1
        self.history[row] = (population.fitness[population.best], np.median(population.fitness),
                             population.ages[population.best], len(population), evaluations)

    def _save(self) -> None:
        state = self.afpo.arrays()
        state['history'] = self.history[:self.afpo.generation]
        state['clocks'] = np.array([self.clocks[name] for name in CLOCKS])
        self.place.save(state, self.rng)

    def finish(self) -> None:
        """Judge the champion under every word and write what came of the run."""
        config, population = self.config, self.afpo.population
        best = population.best
        network = self.layout.network(population.genomes[best])
        judged = outcomes(self.engine, network, config.words, config.held_out, self.heard,
                          self.starts, config.objective)
        fitness = float(population.fitness[best])
        write_champion(self.place.path / rundir.CHAMPION, bodies.get(config.body),
                       WORLDS[config.world], network, judged, self.heard, {
                           **config.to_json(), 'fitness': fitness,
                           'program_version': __version__})
        _write_statistics(self.place.path / rundir.STATISTICS, self.history)
        # The last file: a run with a summary is over.
        checkpoint.write_json(self.place.path / rundir.SUMMARY, {
            'config': config.to_json(), 'generations': config.generations, 'fitness': fitness,
            'age': int(population.ages[best]), 'outcomes': [asdict(word) for word in judged],
            'evaluations': int(self.history[:, HISTORY.index('evaluations')].sum()),
            'seconds': self.clocks, 'program_version': __version__})


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
