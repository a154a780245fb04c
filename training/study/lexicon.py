"""
Words that no run was trained on, by what they ask for: `lexicon.yaml`, which says how it was made.

A champion that stops for half of all words is right on half of the stop words by chance. So the
lexicon holds synonyms of each behaviour and, beside them, unrelated words.
"""

from __future__ import annotations

from hashlib import sha256
from pathlib import Path

from training.configuration import ConfigError, read_yaml
from training.evolution.treatments import WORD_SETS

PATH = Path(__file__).parent / 'lexicon.yaml'
CLASSES = ('forward', 'backward', 'stop', 'unrelated')


def load_lexicon(path: Path = PATH) -> dict[str, tuple[str, ...]]:
    """
    Return class -> words, in the file's order.

    Raises
    ------
    ConfigError
        If the file is not readable, a class is missing, or a word stands twice or is a command of
        the study (those are scored in their own right).

    """
    try:
        data = read_yaml(path.read_text(encoding='utf-8'))
    except (OSError, UnicodeDecodeError, ConfigError) as error:
        raise ConfigError(f'{path}: cannot be read: {" ".join(str(error).split())}') from None
    classes = data.get('words') if isinstance(data, dict) else None
    if not isinstance(classes, dict) or set(classes) != set(CLASSES):
        raise ConfigError(f'{path}: words: expected the classes {", ".join(CLASSES)}')
    commands = {word for always, stops in WORD_SETS.values() for word, _ in always + stops}
    seen: set[str] = set()
    for word_class in CLASSES:
        for word in classes[word_class]:
            if not isinstance(word, str):
                raise ConfigError(f'{path}: words.{word_class}: expected text, got {word!r}; '
                                  'YAML takes on, off, yes and no for truth values: quote them')
            if word in seen or word in commands:
                raise ConfigError(f'{path}: words.{word_class}: {word!r} stands twice, or is a '
                                  'command of the study')
            seen.add(word)
    return {word_class: tuple(classes[word_class]) for word_class in CLASSES}


def lexicon_sha256(lexicon: dict[str, tuple[str, ...]]) -> str:
    """Return the hash of a lexicon's words."""
    return sha256(repr(sorted(lexicon.items())).encode()).hexdigest()
