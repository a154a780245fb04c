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

import yaml

#: No count of anything in a study is larger; without a bound a slip of the finger hangs.
MOST = 1_000_000


class ConfigError(ValueError):
    """A configuration that cannot be run; the message says where and what to write."""


class _Loader(yaml.SafeLoader):
    """YAML in which a key that stands twice is an error, as YAML itself demands."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """Return the mapping (yaml.YAMLError if a key stands twice)."""
        seen = set()
        for key, _value in node.value:
            if isinstance(key, yaml.ScalarNode):
                if key.value in seen:
                    raise yaml.constructor.ConstructorError(
                        None, None, f'the key {key.value!r} stands twice', key.start_mark)
                seen.add(key.value)
        return super().construct_mapping(node, deep)


def read_yaml(content: str) -> object:
    """Return the plain data of a YAML text (ConfigError if it is none, or a key stands twice)."""
    try:
        return yaml.load(content, _Loader)
    except yaml.YAMLError as error:
        raise ConfigError(f'not valid YAML: {" ".join(str(error).split())}') from None
    except RecursionError:
        raise ConfigError('not valid YAML: nested too deeply') from None
    except (ValueError, OverflowError) as error:
        # Dates that do not exist, numbers of thousands of digits.
        raise ConfigError(f'not valid YAML: {error}') from None


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
    """Return `value` if it is a whole number from `least` to `MOST`."""
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise ConfigError(f'{where}: expected a whole number of at least {least}, got {value!r}')
    if value > MOST:
        raise ConfigError(f'{where}: expected a whole number of at most {MOST:,}, got {value:,}')
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
