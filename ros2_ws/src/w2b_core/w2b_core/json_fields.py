"""Strict reading and diffable writing of the JSON files that people keep: controllers, bodies."""

from __future__ import annotations

import json
import math
import reprlib
from collections.abc import Callable
from typing import Any, NoReturn, TypeVar

_TOO_DEEP = 'the file: expected a few levels of lists and objects, got hundreds in each other'
_Value = TypeVar('_Value')
_short = reprlib.Repr()
_short.maxstring = _short.maxother = 60
_KINDS = {bool: 'a boolean', int: 'a number', float: 'a number', str: 'a string',
          list: 'a list', dict: 'an object', type(None): 'null'}


class JsonFileError(ValueError):
    """A file of a controller or body, or what was to become one, is damaged."""


def shown(value: object) -> str:
    """Return `value` in print, on one line and cut short."""
    return _short.repr(value).replace('\n', ' ')


def expect(condition: bool, name: str, expected: str, got: object) -> None:
    """Raise a JsonFileError about the field `name` unless `condition` holds."""
    if not condition:
        raise JsonFileError(f'{name}: expected {expected}, '
                            f'got {got if isinstance(got, Text) else shown(got)}')


class Text(str):
    """What came, in words: shown as it is."""

    __slots__ = ()


class Fields:
    """
    The fields of one JSON object, each taken once under the type it must have.

    Every method raises JsonFileError naming the field; `finish` does so if any are left.
    """

    def __init__(self, value: object, name: str = '') -> None:
        expect(isinstance(value, dict), name or 'the file', 'a JSON object', Text(_kind(value)))
        assert isinstance(value, dict)
        self._left: dict[str, object] = dict(value)
        self._name = name

    def _take(self, key: str, expected: str, check: Callable[[object, str, str], _Value]
              ) -> _Value:
        name = self.name(key)
        expect(key in self._left, name, expected, Text('nothing: the field is missing'))
        return check(self._left.pop(key), name, expected)

    def name(self, key: str) -> str:
        """Return the full name of a field."""
        return f'{self._name}.{key}' if self._name else key

    def text(self, key: str) -> str:
        """Take a string."""
        return self._take(key, 'a string', _text)

    def number(self, key: str) -> float:
        """Take a finite number."""
        return self._take(key, 'a finite number', _number)

    def number_or_none(self, key: str) -> float | None:
        """Take a finite number or null."""
        return self._take(key, 'a finite number or null',
                          lambda value, name, expected:
                          None if value is None else _number(value, name, expected))

    def has(self, key: str) -> bool:
        """Whether there is such a field that nothing took yet."""
        return key in self._left

    def flag(self, key: str) -> bool:
        """Take true or false."""
        def check(value: object, name: str, expected: str) -> bool:
            if not isinstance(value, bool):
                raise JsonFileError(f'{name}: expected {expected}, got {_kind(value)}')
            return value
        return self._take(key, 'true or false', check)

    def numbers_or_none(self, key: str) -> list[float] | None:
        """Take a list of finite numbers or null."""
        return None if self._is_null(key) else self.numbers(key)

    def matrix_or_none(self, key: str) -> list[list[float]] | None:
        """Take what `matrix` takes, or null."""
        return None if self._is_null(key) else self.matrix(key)

    def _is_null(self, key: str) -> bool:
        null = key in self._left and self._left[key] is None
        if null:
            del self._left[key]
        return null

    def integer(self, key: str) -> int:
        """Take a whole number."""
        return self._take(key, 'a whole number', _integer)

    def texts(self, key: str) -> tuple[str, ...]:
        """Take a list of strings."""
        values = self._take(key, 'a list of strings', _list)
        return tuple(_text(value, f'{self.name(key)}[{index}]', 'a string')
                     for index, value in enumerate(values))

    def numbers(self, key: str) -> list[float]:
        """Take a list of finite numbers."""
        return [_number(value, f'{self.name(key)}[{index}]', 'a finite number')
                for index, value in enumerate(self._take(key, 'a list of numbers', _list))]

    def matrix(self, key: str) -> list[list[float]]:
        """Take a list of one or more equally long, not empty lists of finite numbers."""
        expected = 'a list of rows of finite numbers'
        rows = [_list(row, f'{self.name(key)}[{index}]', 'a row of finite numbers')
                for index, row in enumerate(self._take(key, expected, _list))]
        expect(bool(rows and rows[0]), self.name(key), expected, Text('an empty list'))
        for index, row in enumerate(rows):
            expect(len(row) == len(rows[0]), f'{self.name(key)}[{index}]',
                   f'{len(rows[0])} numbers as in the first row', Text(str(len(row))))
        return [[_number(value, f'{self.name(key)}[{i}][{j}]', 'a finite number')
                 for j, value in enumerate(row)] for i, row in enumerate(rows)]

    def fields(self, key: str) -> Fields:
        """Take an object."""
        return self._take(key, 'a JSON object', lambda value, name, _expected: Fields(value, name))

    def list_of_fields(self, key: str) -> list[Fields]:
        """Take a list of objects."""
        return [Fields(value, f'{self.name(key)}[{index}]')
                for index, value in enumerate(self._take(key, 'a list of JSON objects', _list))]

    def free(self, key: str) -> dict[str, Any]:
        """Take an object with whatever it holds, of finite numbers."""
        def check(value: object, name: str, _expected: str) -> dict[str, Any]:
            expect(isinstance(value, dict), name, 'a JSON object', Text(_kind(value)))
            assert isinstance(value, dict)
            try:
                _check_finite(value, name)
            except RecursionError:
                raise JsonFileError(_TOO_DEEP) from None
            return value
        return self._take(key, 'a JSON object', check)

    def finish(self) -> None:
        """Refuse fields that nothing took."""
        for key in self._left:
            raise JsonFileError(f'{self.name(_key(key))}: expected no such field, '
                                'got an unknown field')


