"""Gate: trials in an independent engine, after which the best go on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from training.pipeline.bench import Bench
from training.pipeline.candidates import Candidate, by_seed
from training.pipeline.parts import Gate
from training.pipeline.table import in_short, shorter_way, worst_margin


def run(part: Gate, bench: Bench, candidates: Sequence[Candidate],
        directory: Path) -> list[Candidate]:
    """Return those that go on, best first, with their tables."""
    roles, move_m = bench.recipe.words, bench.recipe.move_m
    words = roles.moves if part.words == 'moves' else roles.trained

    def merit(candidate: Candidate) -> float:
        return (worst_margin(candidate.table, move_m) if part.rank == 'margin'
                else shorter_way(candidate.table))

    tried: dict[int, list[Candidate]] = {}
    with bench.trials(directory, part.starts, part.seed) as trial:
        for seed, of_seed in by_seed(candidates).items():
            tried[seed] = [replace(one, table=trial(one.controller, words, ()))
                           for one in of_seed[:part.best]]
    groups = list(tried.values()) if part.of == 'seed' else [
        [one for of_seed in tried.values() for one in of_seed]]
    chosen = [one for group in groups
              for one in sorted(group, key=lambda one: -merit(one))[:part.keep]]
    for group in groups:
        for one in group:
            bench.say(f'{part.name}, {one}: fitness {one.fitness:.2f}, {in_short(one.table)}'
                      + (', goes on' if one in chosen else ''))
    return chosen
