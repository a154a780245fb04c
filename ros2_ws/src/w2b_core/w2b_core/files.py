"""Files that are whole or absent: written aside, synced, then moved into place."""

from __future__ import annotations

import json
import os
import threading
from pathlib import Path
from typing import Any


def write_atomically(path: Path, content: bytes) -> None:
    """
    Write `content` to `path` so that a kill at any moment leaves the old file or the new one.

    The content is on the disk before the name changes, and the name before this returns: a robot's
    supply may be cut right after. The file has the permissions of any new file.

    Raises
    ------
    OSError
        If it cannot be written; nothing is left beside `path`.

    """
    aside = path.with_name(f'.{path.name}.{os.getpid()}.{threading.get_ident()}')
    try:
        with open(aside, 'wb') as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(aside, path)
    finally:
        aside.unlink(missing_ok=True)
    folder = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY)
    try:
        # Else the name may still be that of the old file after a power cut.
        os.fsync(folder)
    finally:
        os.close(folder)


def write_json(path: Path, value: Any) -> None:
    """Write a JSON file atomically: same value, same bytes."""
    write_atomically(path, (json.dumps(value, indent=1, sort_keys=True) + '\n').encode())
