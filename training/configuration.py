"""
Configurations as data: YAML that is read strictly, and pydantic models whose errors are one line.

An error says which field is wrong, what was expected there and what came.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields, is_dataclass
from difflib import get_close_matches
from typing import Annotated, Any, get_args

import yaml
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

#: No count of anything is larger; without a bound a slip of the finger hangs.
MOST = 1_000_000

#: Unknown fields are refused; what is checked stays as it is.
STRICT = ConfigDict(extra='forbid')

Count = Annotated[int, Field(ge=1, le=100_000)]
Positive = Annotated[float, Field(gt=0, lt=1e6)]
NotNegative = Annotated[float, Field(ge=0, lt=1e6)]
Share = Annotated[float, Field(ge=0, le=1)]
Seed = Annotated[int, Field(ge=0, lt=2**31)]


class ConfigError(ValueError):
    """A configuration that cannot be run; the message says where and what to write."""


class Strict(BaseModel):
    """A part of a configuration: unknown fields are refused, values are not changed."""

    model_config = ConfigDict(extra='forbid', frozen=True)


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


def whole(least: int = 1) -> Any:
    """Return the type of whole numbers from `least` to `MOST`."""
    def check(value: object) -> object:
        if isinstance(value, bool) or not isinstance(value, int) or value < least:
            raise ValueError(f'expected a whole number of at least {least}, got {value!r}')
        if value > MOST:
            raise ValueError(f'expected a whole number of at most {MOST:,}, got {value:,}')
        return value
    return Annotated[int, BeforeValidator(check)]


def one_of(choices: Callable[[], Sequence[str]]) -> Any:
    """Return the type of texts that are one of `choices()`, which is asked at each check."""
    def check(value: object) -> object:
        known = tuple(choices())
        if value not in known:
            raise ValueError(f'expected one of {", ".join(known)}; got {value!r}'
                             f'{near(str(value), known)}')
        return value
    return Annotated[str, BeforeValidator(check)]


def near(value: str, choices: Sequence[str]) -> str:
    """Return a hint at the choice whose spelling is nearest to `value`, or ''."""
    close = get_close_matches(value, choices, 1)
    return f' (did you mean {close[0]!r}?)' if close else ''


def explain(error: ValidationError, model: Any, top: str) -> str:
    """
    Return the first error in one line: the field, what was expected, what came.

    Parameters
    ----------
    error
        Of the validation.
    model
        What was validated against.
    top
        What the whole is called where no field is to blame.

    """
    first = error.errors()[0]
    where, kind = first['loc'], first['type']
    if kind == 'missing':
        return f'{place(where[:-1]) or top}: the field {str(where[-1])!r} is missing'
    if kind in ('extra_forbidden', 'unexpected_keyword_argument'):
        name = str(where[-1])
        return (f'{place(where[:-1]) or top}: unknown field {name!r}'
                f'{near(name, _names(model, where[:-1]))}')
    field = place(where) or top
    if kind == 'value_error':
        message = str(first['ctx']['error'])
        # What is said of the whole names its field itself.
        return message if not where or message.startswith(f'{field}: ') else f'{field}: {message}'
    if kind == 'union_tag_invalid':
        found = first['ctx']
        return (f'{field}.{found["discriminator"].strip(chr(39))}: expected one of '
                f'{found["expected_tags"]}; got {found["tag"]!r}')
    if kind == 'too_short':
        return (f'{field}: expected at least {first["ctx"]["min_length"]}, got '
                f'{first["ctx"]["actual_length"]}')
    expected = first['msg'].removeprefix('Input should be ')
    if expected.startswith(('greater', 'less')):
        expected = f'a number {expected}'
    return f'{field}: expected {expected}, got {first["input"]!r}'


def place(where: Sequence[int | str]) -> str:
    """Return the place of a field: `experiments[0].seeds`."""
    return ''.join(f'[{part}]' if isinstance(part, int) else f'.{part}'
                   for part in where).removeprefix('.')


def _names(model: Any, where: Sequence[int | str]) -> list[str]:
    """Return the names of the fields of the model at a place within `model`."""
    for part in where:
        if isinstance(part, str):
            model = _types(model).get(part, model)
        model = _model_in(model)
    return list(_types(_model_in(model)))


def _types(model: Any) -> dict[str, Any]:
    if isinstance(model, type) and issubclass(model, BaseModel):
        return {name: info.annotation for name, info in model.model_fields.items()}
    if is_dataclass(model):
        return {field.name: model.__pydantic_fields__[field.name].annotation  # type: ignore[union-attr]
                for field in fields(model)}
    return {}


def _model_in(kind: Any) -> Any:
    """Return the model in a type such as tuple[Model, ...]; the type itself if there is none."""
    if _types(kind):
        return kind
    return next((found for part in get_args(kind) if _types(found := _model_in(part))), kind)
