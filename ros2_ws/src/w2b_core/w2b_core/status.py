"""How a part of a node is, as plain data: what becomes a `diagnostic_msgs/DiagnosticStatus`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum


class Level(IntEnum):
    """The levels of a DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


@dataclass(frozen=True)
class Status:
    """
    One status: `name` is `node: part` (REP-107), `message` a sentence for a person.

    The message holds nothing that changes with every frame, so that a changed message means a
    changed state; counts are among the `values`.
    """

    level: Level
    name: str
    message: str
    values: Mapping[str, str] = field(default_factory=dict)
