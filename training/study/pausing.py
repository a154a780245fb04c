"""
A study that pauses and goes on: a file in its directory that workers look at between generations.

`DIR/paused` is the switch. A worker that has seen it leaves `runs/RUN/waiting` until it goes on, so
that who paused the study can tell when the processors are free. Workers of a Dask cluster see the
same files. A study that is started while it is paused waits at its first tasks.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

from training.evolution.checkpoint import write_json
from training.study.directory import in_use

SWITCH, WAITING = 'paused', 'waiting'
#: Between two looks at the switch while a worker waits.
LOOK_S = 0.2


class Pause:
    """A worker's view of the switch of the study in `study`, for the run in `directory`."""

    def __init__(self, study: Path, directory: Path) -> None:
        self._switch, self._waiting = study / SWITCH, directory / WAITING
        # A worker that was killed while it waited could not delete it.
        self._waiting.unlink(missing_ok=True)

    def wait(self) -> None:
        """Return at once, or when the study is no longer paused."""
        if not self._switch.exists():
            return
        self._waiting.touch()
        try:
            while self._switch.exists():
                time.sleep(LOOK_S)
        finally:
            self._waiting.unlink(missing_ok=True)


def pause(study: Path, utc: str) -> None:
    """Throw the switch."""
    write_json(study / SWITCH, {'since_utc': utc})


def resume(study: Path) -> bool:
    """Let the study go on; return whether it was paused."""
    paused = is_paused(study)
    (study / SWITCH).unlink(missing_ok=True)
    return paused


def is_paused(study: Path) -> bool:
    """Return whether the switch is thrown."""
    return (study / SWITCH).exists()


def at_work(study: Path) -> list[str]:
    """Return the names of runs that a worker holds and has not stopped at the switch."""
    return sorted(directory.name for directory in held(study)
                  if not (directory / WAITING).exists())


def held(study: Path) -> Iterator[Path]:
    """Yield the directories of runs that a worker holds now."""
    for claim in (study / 'runs').glob('*/claim'):
        if in_use(claim):
            yield claim.parent
