"""A search in drawn worlds: the loop of evolution at the task `drawn.DrawnWorlds`, by stages."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from training.evolution import treatments
from training.evolution.checkpoint import save_array
from training.evolution.loop import Loop, Progress
from training.evolution.operators import Array, mutate_mixed, random_genomes
from training.evolution.optimisers import Newcomers, make_optimiser
from training.evolution.rundir import RunDirectory
from training.robust.careful import careful_mutation
from training.robust.config import RobustConfig
from training.robust.drawn import DrawnWorlds
from training.robust.pretraining import listen, newcomers
from training.robust.scenarios import by_direction
from w2b_core import __version__
from w2b_core.network import Network

#: File in a run's directory: pretrained hidden weights (N, H, H + 1) that newcomers start from.
LISTENERS = 'listeners.npy'


def train(config: RobustConfig, directory: Path | str,
          progress: Callable[[Progress], None] | None = None, *, threads: int = 1,
          checkpoint_s: float = 10.0, vectors: Mapping[str, ArrayLike] | None = None,
          stages: int | None = None) -> tuple[Network, Array]:
    """
    Run `config` in `directory`, or go on with it there, for all or the first `stages` stages.

    Returns the population's networks (N, ...) and fitness (N,) in a last, larger draw of
    situations, best first.

    Raises
    ------
    RunConflictError, CheckpointError, ValueError
        As `training.evolution.run.run`.

    """
    if vectors is None:
        from w2b_core.vocabulary import Vocabulary

        vocabulary = Vocabulary.load(config.vocabulary)
        vectors = {word: vocabulary.vector(word) for word, _behaviour in config.words}
    heard = by_direction(config.words, vectors)
    identity = {'config': config.to_json(), 'program_version': __version__,
                'vectors': {word: treatments.vector_hash(vectors[word])
                            for word, _behaviour in config.words}}
    with RunDirectory(Path(directory), identity, may_grow=()) as place:
        task = DrawnWorlds(config, heard, threads)
        rng = treatments.generator(config.seed, treatments.EVOLUTION)
        optimiser = make_optimiser(
            config.optimiser, task.layout, rng, capacity=config.population,
            mutation=mutate_mixed if config.careful is None else careful_mutation(
                config.careful, heard, task.layout.hidden_count),
            newcomers=_newcomers(task, place))
        loop = Loop(optimiser, task, rng, place)
        loop.run(sum(stage.generations for stage in config.stages[:stages]), progress,
                 checkpoint_s=checkpoint_s)
        return task.ranked(optimiser.population.genomes)


def _newcomers(task: DrawnWorlds, place: RunDirectory) -> Newcomers:
    """Return what draws genomes of no parents: from pretrained hidden weights, if there are any."""
    config, path = task.config, place.path / LISTENERS
    if not path.exists():
        if not config.pretraining.attempts:
            return random_genomes
        save_array(path, listen(task.layout, config.pretraining, config.seed,
                                lambda rng, moves, stops: task.draw(
                                    rng, config.randomisation, moves, stops)))
    listeners: Array = np.load(path, allow_pickle=False)
    return newcomers(listeners)
