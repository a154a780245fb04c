"""
The directory of a run: what it is (config.json), how far it got (checkpoint.npz), what came of it.

Safe to kill at any moment. One process at a time works in it; a directory that belongs to another
run is refused, with what differs.
"""

from __future__ import annotations

import fcntl
import json
import os
from pathlib import Path
from types import TracebackType
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from training.evolution import checkpoint

CONFIG, CHECKPOINT, STATISTICS = 'config.json', 'checkpoint.npz', 'statistics.npz'
SUMMARY, CHAMPION, LOCK = 'summary.json', 'champion.json', '.lock'


class RunConflictError(ValueError):
    """The directory cannot be used for this run; the message says why and what to do."""


class RunDirectory:
    """
    A run's directory, locked while it is open.

    Parameters
    ----------
    path
        Made if it is not there.
    identity
        The JSON object that says which run this is.
    may_grow
        Names of integer fields of `identity['config']` that a resumed run may raise.

    """

    def __init__(self, path: Path, identity: dict[str, Any], *,
                 may_grow: tuple[str, ...] = ('generations',)) -> None:
        self.path = Path(path)
        self.identity = identity
        self.may_grow = may_grow
        self._lock: IO[str] | None = None

    def __enter__(self) -> RunDirectory:
        """Lock the directory and check that it is this run's (RunConflictError if not)."""
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            self._lock = open(self.path / LOCK, 'a+')
        except OSError as error:
            raise RunConflictError(f'{self.path}: cannot be used as a run directory '
                                   f'({error.strerror}); choose another') from None
        try:
            self._acquire(self._lock)
            self._sweep()
            self._check_identity()
        except BaseException:
            self._lock.close()
            raise
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        if self._lock is not None:
            self._lock.close()

    def _acquire(self, lock: IO[str]) -> None:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            lock.seek(0)
            holder = lock.read().strip() or 'unknown'
            raise RunConflictError(f'{self.path}: process {holder} is running in this directory; '
                                   'wait for it or choose another directory') from None
        lock.truncate(0)
        lock.write(str(os.getpid()))
        lock.flush()

    def _sweep(self) -> None:
        """Delete what a killed process was writing aside: nobody else is at work here now."""
        for name in (CONFIG, CHECKPOINT, STATISTICS, CHAMPION, SUMMARY):
            for aside in self.path.glob(f'.{name}.*'):
                aside.unlink(missing_ok=True)

    def _check_identity(self) -> None:
        path = self.path / CONFIG
        if path.exists():
            try:
                found = json.loads(path.read_text(encoding='utf-8'))
                parts = [key for key, part in self.identity.items() if isinstance(part, dict)]
                if not isinstance(found, dict) or not all(
                        isinstance(found.get(key), dict) for key in parts):
                    raise ValueError("expected a run's configuration")
            except ValueError as error:
                raise RunConflictError(f'{path}: not readable ({error}); choose another directory '
                                       'or delete this one') from None
            differing = list(_differences(found, self.identity, self.may_grow))
            if differing:
                raise RunConflictError(f'{self.path}: holds another run: {"; ".join(differing)}; '
                                       'repeat its options or choose another directory')
            if found == self.identity:
                return
        elif (self.path / CHECKPOINT).exists():
            raise RunConflictError(f'{path}: missing beside a checkpoint; choose another directory')
        checkpoint.write_json(path, self.identity)

    def resume(self, generator: np.random.Generator) -> dict[str, NDArray[np.generic]] | None:
        """Return the checkpoint's arrays and set the generator, or None if there is none yet."""
        path = self.path / CHECKPOINT
        return checkpoint.load(path, generator) if path.exists() else None

    def save(self, arrays: dict[str, NDArray[np.generic]],
             generator: np.random.Generator) -> None:
        """Write the checkpoint."""
        checkpoint.save(self.path / CHECKPOINT, arrays, generator)


def _differences(found: Any, asked: Any, may_grow: tuple[str, ...], name: str = '') -> Any:
    """Yield what differs between two JSON values, field by field."""
    if isinstance(found, dict) and isinstance(asked, dict):
        for key in sorted(set(found) | set(asked)):
            if key not in found or key not in asked:
                yield f'{key}: it has {found.get(key)!r}, asked {asked.get(key)!r}'
            elif not (name == 'config' and key in may_grow and isinstance(found[key], int)
                      and found[key] <= asked[key]):
                yield from _differences(found[key], asked[key], may_grow, key)
    elif found != asked:
        yield f'{name}: it has {found!r}, asked {asked!r}'
