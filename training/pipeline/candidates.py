"""Candidates: what one step of a pipeline hands to the next, and how it is kept in a file."""

from __future__ import annotations

import json
import zipfile
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from io import BytesIO
from math import nan
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from training.evolution.checkpoint import CheckpointError, reason, write_atomically
from training.pipeline.table import Row, from_json, to_json
from w2b_core.network import Network


@dataclass(frozen=True, eq=False)
class Candidate:
    """
    A controller, or a seed that has none yet.

    Attributes
    ----------
    seed
        Of its evolution.
    rank
        Its place in the last population of that evolution, 0 the best.
    network
        One controller; None before evolution.
    fitness
        In its evolution.
    table
        How it obeyed in the last trial.

    """

    seed: int
    rank: int = 0
    network: Network | None = None
    fitness: float = nan
    table: tuple[Row, ...] = ()

    @property
    def controller(self) -> Network:
        """The network; ValueError if it has none yet."""
        if self.network is None:
            raise ValueError(f'candidate {self}: expected a network, which evolution makes')
        return self.network

    def __str__(self) -> str:
        """Return its name."""
        return f'seed {self.seed}, rank {self.rank}'


def population(seed: int, networks: Network, fitness: NDArray[np.float64]) -> list[Candidate]:
    """Return the candidates of a population's networks (N, ...) and fitness (N,), best first."""
    return [Candidate(seed, rank, Network(networks.hidden_weights[rank],
                                          networks.motor_weights[rank],
                                          networks.motor_time_constants), float(fitness[rank]))
            for rank in range(len(fitness))]


def by_seed(candidates: Iterable[Candidate]) -> dict[int, list[Candidate]]:
    """Return seed -> its candidates, both in the order in which they come."""
    found: dict[int, list[Candidate]] = {}
    for candidate in candidates:
        found.setdefault(candidate.seed, []).append(candidate)
    return found


def save(path: Path, candidates: Sequence[Candidate], key: str) -> None:
    """Keep candidates, all with a network or all without; `key` says what they came of."""
    arrays: dict[str, NDArray[np.generic]] = {
        'key': np.array(key), 'seeds': np.array([one.seed for one in candidates], dtype=np.int64),
        'ranks': np.array([one.rank for one in candidates], dtype=np.int64),
        'fitness': np.array([one.fitness for one in candidates], dtype=np.float64),
        'tables': np.array(json.dumps([to_json(one.table) for one in candidates]))}
    networks = [one.network for one in candidates if one.network is not None]
    if networks:
        arrays['hidden_weights'] = np.array([network.hidden_weights for network in networks])
        arrays['motor_weights'] = np.array([network.motor_weights for network in networks])
        arrays['motor_time_constants'] = networks[0].motor_time_constants
    buffer = BytesIO()
    np.savez_compressed(buffer, **arrays)  # type: ignore[arg-type]
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(path, buffer.getvalue())


def load(path: Path, key: str) -> list[Candidate] | None:
    """
    Return the candidates that were kept under `key`; None if there are none.

    Raises
    ------
    CheckpointError
        If the file is damaged.

    """
    if not path.exists():
        return None
    try:
        with np.load(path, allow_pickle=False) as file:
            if str(file['key']) != key:
                return None
            tables = [from_json(rows) for rows in json.loads(str(file['tables']))]
            networks: list[Network | None] = [None] * len(tables)
            if 'hidden_weights' in file:
                networks = [Network(hidden, motor, file['motor_time_constants'])
                            for hidden, motor in zip(file['hidden_weights'],
                                                     file['motor_weights'], strict=True)]
            return [Candidate(int(seed), int(rank), network, float(fitness), table)
                    for seed, rank, network, fitness, table in zip(
                        file['seeds'], file['ranks'], networks, file['fitness'], tables,
                        strict=True)]
    except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile,
            zlib.error) as error:
        raise CheckpointError(f'{path}: not readable candidates ({reason(error)}); delete it to '
                              'have them made anew') from None
