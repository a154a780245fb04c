"""
The lexicon: which words ask for which behaviour, and what only looks like a command.

A YAML or JSON file; the shipped `lexicon.yaml` documents the format. Reading trusts nothing: a word
twice, a word in two classes or a family across classes is a `LexiconError` that names it. Words are
read in lower case.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import yaml

SHIPPED = Path(__file__).with_name('lexicon.yaml')
#: What accuracy is measured over where a file does not say.
SCORED = ('stop', 'forward', 'backward')
KINDS = ('plain', 'negated', 'irrelevant')
#: The label of phrases that ask for nothing.
NONE = 'none'
FIELDS = ('words', 'behaviours', 'scored', 'held_out', 'near_miss', 'common', 'random',
          'excluded', 'phrases')
#: What a file may say of itself; not read.
ABOUT = ('name', 'title', 'description', 'version', 'author', 'source', 'license', 'notes')
LARGEST_BYTES = 20_000_000


class LexiconError(ValueError):
    """A lexicon that cannot be judged; the message names the word and what was expected."""


@dataclass(frozen=True)
class Entry:
    """What a word asks for, and the stem that it shares with others."""

    behaviour: str
    family: str


@dataclass(frozen=True)
class TestPhrase:
    """A sentence, the behaviour it asks for (or `NONE`) and its kind (see `KINDS`)."""

    __test__ = False  # not a test of pytest's

    text: str
    label: str
    kind: str


@dataclass(frozen=True)
class Lexicon:
    """See the module; `excluded` holds words without their reasons."""

    words: Mapping[str, Entry]
    scored: tuple[str, ...] = SCORED
    held_out: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    near_miss: tuple[str, ...] = ()
    common: tuple[str, ...] = ()
    random: tuple[str, ...] = ()
    excluded: tuple[str, ...] = ()
    phrases: tuple[TestPhrase, ...] = ()

    @property
    def behaviours(self) -> tuple[str, ...]:
        """The classes of the words: the scored ones, then the others as they come."""
        return tuple(dict.fromkeys((*self.scored,
                                    *(entry.behaviour for entry in self.words.values()))))

    def of(self, behaviour: str) -> dict[str, list[str]]:
        """Return the families of a behaviour, each with its words."""
        families: dict[str, list[str]] = {}
        for word, entry in self.words.items():
            if entry.behaviour == behaviour:
                families.setdefault(entry.family, []).append(word)
        return families

    def held_out_words(self) -> dict[str, list[str]]:
        """Return the words of the held-out families of each behaviour."""
        return {behaviour: [word for family in families for word in self.of(behaviour)[family]]
                for behaviour, families in self.held_out.items()}

    def only_scored(self) -> Lexicon:
        """Return the lexicon of the scored behaviours; nothing is claimed about other words."""
        words = {word: entry for word, entry in self.words.items()
                 if entry.behaviour in self.scored}
        others = tuple(word for word in self.words if word not in words)
        return replace(self, words=words, excluded=(*self.excluded, *others), held_out={
            name: found for name, found in self.held_out.items() if name in self.scored})

    def unknown(self, known: Collection[str]) -> tuple[str, ...]:
        """Return what a vocabulary lacks of all words, in their order."""
        return tuple(word for word in dict.fromkeys((
            *self.words, *self.near_miss, *self.common, *self.random)) if word not in known)

    def within(self, known: Collection[str]) -> Lexicon:
        """Return what of the lexicon a vocabulary knows (LexiconError if too little)."""
        def only(words: tuple[str, ...]) -> tuple[str, ...]:
            return tuple(word for word in words if word in known)
        words = {word: entry for word, entry in self.words.items() if word in known}
        found = Lexicon(words, self.scored, self.held_out, only(self.near_miss),
                        only(self.common), only(self.random), only(self.excluded), self.phrases)
        for behaviour in self.scored:
            if len(found.of(behaviour)) < 2:
                raise LexiconError(f'{behaviour}: expected two or more stem families that the '
                                   f'vocabulary knows, got {len(found.of(behaviour))}')
        return found


def load(path: Path = SHIPPED) -> Lexicon:
    """
    Return the lexicon in a YAML or JSON file.

    Raises
    ------
    LexiconError
        If the file is missing, damaged or contradicts itself.

    """
    try:
        if path.stat().st_size > LARGEST_BYTES:
            raise LexiconError(f'{path}: expected at most {LARGEST_BYTES:,} bytes')
        text = path.read_text(encoding='utf-8')
        value = (json.loads(text, object_pairs_hook=_unique) if path.suffix == '.json'
                 else yaml.load(text, _Loader))
    except OSError as error:
        raise LexiconError(f'{path}: expected a lexicon, got {error.strerror or error}') from None
    except UnicodeDecodeError:
        raise LexiconError(f'{path}: expected UTF-8 text, got other bytes') from None
    except (json.JSONDecodeError, yaml.YAMLError, RecursionError) as error:
        raise LexiconError(f'{path}: expected YAML or JSON, got a damaged file '
                           f'({" ".join(str(error).split())[:150]})') from None
    except LexiconError as error:
        raise LexiconError(f'{path}: {error}') from None
    try:
        return parse(value)
    except LexiconError as error:
        raise LexiconError(f'{path}: {error}') from None


def parse(value: object) -> Lexicon:
    """Return the lexicon that a file's value describes (LexiconError if it is damaged)."""
    fields = _mapping(value, 'the file')
    for name in fields:
        if name not in (*FIELDS, *ABOUT):
            raise LexiconError(f'{name!s:.40}: expected one of {", ".join(FIELDS)}, got '
                               'an unknown field')
    words: dict[str, Entry] = {}
    classes: dict[str, str] = {}
    for word, entry in _mapping(fields.get('words'), 'words').items():
        entry = _mapping(entry, f'words.{word}')
        behaviour, family = (_text(entry.get(key), f'words.{word}.{key}')
                             for key in ('class', 'family'))
        if classes.setdefault(family, behaviour) != behaviour:
            raise LexiconError(f'family {family!r}: expected one class, got {classes[family]!r} '
                               f'and {behaviour!r} (of {word!r})')
        lower = _lower(_text(word, 'words'))
        if lower in words:
            raise LexiconError(f'word {lower!r}: expected it once, got it twice')
        words[lower] = Entry(behaviour, family)
    scored = _texts(fields.get('scored') or list(SCORED), 'scored')
    lists = {name: _words(fields.get(name) or [], name)
             for name in ('near_miss', 'common', 'random')}
    excluded = _excluded(fields.get('excluded') or [])
    for name in ('common', 'random'):  # drawn by frequency or by chance: a command is none of them
        lists[name] = tuple(word for word in lists[name] if word not in words)
    for name, others in (('near_miss', lists['near_miss']), ('excluded', excluded)):
        for word in others:
            if word in words:
                raise LexiconError(f'word {word!r}: expected it once, got it in {name} and in the '
                                   f'class {words[word].behaviour!r}')
    lexicon = Lexicon(words, scored, _held_out(fields.get('held_out') or {}), excluded=excluded,
                      phrases=_phrases(fields.get('phrases') or []), **lists)
    for behaviour, families in lexicon.held_out.items():
        for family in families:
            if family not in lexicon.of(behaviour):
                raise LexiconError(f'held_out.{behaviour}: expected families of {behaviour}, got '
                                   f'{family!r}')
    for behaviour in scored:
        if not lexicon.of(behaviour):
            raise LexiconError(f'words: expected some of the class {behaviour!r}, got none')
    return lexicon


