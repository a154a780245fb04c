"""
Where a result comes from: what must be equal for runs to be one sample, and what is only noted.

The *identity* is compared: the configuration, the hash of the vocabulary's vectors, and the hash of
the engine's results (see `results`), one for each body. The *environment* (program version, git
commit, package versions, machine) is noted beside it. A change of the program that returns the same
bits keeps the runs; one that does not, on any machine, is refused.

Studies made before 2026-11-28 have the program version and a hash of source files in their
identity instead of results. They can be read and reported, not gone on with.
"""

from __future__ import annotations

import platform
import socket
import subprocess
from datetime import UTC, datetime
from functools import cache
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import w2b_core
from training.evolution.treatments import WORD_SETS, vector_hash
from training.evolution.vectors import known, vector
from training.study.config import StudyConfig
from training.study.results import results_sha256

PACKAGES = ('numpy', 'numba', 'llvmlite', 'scipy', 'pybullet', 'gensim')


def identity(config: StudyConfig) -> dict[str, Any]:
    """
    Return what must be equal for the runs of one store, as a JSON object.

    `results_sha256` maps each body of the study to the hash of the engine's results; computing it
    compiles the engine for that body if that was not done before. See `run_identity`.
    """
    return {
        'results_sha256': {body: results_sha256(config.engine, config.precision, body,
                                                config.objective)
                           for body in dict.fromkeys(run.body for run in config.runs())},
        'engine': config.engine,
        'precision': config.precision,
        'objective': config.objective,
        'population': config.population,
        'generations': config.generations,
        'vocabulary': config.vocabulary,
        'vocabulary_sha256': vocabulary_sha256(config.vocabulary),
    }


def run_identity(study: dict[str, Any], body: str) -> dict[str, Any]:
    """Return the identity of a run of `body` in a study of this identity: one hash of results."""
    results = study.get('results_sha256')
    if not isinstance(results, dict):
        return study
    return {**study, 'results_sha256': results.get(body)}


def environment() -> dict[str, Any]:
    """Return what is worth knowing of this process and machine; a JSON object of texts."""
    return {
        'program_version': w2b_core.__version__,
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
    """
    Return, one text a field, in what an identity differs from the one asked for.

    Of two studies' identities the results of bodies that both have are compared.
    """
    there, here = found.get('results_sha256'), asked.get('results_sha256')
    if isinstance(there, dict) and isinstance(here, dict):
        unlike = [body for body in there if body in here and there[body] != here[body]]
        found, asked = ({**identity, 'results_sha256': {body: hashes[body] for body in unlike}}
                        for identity, hashes in ((found, there), (asked, here)))
    return [f'{name} is {found.get(name)!r} there, {asked.get(name)!r} here'
            for name in sorted(set(found) | set(asked)) if found.get(name) != asked.get(name)]
