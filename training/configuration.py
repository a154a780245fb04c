"""
Configurations as data: YAML that is read strictly, and pydantic models whose errors are one line.

An error says which field is wrong, what was expected there and what came.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields, is_dataclass
from difflib import get_close_matches
from functools import wraps
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_args

import yaml
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
)

from w2b_core import bodies
from w2b_sim.worlds import WORLDS

#: No count of anything is larger; without a bound a slip of the finger hangs.
MOST = 1_000_000

#: Unknown fields are refused.
STRICT = ConfigDict(extra='forbid')
Settings = TypeVar('Settings')

Count = Annotated[int, Field(ge=1, le=100_000)]
Positive = Annotated[float, Field(gt=0, lt=1e6)]
NotNegative = Annotated[float, Field(ge=0, lt=1e6)]
Share = Annotated[float, Field(ge=0, le=1)]
Seed = Annotated[int, Field(ge=0, lt=2**31)]


def _body(name: str) -> str:
    bodies.check(name)
    return name


#: A registered body, or a file that describes one.
BodyName = Annotated[str, AfterValidator(_body)]


def world_of(world: str, body: str) -> str:
    """Return the name of a world, or of the body's own if it is empty (ValueError if unknown)."""
    name = world or bodies.get(body).world
    if name not in WORLDS:
        raise ValueError(f'world: expected one of {", ".join(WORLDS)}, got {name!r}')
    return name


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


def read_recipe(path: Path) -> dict[str, Any]:
    """Return the fields of a YAML file (ConfigError, with its name, if it has none)."""
    try:
        content = read_yaml(path.read_text(encoding='utf-8'))
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f'{path}: not a readable recipe ({error})') from None
    except ConfigError as error:
        raise ConfigError(f'{path}: {error}') from None
    if not isinstance(content, dict):
        raise ConfigError(f'{path}: expected a mapping of fields, got {content!r}')
    return content


def one_line(top: str) -> Callable[[type[Settings]], type[Settings]]:
    """
    Return a decorator of a pydantic dataclass: what is wrong is a `ConfigError` of one line.

    `top` is what the whole is called in messages.
    """
    def decorate(cls: type[Settings]) -> type[Settings]:
        made: Any = cls
        validated = made.__init__

        @wraps(validated)
        def init(self: object, *args: Any, **fields: Any) -> None:
            try:
                validated(self, *args, **fields)
            except ValidationError as error:
                raise ConfigError(explain(error, cls, top)) from None

        made.__init__ = init
        return cls
    return decorate


def whole(least: int = 1, most: int = MOST) -> BeforeValidator:
    """Return the check of an integer from `least` to `most`, or of None where that is allowed."""
    def check(value: object) -> object:
        if value is None:
            return value
        if isinstance(value, bool) or not isinstance(value, int) or value < least:
            raise ValueError(f'expected an integer >= {least}, got {value!r}')
        if value > most:
            raise ValueError(f'expected an integer <= {most:,}, got {value:,}')
        return value
    return BeforeValidator(check)


def one_of(choices: Callable[[], Sequence[str]]) -> BeforeValidator:
    """Return the check of a text that is one of `choices()`, which is asked at each check."""
    def check(value: object) -> object:
        known = tuple(choices())
        if value not in known:
            raise ValueError(f'expected one of {", ".join(known)}, got {value!r}'
                             f'{near(str(value), known)}')
        return value
    return BeforeValidator(check)


def some_of(choices: Callable[[], Sequence[str]]) -> BeforeValidator:
    """Return the check of a list of different `choices()`, at least one."""
    one = one_of(choices)

    def check(value: object) -> object:
        if not isinstance(value, list | tuple) or not value:
            raise ValueError(f'expected a list of {", ".join(choices())}, got {value!r}')
        for item in value:
            one.func(item)  # type: ignore[call-arg]
        if len(set(value)) < len(value):
            raise ValueError(f'expected each name once, got {", ".join(value)}')
        return value
    return BeforeValidator(check)


def _text(value: object) -> object:
    if not isinstance(value, str) or not value:
        raise ValueError(f'expected text, got {value!r}')
    return value


def _truth(value: object) -> object:
    if not isinstance(value, bool):
        raise ValueError(f'expected true or false, got {value!r}')
    return value


Text = Annotated[str, BeforeValidator(_text)]
Truth = Annotated[bool, BeforeValidator(_truth)]


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
                f'{found["expected_tags"]}, got {found["tag"]!r}')
    if kind == 'too_short':
        return (f'{field}: expected at least {first["ctx"]["min_length"]}, got '
                f'{first["ctx"]["actual_length"]}')
    if kind in ('dataclass_type', 'model_type', 'model_attributes_type', 'dict_type'):
        return f'{field}: expected a mapping of fields to values, got {first["input"]!r}'
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
