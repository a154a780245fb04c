"""Choose: order the candidates by what they do under trained and validation words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from training.pipeline.bench import Bench
from training.pipeline.candidates import Candidate, by_seed
from training.pipeline.parts import Choose
from training.pipeline.table import in_short, passes, shorter_way


def run(part: Choose, bench: Bench, candidates: Sequence[Candidate],
        directory: Path) -> list[Candidate]:
    """Return the candidates, best first, with their tables."""
    roles, tried = bench.recipe.words, []
    with bench.trials(directory, part.starts, part.seed) as trial:
        for one in (one for group in by_seed(candidates).values() for one in group[:part.best]):
            table = trial(one.controller, roles.trained, roles.validation)
            tried.append(replace(one, table=table))
            bench.say(f'{part.name}, {one}: fitness {one.fitness:.2f}, '
                      f'{sum(row.passed for row in table)} of {len(table)} words, '
                      f'{in_short(table)}')
    ordered = sorted(tried, key=order)
    return [one for one in ordered if passes(one.table) or not part.require][:part.keep]


def order(candidate: Candidate) -> tuple[float, float]:
    """Return what candidates are sorted by: words obeyed, then the shorter of the two ways."""
    return -sum(row.passed for row in candidate.table), -shorter_way(candidate.table)
