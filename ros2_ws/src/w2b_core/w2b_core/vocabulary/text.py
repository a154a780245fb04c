"""From what a person typed to the words that are looked up."""

from __future__ import annotations

import re
import unicodedata

from w2b_core.vocabulary.errors import VocabularyError

#: Longest command, and most words in one: each word primes the network with 300 more elements.
MAX_CHARACTERS = 1000
MAX_WORDS = 16
#: What may stand inside a word: apostrophes, hyphens, dots, and the underscore that joins the
#: phrases of the Google News vectors.
_JOINERS = re.compile(r"['’‘´`.\-‐‑_]")


def tokens(text: str) -> tuple[str, ...]:
    """
    Split a command into its words, without the punctuation around them.

    Raises
    ------
    VocabularyError
        If `text` is no string, too long, or has no words.

    """
    if not isinstance(text, str):
        raise VocabularyError(f'command: expected text, got {type(text).__name__}')
    if len(text) > MAX_CHARACTERS:
        raise VocabularyError(f'command too long: expected at most {MAX_CHARACTERS:,} characters, '
                              f'got {len(text):,}')
    # NFKC makes an ellipsis three dots; like a dash typed as two hyphens, they part words.
    text = re.sub(r'([.\-])\1+', ' ', unicodedata.normalize('NFKC', text))
    # Whatever is neither part of a word nor inside one parts two words.
    parts = ''.join(letter if letter.isalnum() or unicodedata.category(letter) == 'Mn'
                    or _JOINERS.match(letter) or letter == '#' else ' '
                    for letter in text).split()
    words = tuple(word for word in (strip_joiners(part) for part in parts) if word)
    if not words:
        raise VocabularyError("empty command: expected a word, such as 'forward', got "
                              + ('nothing' if not text.strip() else 'no letter or digit'))
    if len(words) > MAX_WORDS:
        raise VocabularyError(f'command too long: expected at most {MAX_WORDS} words, '
                              f'got {len(words)}')
    return words


def strip_joiners(word: str) -> str:
    """Return `word` without apostrophes, hyphens, dots and underscores at its ends."""
    return re.sub(rf'^(?:{_JOINERS.pattern})+|(?:{_JOINERS.pattern})+$', '', word)


def spellings(token: str) -> tuple[str, ...]:
    """Return the spellings under which a vocabulary may know `token`, the likeliest first."""
    lower = token.lower()
    joined = _JOINERS.sub('', lower)
    underscored = _JOINERS.sub('_', lower)
    return tuple(dict.fromkeys((lower, token, joined, underscored, lower.capitalize(),
                                lower.upper())))
