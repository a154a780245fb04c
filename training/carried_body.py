"""
The body of a run, kept in its directory: what was trained stays what it is, whatever its file says.

A body that comes with the program needs none of this: the program's version says what it is.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from w2b_core import bodies
from w2b_core.bodies import description

BODY = 'body.json'


def identity(name: str) -> dict[str, Any]:
    """Return what identifies a body beyond its name or file: a hash, or nothing."""
    body = bodies.get(name)
    return {} if bodies.to_carry(body) is None else {'body_sha256': description.sha256(body)}


def keep(name: str, directory: Path) -> str:
    """Write the body into a run's directory; return the name by which the run is to call it."""
    body = bodies.get(name)
    if bodies.to_carry(body) is None:
        return name
    path = directory / BODY
    if not path.exists():
        description.save(body, path)
    return str(path)
