"""
Checks of plain data, as YAML gives it, against what a configuration expects.

Every function takes `where`, the field's place in the file, and raises `ConfigError` with one line
that says what was expected there and what came.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from difflib import get_close_matches
from typing import Any


class ConfigError(ValueError):
    """A configuration that cannot be run; the message says where and what to write."""


def mapping(data: object, where: str, kind: type) -> Mapping[str, Any]:
    """Return `data` if it is a mapping whose keys are fields of the dataclass `kind`."""
    if not isinstance(data, Mapping):
        raise ConfigError(f'{where}: expected a mapping of fields to values, got {data!r}')
    names = [entry.name for entry in fields(kind)]
    for key in data:
        if key not in names:
            raise ConfigError(f'{where}: unknown field {key!r}{near(str(key), names)}')
    return data


def require(data: Mapping[str, Any], where: str, *names: str) -> None:
    """Check that `data` has all of `names`."""
    for name in names:
        if name not in data:
            raise ConfigError(f'{where}: the field {name!r} is missing')


def text(value: object, where: str) -> str:
    """Return `value` if it is text that is not empty."""
    if not isinstance(value, str) or not value:
        raise ConfigError(f'{where}: expected text, got {value!r}')
    return value


def count(value: object, where: str, least: int = 1) -> int:
    """Return `value` if it is a whole number of at least `least`."""
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise ConfigError(f'{where}: expected a whole number of at least {least}, got {value!r}')
    return value


def choice(value: object, where: str, choices: tuple[str, ...]) -> str:
    """Return `value` if it is one of `choices`."""
    if value not in choices:
        raise ConfigError(f'{where}: expected one of {", ".join(choices)}; got {value!r}'
                          f'{near(str(value), choices)}')
    return str(value)


def choices(value: object, where: str, choices: tuple[str, ...]) -> tuple[str, ...]:
    """Return `value` if it is a list of different `choices`, at least one."""
    if not isinstance(value, list) or not value:
        raise ConfigError(f'{where}: expected a list of {", ".join(choices)}; got {value!r}')
    chosen = tuple(choice(item, where, choices) for item in value)
    if len(set(chosen)) < len(chosen):
        raise ConfigError(f'{where}: expected each name once, got {", ".join(chosen)}')
    return chosen


def near(value: str, choices: Sequence[str]) -> str:
    """Return a hint at the choice whose spelling is nearest to `value`, or ''."""
    close = get_close_matches(value, choices, 1)
    return f' (did you mean {close[0]!r}?)' if close else ''
