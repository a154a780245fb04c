"""PyBullet, imported without the line that its C code prints to standard error."""

from __future__ import annotations

import importlib
import os
import sys
from typing import Any


def _imported() -> Any:
    sys.stderr.flush()
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        return importlib.import_module('pybullet')
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)


pybullet = _imported()