def _excluded(value: object) -> tuple[str, ...]:
    """Return the words of `excluded`: plain, each with a reason, or in groups with a reason."""
    if isinstance(value, dict):
        value = list(value)
    if not isinstance(value, list):
        raise LexiconError(f'excluded: expected a list, got {type(value).__name__}')
    groups = [_texts(entry.get('words'), 'excluded.words') if isinstance(entry, dict)
              else (_text(entry, 'excluded'),) for entry in value]
    return tuple(_lower(word) for group in groups for word in group)


def _held_out(value: object) -> dict[str, tuple[str, ...]]:
    return {_text(behaviour, 'held_out'): _texts(families, f'held_out.{behaviour}')
            for behaviour, families in _mapping(value, 'held_out').items()}


def _phrases(value: object) -> tuple[TestPhrase, ...]:
    if not isinstance(value, list):
        raise LexiconError(f'phrases: expected a list, got {type(value).__name__}')
    found = []
    for index, entry in enumerate(value):
        name = f'phrases[{index}]'
        fields = _mapping(entry, name)
        text, label, kind = (_text(fields.get(key), f'{name}.{key}')
                             for key in ('text', 'label', 'kind'))
        if kind not in KINDS:
            raise LexiconError(f'{name}.kind: expected {", ".join(KINDS)}, got {kind!r:.40}')
        found.append(TestPhrase(text, label, kind))
    return tuple(found)


def _mapping(value: object, name: str) -> dict[Any, Any]:
    if not isinstance(value, dict):
        raise LexiconError(f'{name}: expected names with values, got '
                           f'{"nothing" if value is None else type(value).__name__}')
    return value


def _text(value: object, name: str) -> str:
    if not isinstance(value, str) or not value.strip():
        raise LexiconError(f'{name}: expected a word, got {value!r:.40} (YAML reads on, off, yes, '
                           'no and numbers as other things: quote them)')
    return value


def _texts(value: object, name: str) -> tuple[str, ...]:
    if not isinstance(value, list):
        raise LexiconError(f'{name}: expected a list of words, got {type(value).__name__}')
    words = tuple(_text(word, name) for word in value)
    if len(set(words)) < len(words):
        double = next(word for index, word in enumerate(words) if word in words[:index])
        raise LexiconError(f'{name}: expected every word once, got {double!r} twice')
    return words


def _words(value: object, name: str) -> tuple[str, ...]:
    """Return a list of words in lower case."""
    return _texts([_lower(_text(word, name)) for word in value]
                  if isinstance(value, list) else value, name)


def _lower(word: str) -> str:
    return word.strip().lower()


def _unique(pairs: list[tuple[str, object]]) -> dict[str, object]:
    found: dict[str, object] = {}
    for key, value in pairs:
        if key in found:
            raise LexiconError(f'{key!r:.60}: expected once, got it twice')
        found[key] = value
    return found


class _Loader(yaml.SafeLoader):
    """
    YAML's safe loader, for which all scalars are text: *on*, *no* and *null* are words.

    It refuses a key twice: a word would silently change its class.
    """

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        keys = [key.value for key, _value in node.value]
        for index, key in enumerate(keys):
            if isinstance(key, str) and key in keys[:index]:
                raise LexiconError(f'{key!r:.60}: expected once, got it twice (line '
                                   f'{node.value[index][0].start_mark.line + 1})')
        return super().construct_mapping(node, deep)


_Loader.yaml_implicit_resolvers = {}