def _kind(value: object) -> str:
    return _KINDS.get(type(value), type(value).__name__)


def _key(key: str) -> str:
    """Return the name of a field as it can be printed."""
    return shown(key)[1:-1]


def _text(value: object, name: str, expected: str) -> str:
    if not isinstance(value, str):
        raise JsonFileError(f'{name}: expected {expected}, got {_kind(value)}')
    return value


def _number(value: object, name: str, expected: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise JsonFileError(f'{name}: expected {expected}, got {_kind(value)}')
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    expect(math.isfinite(number), name, expected, Text('a number too large for a double'))
    return number


def _integer(value: object, name: str, expected: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise JsonFileError(f'{name}: expected {expected}, got {_kind(value)}')
    return value


def _list(value: object, name: str, expected: str) -> list[object]:
    if not isinstance(value, list):
        raise JsonFileError(f'{name}: expected {expected}, got {_kind(value)}')
    return value


def _check_finite(value: object, name: str) -> None:
    if isinstance(value, dict):
        for key, item in value.items():
            _check_finite(item, f'{name}.{_key(key)}')
    elif isinstance(value, list):
        for index, item in enumerate(value):
            _check_finite(item, f'{name}[{index}]')
    elif isinstance(value, float):
        expect(math.isfinite(value), name, 'a finite number',
               Text('a number too large for a double'))


def read(text: str) -> Fields:
    """Return the fields of the JSON object that `text` is, or raise JsonFileError."""
    try:
        return Fields(json.loads(text, parse_constant=_refuse_constant,
                                 object_pairs_hook=_refuse_duplicates))
    except json.JSONDecodeError as error:
        reason = error.msg[:1].lower() + error.msg[1:]
        raise JsonFileError(
            'the file: expected JSON, got text that is not JSON '
            f'(line {error.lineno}, column {error.colno}: {reason})') from None
    except RecursionError:
        raise JsonFileError(_TOO_DEEP) from None
    except JsonFileError:
        raise
    except ValueError:  # Python's own limit on the digits of a whole number
        raise JsonFileError('the file: expected numbers that a double can hold, '
                            'got one of thousands of digits') from None


def _refuse_constant(name: str) -> NoReturn:
    raise JsonFileError(f'the file: expected finite numbers, got {name}, which JSON lacks')


def _refuse_duplicates(pairs: list[tuple[str, object]]) -> dict[str, object]:
    fields = dict(pairs)
    if len(fields) < len(pairs):
        keys = [key for key, _ in pairs]
        double = next(key for index, key in enumerate(keys) if key in keys[:index])
        raise JsonFileError(f'{_key(double)}: expected once, got it twice in one '
                            'object')
    return fields


def write(value: dict[str, Any]) -> str:
    """
    Return `value` as JSON that can be diffed: one matrix row, motor or word a line.

    Raises
    ------
    JsonFileError
        If JSON cannot hold a value: NaN, infinity or a Python object.

    """
    try:
        return _lines(value, 0) + '\n'
    except (TypeError, ValueError, RecursionError) as error:
        raise JsonFileError(f'the file: expected finite numbers, strings, lists and '
                            f'objects, got what JSON cannot hold ({error})') from None


def _lines(value: object, depth: int) -> str:
    inner, outer = ' ' * (depth + 1), ' ' * depth
    if isinstance(value, dict) and value:
        items = [f'{inner}{_compact(key)}: {_lines(item, depth + 1)}'
                 for key, item in value.items()]
        return '{\n' + ',\n'.join(items) + f'\n{outer}}}'
    if isinstance(value, list | tuple) and any(isinstance(item, dict | list | tuple)
                                               for item in value):
        return '[\n' + ',\n'.join(inner + _compact(item) for item in value) + f'\n{outer}]'
    return _compact(value)


def _compact(value: object) -> str:
    return json.dumps(value, allow_nan=False, ensure_ascii=False)
