"""
Compiling the kernel once and keeping the machine code.

The code is kept in a folder of its own for each version of these sources, under `W2B_CACHE_DIR`,
else the user's cache folder. numba alone looks at one file and would miss a change in another; and
it keeps the code of each copy of a file apart, while here checkouts, wheels and ROS workspaces with
the same sources share it. Where no folder can be written, as in a read-only home, the kernel is
compiled anew in each process.
"""

from __future__ import annotations

import hashlib
import logging
import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from typing import Any

import llvmlite.binding
import numba
from numba.core import caching, config

from w2b_core import senses
from w2b_sim.engines.batched import kernel, recording_kernel
from w2b_sim.engines.batched.layout import Layout
from w2b_sim.engines.jit import njit

logger = logging.getLogger(__name__)


@lru_cache(maxsize=1)
def cache_folder() -> Path | None:
    """Return the folder for machine code, made if need be; None if none can be written."""
    home = os.environ.get('XDG_CACHE_HOME') or Path.home() / '.cache'
    wanted = os.environ.get('W2B_CACHE_DIR') or Path(home) / 'w2b'
    folder = Path(wanted) / f'batched-{_fingerprint()}'
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        logger.warning('cannot keep compiled code in %s (%s): compiling in each process', folder,
                       error.strerror)
        return None
    return folder


#: Modules that only call the compiled code: a change of them leaves it as it is.
FRONTS = frozenset({'__init__', 'compilation', 'complete', 'engine', 'leaky_engine',
                    'leaky_variations', 'machine', 'serial_recorder', 'standing', 'variations'})


def _fingerprint() -> str:
    """Return a hash of all that the machine code follows from, the processor apart (numba's)."""
    digest = hashlib.sha256(numba.__version__.encode())
    for path in sorted(Path(__file__).parent.glob('*.py')):
        if path.stem not in FRONTS:
            digest.update(path.read_bytes())
    digest.update(Path(senses.__file__).read_bytes())
    return digest.hexdigest()[:16]


def compiled_evaluate() -> Any:
    """Return `kernel.evaluate` as a numba dispatcher that releases the GIL and keeps its code."""
    return _compiled_call(kernel.evaluate)


def compiled_evaluate_recorded() -> Any:
    """Return the same of `recording_kernel.evaluate_recorded`."""
    return _compiled_call(recording_kernel.evaluate_recorded)


def compiled_prime() -> Any:
    """Return the same of `kernel.prime`."""
    return _compiled_call(kernel.prime)


@lru_cache(maxsize=3)
def _compiled_call(call: Callable[..., None]) -> Any:
    dispatcher = njit(nogil=True, error_model='numpy')(call)
    folder = cache_folder()
    if folder is not None:
        settings: Any = config
        before = settings.CACHE_DIR
        settings.CACHE_DIR = str(folder)
        try:
            setattr(dispatcher, '_cache', _Cache(call))  # noqa: B010 - as enable_caching does
        finally:
            settings.CACHE_DIR = before
    return dispatcher


class _Locator(caching.UserProvidedCacheLocator):
    """Keeps the code of every copy of the sources in one place, `config.CACHE_DIR` when made."""

    @classmethod
    def get_suitable_cache_subpath(cls, py_file: str) -> str:
        return Path(py_file).stem


class _CacheImpl(caching.CompileResultCacheImpl):
    _locator_classes = [_Locator]


class _Cache(caching.FunctionCache):
    _impl_class = _CacheImpl


def lanes_for(bits: int) -> int:
    """
    Return the number of lanes that suits this processor: one of its vector registers a value.

    More lanes hide latency better, but touch more contacts at a time and leave the first-level
    cache. The results do not depend on it.
    """
    features = llvmlite.binding.get_host_cpu_features()
    if features.get('avx512f'):
        register_bits = 512
    elif features.get('avx'):
        register_bits = 256
    else:
        register_bits = 128
    return register_bits // bits


@contextmanager
def announced(layout: Layout, say: Callable[[str], None] | None) -> Iterator[None]:
    """Tell before the first call with a layout that it compiles, if its code is not kept yet."""
    if layout in _compiled:
        yield
        return
    folder = cache_folder()
    kept = None if folder is None else folder / f'{_name(layout)}.compiled'
    if kept is None or not kept.exists():
        (say or logger.warning)(
            f'compiling the batched engine once for {layout.links} links, {layout.bits} bits, '
            f'{layout.lanes} lanes (up to two minutes)')
    yield
    _compiled.add(layout)
    if kept is not None:
        with suppress(OSError):
            kept.touch()


_compiled: set[Layout] = set()


def _name(layout: Layout) -> str:
    """Return a file name for a layout, on this processor."""
    known = f'{llvmlite.binding.get_host_cpu_name()} {layout}'
    return hashlib.sha256(known.encode()).hexdigest()[:16]
