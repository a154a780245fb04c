"""
YAML as people read it: what looks like a whole number is one, and nothing else is anything else.

YAML 1.1 reads `010` as 8, `1:30` as 90, `1_0` as 10, `yes` as true, and keeps the last of a key
that is given twice. In a file that moves servos each of these is a mistake: here they are text,
which no number may be, or an error.
"""

from __future__ import annotations

import re
from typing import Any

import yaml


class _PlainLoader(yaml.SafeLoader):
    """Whole numbers, decimal fractions, true and false, text, lists, and mappings of text."""

    # Not the inherited resolvers: those belong to all loaders.
    yaml_implicit_resolvers: dict[str, list[Any]] = {}

    def compose_node(self, parent: Any, index: Any) -> Any:
        event: Any = self.peek_event()
        line = event.start_mark.line + 1
        if isinstance(event, yaml.AliasEvent) or event.anchor is not None:
            raise yaml.YAMLError(f'line {line}: expected no anchors and aliases')
        if event.tag is not None:
            raise yaml.YAMLError(f'line {line}: expected no tags, got {event.tag}')
        return super().compose_node(parent, index)

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Any, Any]:
        seen: set[str] = set()
        for key, _ in node.value:
            line = key.start_mark.line + 1
            if not isinstance(key, yaml.ScalarNode) or key.tag != 'tag:yaml.org,2002:str':
                raise yaml.YAMLError(f'line {line}: expected a name before the colon')
            if key.value in seen:
                raise yaml.YAMLError(f'line {line}: {key.value} is given twice')
            seen.add(key.value)
        # SafeLoader would look for merge keys; here there are none.
        return yaml.constructor.BaseConstructor.construct_mapping(self, node, deep=deep)

    def _mapping(self, node: Any) -> dict[Any, Any]:
        return self.construct_mapping(node, deep=True)


for _tag, _pattern, _first in (
        ('int', r'-?(0|[1-9][0-9]{0,17})', '-0123456789'),
        ('float', r'-?(0|[1-9][0-9]*)\.[0-9]*([eE][-+]?[0-9]{1,3})?', '-0123456789'),
        ('bool', 'true|false', 'tf')):
    _PlainLoader.add_implicit_resolver(
        f'tag:yaml.org,2002:{_tag}', re.compile(f'^(?:{_pattern})$'), list(_first))
_PlainLoader.add_constructor('tag:yaml.org,2002:map', _PlainLoader._mapping)


def load(text: str) -> Any:
    """
    Return what one document holds.

    Raises
    ------
    yaml.YAMLError
        If it is no YAML, holds more than one document, a key twice, a key that is no name, an
        anchor, an alias or a tag; the first line says where.

    """
    # Derived from SafeLoader, with less.
    return yaml.load(text, Loader=_PlainLoader)
