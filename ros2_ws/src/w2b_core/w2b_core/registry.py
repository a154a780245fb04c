"""
Registries that users extend from outside: bodies, behaviours, senses, engines, optimisers.

An entry is added by one call in one place. Packages of a user's own are found by the entry point
group `w2b.plugins`, single files are named by `--plugin FILE.py` or in the environment variable
`W2B_PLUGINS`; both are imported at the first look at a registry, also in processes started later.
"""

from __future__ import annotations

import importlib.util
import os
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from hashlib import sha256
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any, Generic, TypeVar

Entry = TypeVar('Entry')

ENTRY_POINTS = 'w2b.plugins'
#: Files of plugins, separated as in PATH. Inherited by the processes that this one starts.
ENVIRONMENT = 'W2B_PLUGINS'
_NAME = re.compile(r'[A-Za-z][A-Za-z0-9_]{0,99}')
_registries: list[Registry[Any]] = []


class RegistryError(ValueError):
    """A name that is registered twice, or that is no name."""


class PluginError(ValueError):
    """A plugin that cannot be used: one line with the file, the name and the reason."""


class Registry(Generic[Entry]):
    """
    Entries of one kind by name, in the order of their registration.

    Parameters
    ----------
    kind
        What the entries are, in the singular, for messages.

    """

    def __init__(self, kind: str) -> None:
        self.kind = kind
        self._entries: dict[str, Entry] = {}
        self._origins: dict[str, str] = {}
        _registries.append(self)

    def add(self, name: str, entry: Entry) -> Entry:
        """Register `entry`; RegistryError if the name is taken, or is none."""
        if not _NAME.fullmatch(name):
            raise RegistryError(f'{self.kind}: expected a name of letters, digits and _, '
                                f'got {name!r}')
        if name in self._entries:
            raise RegistryError(f'{self.kind} {name!r}: expected a new name, got one that is '
                                'registered already')
        self._entries[name] = entry
        self._origins[name] = _importing
        return entry

    def get(self, name: str) -> Entry:
        """Return the entry; ValueError, with the names there are, if there is none."""
        load_plugins()
        if name not in self._entries:
            raise ValueError(f'unknown {self.kind} {name!r}: expected one of '
                             f'{", ".join(self._entries)}')
        return self._entries[name]

    def names(self) -> tuple[str, ...]:
        """Return all names."""
        load_plugins()
        return tuple(self._entries)

    def __contains__(self, name: object) -> bool:
        load_plugins()
        return name in self._entries

    def __iter__(self) -> Iterator[str]:
        return iter(self.names())

    def built_in(self) -> tuple[str, ...]:
        """Return the names registered so far, without looking for plugins."""
        return tuple(self._entries)

    def origin(self, name: str) -> str:
        """Return the plugin that registered `name`; '' for what comes with the program."""
        return self._origins.get(name, '')

    def _snapshot(self) -> dict[str, Entry]:
        return dict(self._entries)

    def _restore(self, entries: dict[str, Entry]) -> None:
        self._entries = dict(entries)


_loaded: set[str] = set()
_loading = False
#: The plugin that is being imported.
_importing = ''


@cache
def _installed() -> tuple[EntryPoint, ...]:
    """Return the entry points of installed plugins; to look for them takes 50 ms."""
    return tuple(entry_points(group=ENTRY_POINTS))


def load_plugins() -> None:
    """
    Import the plugins that are installed or named in the environment, each once.

    Raises
    ------
    PluginError
        If one of them cannot be used; it then has registered nothing.

    """
    global _loading
    if _loading:  # a plugin that looks at a registry while it is imported
        return
    _loading = True
    try:
        for point in _installed():
            if point.value not in _loaded:
                with _all_or_nothing(f'plugin {point.name} ({point.value})'):
                    point.load()
                _loaded.add(point.value)
        for path in os.environ.get(ENVIRONMENT, '').split(os.pathsep):
            if path and path not in _loaded:
                _import_file(Path(path))
                _loaded.add(path)
    finally:
        _loading = False


def use_plugin(path: Path | str) -> None:
    """Import the plugin in a file, here and in every process that this one starts; PluginError."""
    path = Path(path).absolute()
    named = [entry for entry in os.environ.get(ENVIRONMENT, '').split(os.pathsep) if entry]
    before = os.environ.get(ENVIRONMENT)
    if str(path) not in named:
        os.environ[ENVIRONMENT] = os.pathsep.join([*named, str(path)])
    try:
        load_plugins()
    except PluginError:
        if before is None:
            del os.environ[ENVIRONMENT]
        else:
            os.environ[ENVIRONMENT] = before
        raise


def _import_file(path: Path) -> None:
    name = f'w2b_plugin_{path.stem}_{sha256(str(path).encode()).hexdigest()[:8]}'
    with _all_or_nothing(str(path)):
        if not path.is_file():
            raise FileNotFoundError('expected a Python file, got nothing there')
        specification = importlib.util.spec_from_file_location(name, path)
        if specification is None or specification.loader is None:
            raise ImportError('expected the name of a Python file to end in .py')
        module = importlib.util.module_from_spec(specification)
        sys.modules[name] = module
        try:
            specification.loader.exec_module(module)
        except BaseException:
            del sys.modules[name]
            raise


@contextmanager
def _all_or_nothing(what: str) -> Iterator[None]:
    """Undo what was registered within, and raise PluginError, if anything goes wrong."""
    global _importing
    before = [(registry, registry._snapshot()) for registry in _registries]
    _importing = what
    try:
        yield
    except Exception as error:
        for registry, entries in before:
            registry._restore(entries)
        reason = ' '.join(str(error).split()) or 'no reason given'
        kind = '' if isinstance(error, RegistryError | PluginError) else f'{type(error).__name__}: '
        raise PluginError(f'{what}: {kind}{reason}') from error
    finally:
        _importing = ''
