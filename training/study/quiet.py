"""PyBullet without the line that it writes when it is imported."""

from __future__ import annotations

import os
import sys


def import_pybullet() -> None:
    """
    Import PyBullet while nothing is shown of what it writes.

    It prints its build time past Python, to the process's own error stream, in each worker: in the
    middle of a study's progress.
    """
    if 'pybullet' in sys.modules:
        return
    sys.stderr.flush()
    kept = os.dup(2)
    try:
        with open(os.devnull, 'wb') as nowhere:
            os.dup2(nowhere.fileno(), 2)
        import pybullet  # noqa: F401
    finally:
        os.dup2(kept, 2)
        os.close(kept)
