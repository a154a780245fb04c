"""Diagnostics as lights: the newest status of each part, by robot."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from w2b_core.status import Level
from w2b_web.hub import message

#: Nodes report every second: a part that is silent for longer counts as stale, then as gone.
STALE_S, GONE_S = 3.5, 30.0
MOST = 100


@dataclass
class _Light:
    level: int
    message: str
    at_s: float


class Lights:
    """
    The newest status of each part of each robot.

    Parameters
    ----------
    clock
        Monotonic seconds.

    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._lights: dict[str, dict[str, _Light]] = {}
        self._told: dict[str, list[dict[str, Any]]] = {}

    def take(self, name: str, level: int, text: str) -> None:
        """Note a status: `name` is `robot/node: part` (REP-107)."""
        node, _, part = name.partition(': ')
        namespace, _, node = node.strip('/').rpartition('/')
        lights = self._lights.setdefault(f'/{namespace}' if namespace else '', {})
        key = f'{node}: {part}' if part else node
        if key in lights or len(lights) < MOST:
            lights[key] = _Light(min(level, Level.STALE), text[:400], self._clock())

    def silent(self, namespace: str, node: str) -> bool:
        """Return whether a node that reported is silent now: killed, or hanging."""
        at_s = [light.at_s for key, light in self._lights.get(namespace, {}).items()
                if key.startswith(f'{node}: ')]
        return bool(at_s) and self._clock() - max(at_s) > STALE_S

    def news(self, namespace: str) -> str | None:
        """Return the message with a robot's lights if they changed since the last one."""
        now_s = self._clock()
        lights = self._lights.get(namespace, {})
        for key in [key for key, light in lights.items() if now_s - light.at_s > GONE_S]:
            del lights[key]
        told = [{'name': key, 'level': int(Level.STALE), 'text': 'silent since; last: '
                 + light.message} if now_s - light.at_s > STALE_S else
                {'name': key, 'level': light.level, 'text': light.message}
                for key, light in sorted(lights.items())]
        if told == self._told.get(namespace):
            return None
        self._told[namespace] = told
        return message('lights', items=told)
