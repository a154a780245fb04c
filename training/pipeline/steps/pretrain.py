"""Pretrain: hidden weights that sort the trained words, for each seed's newcomers to begin with."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from training.evolution import checkpoint
from training.evolution.operators import Layout
from training.evolution.rundir import CHECKPOINT, CONFIG, RunConflictError
from training.evolution.treatments import GATE, generator
from training.pipeline.bench import Bench
from training.pipeline.candidates import Candidate
from training.pipeline.parts import Pretrain
from training.pipeline.steps.evolve import directory_of
from training.robust import screening
from training.robust.search import LISTENERS


def run(part: Pretrain, bench: Bench, _candidates: Sequence[Candidate],
        directory: Path) -> list[Candidate]:
    """
    Return a candidate without a network for each seed; its directory holds hidden weights.

    Raises
    ------
    RunConflictError
        If a seed's evolution began from other ones: of other words, runs or ways to choose them.

    """
    recipe = bench.recipe
    words = screening.WordsToSort(recipe.words.trained, recipe.words.validation, bench.vectors,
                              recipe.training.move_noise, part.screening)
    weights, _screen = screening.find(directory / part.name, words, Layout.of(bench.body),
                                      part.runs, part.plan, bench.say)
    for seed in recipe.seeds:
        chosen = weights
        if part.of_a_run is not None:
            drawn = generator(seed, GATE).choice(
                len(weights), min(part.of_a_run, len(weights)), replace=False)
            chosen = weights[np.sort(drawn)]
        _keep(directory_of(directory, seed), chosen)
    return [Candidate(seed) for seed in recipe.seeds]


def _keep(directory: Path, weights: NDArray[np.float64]) -> None:
    """Keep what a seed's newcomers begin with; as it is, where its evolution is under way."""
    path = directory / LISTENERS
    if path.exists():
        found = np.load(path, allow_pickle=False)
        if np.array_equal(found, weights):
            return
        if any((directory / name).exists() for name in (CONFIG, CHECKPOINT)):
            raise RunConflictError(
                f'{directory}: its evolution began from {len(found)} other hidden layers than the '
                f'{len(weights)} that pretraining (runs, plan, screening, words) gives; repeat '
                'what it was begun with, or choose another directory')
    directory.mkdir(parents=True, exist_ok=True)
    checkpoint.save_array(path, weights)
