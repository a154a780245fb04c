"""What a champion leaves behind: its controller file, its tables, and how it was made."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from training.evolution import checkpoint
from training.evolution.champion import WordOutcome, write_champion
from training.pipeline.candidates import Candidate
from training.pipeline.recipe import Recipe
from training.pipeline.table import Row, passes, score, to_json, to_markdown
from training.pipeline.trials import Later, weights_sha256
from w2b_core import __version__, bodies
from w2b_core.vocabulary import Vocabulary


@dataclass(frozen=True)
class Champion:
    """A candidate, its final table, how many were opened up to it, and where it is much later."""

    recipe: Recipe
    candidate: Candidate
    table: tuple[Row, ...]
    opened: int
    later: tuple[Later, ...]


def write(directory: Path, champion: Champion, words: Vocabulary, more: Mapping[str, Any]) -> None:
    """Write champion.json (a controller file), table.json (with `more`) and champion.md."""
    recipe, candidate, table = champion.recipe, champion.candidate, champion.table
    config = recipe.config(candidate.seed)
    starts, rows = recipe.examine.starts, to_json(table)
    judged = [WordOutcome(row.word, row.behaviour, row.trained, score(row), (), (), ())
              for row in table]
    record: dict[str, Any] = {
        'mode': 'robust', 'recipe': recipe.name, 'engine': 'batched', 'precision': 'float32',
        'world': config.world, 'objective': 'robust', 'seed': candidate.seed,
        'fitness': candidate.fitness, 'program_version': __version__,
        'words': recipe.words.model_dump(mode='json'),
        'opened': champion.opened, 'weights_sha256': weights_sha256(candidate.controller),
        'config': config.to_json(),
        'gate': {'engine': 'pybullet', 'starts': starts, 'rows': rows}}
    heard = np.array([words.vector(row.word) for row in table])
    write_champion(directory / 'champion.json', bodies.get(config.body), recipe.world,
                   candidate.controller, judged, heard, record)
    checkpoint.write_json(directory / 'table.json', {
        'body': config.body, 'world': config.world, 'seed': candidate.seed, 'starts': starts,
        'opened': champion.opened, 'passed': passes(table), 'rows': rows,
        'later': [asdict(place) for place in champion.later], **more})
    checkpoint.write_atomically(directory / 'champion.md', (
        to_markdown(table) + _described(champion)).encode())


def _described(champion: Champion) -> str:
    """Return a line on where the champion is later, to follow its table."""
    return ''.join(
        f'\n{place.seconds:.0f} s after *{place.word}*: x {place.median_x_m:+.2f} m, '
        f'y {place.median_y_m:+.2f} m (medians of {champion.recipe.examine.later_starts} starts).\n'
        for place in champion.later)
