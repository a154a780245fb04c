"""What a champion leaves behind: its controller file, its tables, and how it came to be."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from training.evolution import checkpoint
from training.evolution.champion import WordOutcome, write_champion
from training.robust import blind, gate
from training.robust.config import RobustConfig
from training.robust.word_roles import WordRoles
from w2b_core import __version__, bodies
from w2b_core.network import Network
from w2b_core.vocabulary import Vocabulary
from w2b_sim.worlds import WORLDS


@dataclass(frozen=True)
class Champion:
    """A controller, its fitness in training, its final table and how many were asked before it."""

    config: RobustConfig
    network: Network
    fitness: float
    table: tuple[gate.Row, ...]
    opened: int
    later: tuple[gate.Later, ...]


def write(directory: Path, champion: Champion, roles: WordRoles, words: Vocabulary,
          more: Mapping[str, Any] | None = None) -> None:
    """Write champion.json (a controller file), table.json (with `more`) and champion.md."""
    config, table = champion.config, champion.table
    rows = gate.to_json(table)
    judged = [WordOutcome(row.word, row.behaviour, row.trained, gate.score(row), (), (), ())
              for row in table]
    record: dict[str, Any] = {
        'mode': 'robust', 'engine': 'batched', 'precision': 'float32', 'world': config.world,
        'objective': 'robust', 'seed': config.seed, 'fitness': champion.fitness,
        'program_version': __version__,
        'words': {role: [list(pair) for pair in pairs] for role, pairs in asdict(roles).items()},
        'opened': champion.opened, 'weights_sha256': blind.weights_sha256(champion.network),
        'config': config.to_json(),
        'gate': {'engine': 'pybullet', 'starts': gate.STARTS, 'rows': rows}}
    heard = np.array([words.vector(row.word) for row in table])
    write_champion(directory / 'champion.json', bodies.get(config.body), WORLDS[config.world],
                   champion.network, judged, heard, record)
    checkpoint.write_json(directory / 'table.json', {
        'body': config.body, 'world': config.world, 'seed': config.seed, 'starts': gate.STARTS,
        'opened': champion.opened, 'passed': gate.passes(table), 'rows': rows,
        'later': [asdict(place) for place in champion.later], **(more or {})})
    checkpoint.write_atomically(directory / 'champion.md', (
        gate.to_markdown(table) + _told(champion.later)).encode())


def _told(places: tuple[gate.Later, ...]) -> str:
    """Return a line on where the champion is later, to follow its table."""
    return ''.join(
        f'\n{place.seconds:.0f} s after *{place.word}*: x {place.median_x_m:+.2f} m, '
        f'y {place.median_y_m:+.2f} m (medians of {gate.LATER_STARTS} starts).\n'
        for place in places)
