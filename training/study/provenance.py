"""
Where a result comes from: what must be equal for runs to be one sample, and what is only noted.

The *identity* is compared: program version, a hash of the source files that decide a run's outcome,
the engine and its precision, the vocabulary's hash, and the configuration. The *environment* (git
commit, versions, machine) is written down beside it, since results must not depend on it.
"""

from __future__ import annotations

import platform
import socket
import subprocess
from collections.abc import Iterator
from datetime import UTC, datetime
from functools import cache
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import training.evolution
import w2b_core
import w2b_sim
from training.evolution.treatments import WORD_SETS, vector_hash
from training.evolution.vectors import known, vector
from training.study.config import StudyConfig

#: Modules of `training.evolution` that decide what a run's champion is; the others only run it or
#: report on it.
EVOLUTION_SOURCES = ('afpo', 'champion', 'config', 'engines', 'objectives', 'operators', 'run',
                    'starts', 'treatments')
PACKAGES = ('numpy', 'numba', 'llvmlite', 'scipy', 'pybullet', 'gensim')


def identity(config: StudyConfig) -> dict[str, Any]:
    """Return what must be equal for the runs of one store; a JSON object of plain fields."""
    return {
        'program_version': w2b_core.__version__,
        'sources_sha256': sources_sha256(),
        'engine': config.engine,
        'precision': config.precision,
        'objective': config.objective,
        'population': config.population,
        'generations': config.generations,
        'vocabulary': config.vocabulary,
        'vocabulary_sha256': vocabulary_sha256(config.vocabulary),
    }


def environment() -> dict[str, Any]:
    """Return what is worth knowing of this process and machine; a JSON object of texts."""
    return {
        'git_commit': git_commit(),
        'python': platform.python_version(),
        'packages': {name: _version(name) for name in PACKAGES},
        'platform': platform.platform(),
        'machine': platform.machine(),
        'host': socket.gethostname(),
        'started_utc': utc_now(),
    }


def utc_now() -> str:
    """Return the date and time in UTC, to the second, in ISO 8601."""
    return datetime.now(UTC).isoformat(timespec='seconds')


@cache
def sources_sha256() -> str:
    """Return the hash of all source files that decide a run's outcome."""
    digest = sha256()
    for name, path in sorted(_sources()):
        digest.update(f'{name}\0'.encode())
        digest.update(path.read_bytes() + b'\0')
    return digest.hexdigest()


def _sources() -> Iterator[tuple[str, Path]]:
    evolution = Path(training.evolution.__file__).parent
    for module in EVOLUTION_SOURCES:
        yield f'training/evolution/{module}.py', evolution / f'{module}.py'
    core = Path(w2b_core.__file__).parent
    for path in (core / 'network.py', *core.glob('bodies/*.py')):
        yield f'w2b_core/{path.relative_to(core).as_posix()}', path
    simulator = Path(w2b_sim.__file__).parent
    for path in (simulator / 'worlds.py', *simulator.glob('engines/**/*.py')):
        yield f'w2b_sim/{path.relative_to(simulator).as_posix()}', path


def commands() -> tuple[str, ...]:
    """Return every command of the study's word sets."""
    return tuple(dict.fromkeys(
        word for always, stops in WORD_SETS.values() for word, _ in always + stops))


def vocabulary_sha256(spec: str) -> str:
    """Return the hash of the vectors that a vocabulary gives the study's commands."""
    digest = sha256()
    for word in commands():
        if not known(spec, word):
            continue  # a set that trains on it is refused with this vocabulary
        digest.update(f'{word}\0{vector_hash(vector(spec, word))}\n'.encode())
    return digest.hexdigest()


@cache
def git_commit() -> str:
    """Return the commit of this program, with `+changes` if files differ from it; '' if unknown."""
    here = Path(__file__).parent
    try:
        commit, changes = (subprocess.run(
            ['git', *arguments], cwd=here, capture_output=True, text=True, check=True, timeout=10,
        ).stdout.strip() for arguments in (
            ('rev-parse', 'HEAD'), ('status', '--porcelain', '--untracked-files=no')))
    except (OSError, subprocess.SubprocessError):
        return ''
    return commit + ('+changes' if changes else '')


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return ''


def differences(found: dict[str, Any], asked: dict[str, Any]) -> list[str]:
    """Return, one text a field, in what an identity differs from the one asked for."""
    return [f'{name} is {found.get(name)!r} there, {asked.get(name)!r} here'
            for name in sorted(set(found) | set(asked)) if found.get(name) != asked.get(name)]
