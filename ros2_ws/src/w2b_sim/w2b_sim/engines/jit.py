"""
numba's `njit`, which compiles whatever the environment says.

NUMBA_DISABLE_JIT=1, left over from a debugging session, would run the kernels as Python: thousands
of times slower, and not at all where they use intrinsics.
"""

from __future__ import annotations

import os

# Before numba is imported, for this process and those that it starts.
os.environ.pop('NUMBA_DISABLE_JIT', None)

from numba import njit
from numba.core import config

config.DISABLE_JIT = 0  # type: ignore[attr-defined]

__all__ = ['njit']
