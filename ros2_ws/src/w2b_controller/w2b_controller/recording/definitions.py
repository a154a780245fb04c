"""Definitions of message types as MCAP holds them: a text with those of all it is made of."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache
from pathlib import Path

SEPARATOR = '=' * 80
#: A field of another message type: `Header header`, `geometry_msgs/Point[3] corners`.
_FIELD = re.compile(r'^\s*(?:([a-z][a-z0-9_]*)/)?([A-Z][A-Za-z0-9]*)(?:\[[^\]]*\])?\s+[a-z]')


class DefinitionError(ValueError):
    """A message type whose definition is not installed; one line says which."""


@cache
def installed(name: str) -> str:
    """Return the text of an installed message type, such as `std_msgs/msg/String`."""
    from ament_index_python.packages import PackageNotFoundError, get_package_share_directory
    package, _, message = name.partition('/msg/')
    try:
        path = Path(get_package_share_directory(package)) / 'msg' / f'{message}.msg'
        return path.read_text(encoding='utf-8')
    except (PackageNotFoundError, OSError, ValueError) as error:
        raise DefinitionError(f'{name}: expected its definition in an installed package, got none'
                              ) from error


def definition(name: str, text_of: Callable[[str], str] = installed) -> str:
    """
    Return the full definition of a message type (schema encoding `ros2msg`).

    Parameters
    ----------
    name
        Type, such as `sensor_msgs/msg/JointState`.
    text_of
        Returns the text of one type.

    Raises
    ------
    DefinitionError
        If the definition of a type is not installed.

    """
    texts: dict[str, str] = {}
    todo = [name]
    while todo:
        one = todo.pop(0)
        if one in texts:
            continue
        texts[one] = text_of(one)
        todo += parts(one, texts[one])
    first, *others = texts
    return '\n'.join([texts[first], *(
        f'{SEPARATOR}\nMSG: {other.replace("/msg/", "/")}\n{texts[other]}' for other in others)])


def parts(name: str, text: str) -> list[str]:
    """Return the message types that a type's fields have."""
    own, found = name.partition('/')[0], []
    for line in text.splitlines():
        match = _FIELD.match(line.partition('#')[0])
        if match:
            found.append(f'{match[1] or own}/msg/{match[2]}')
    return found
