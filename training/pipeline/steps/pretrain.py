"""Pretrain: hidden weights that sort the trained words, for each seed's newcomers to begin with."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from training.evolution import checkpoint
from training.evolution.operators import Layout
from training.evolution.treatments import GATE, generator
from training.pipeline.bench import Bench
from training.pipeline.candidates import Candidate
from training.pipeline.parts import Pretrain
from training.pipeline.steps.evolve import directory_of
from training.robust import screening
from training.robust.search import LISTENERS


def run(part: Pretrain, bench: Bench, _candidates: Sequence[Candidate],
        directory: Path) -> list[Candidate]:
    """Return a candidate without a network for each seed; its directory holds hidden weights."""
    recipe = bench.recipe
    words = screening.Sorting(recipe.words.trained, recipe.words.validation, bench.vectors,
                              recipe.training.move_noise, part.screening)
    weights, _screen = screening.find(directory / part.name, words, Layout.of(bench.body),
                                      part.runs, part.plan, bench.say)
    for seed in recipe.seeds:
        path = directory_of(directory, seed) / LISTENERS
        if path.exists():
            continue
        chosen = weights
        if part.of_a_run is not None:
            drawn = generator(seed, GATE).choice(
                len(weights), min(part.of_a_run, len(weights)), replace=False)
            chosen = weights[np.sort(drawn)]
        path.parent.mkdir(parents=True, exist_ok=True)
        checkpoint.save_array(path, chosen)
    return [Candidate(seed) for seed in recipe.seeds]
