"""From what a person typed to the words that are looked up."""

from __future__ import annotations

import re
import unicodedata

from w2b_core.vocabulary.errors import VocabularyError

#: Longest command, and most words in one: each word primes the network with 300 more elements.
MAX_CHARACTERS = 1000
MAX_WORDS = 16
#: Apostrophes as they are typed: also acute and grave accents, primes, and letters that look so.
_APOSTROPHES = "'’‘‛´`ʼʹ′＇"
#: What may stand inside a word: apostrophes, hyphens (also of Hebrew and Armenian), the dots of
#: abbreviations and of Catalan, Hebrew's quotation marks, and the underscore that joins the
#: phrases of the Google News vectors.
_JOINERS = re.compile(r"['.\-‐‑\u05be\u058a·\u05f3\u05f4_]")
#: Unicode's Default_Ignorable_Code_Point (DerivedCoreProperties.txt): characters that no reader
#: sees, such as the soft hyphen, zero-width spaces and joiners, and variation selectors.
_INVISIBLE = re.compile(
    '[\u00ad\u034f\u061c\u115f\u1160\u17b4\u17b5\u180b-\u180f\u200b-\u200f\u202a-\u202e'
    '\u2060-\u206f\u3164\ufe00-\ufe0f\ufeff\uffa0\ufff0-\ufff8\U0001bca0-\U0001bca3'
    '\U0001d173-\U0001d17a\U000e0000-\U000e0fff'
    # And controls, but white space and NUL, which part words.
    '\u0001-\u0008\u000e-\u001b\u007f-\u0084\u0086-\u009f\ufff9-\ufffb]')


def tokens(text: str) -> tuple[str, ...]:
    """
    Split a command into its words, without the punctuation around them.

    Letters, digits and the marks on them make words, in any script. Invisible characters are
    dropped: a word that holds one stays that word.

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
    if damaged := re.search('[\ud800-\udfff\ufffd]', text):
        raise VocabularyError('command: expected text in UTF-8, got other bytes, which stand as '
                              f'U+{ord(damaged[0]):04X} at character {damaged.start() + 1}')
    # NFKC makes an ellipsis three dots; like a dash typed as two hyphens, they part words.
    text = re.sub(r'([.\-])\1+', ' ', normalized(text))
    # Whatever is neither part of a word nor inside one parts two words.
    parts = ''.join(letter if _in_word(letter) else ' ' for letter in text).split()
    words = tuple(word for word in (strip_joiners(part) for part in parts) if word)
    if not words:
        raise VocabularyError("empty command: expected a word, such as 'forward', got "
                              + ('nothing' if not text.strip() else 'no letter or digit'))
    if len(words) > MAX_WORDS:
        raise VocabularyError(f'command too long: expected at most {MAX_WORDS} words, '
                              f'got {len(words)}')
    return words


def normalized(text: str) -> str:
    """Return `text` in Unicode's form NFKC, with one apostrophe, without invisible characters."""
    if text.isascii() and text.isprintable():
        return text.replace('`', "'")
    # First the apostrophes: NFKC makes an acute accent a space with a mark on it. Invisible
    # characters both before, as they keep a letter from its mark, and after: NFKC makes some.
    text = re.sub(f'[{_APOSTROPHES}]', "'", _INVISIBLE.sub('', text))
    return _INVISIBLE.sub('', unicodedata.normalize('NFKC', text))


def _in_word(letter: str) -> bool:
    return letter.isalnum() or letter == '#' or bool(_JOINERS.match(letter)) \
        or unicodedata.category(letter)[0] == 'M'


def strip_joiners(word: str) -> str:
    """
    Return `word` without apostrophes, hyphens, dots and underscores at its ends.

    Nor does a word begin with marks: those of a character that is in no word are left over.
    """
    end = len(word)
    while end and _JOINERS.match(word[end - 1]):
        end -= 1
    start = 0
    while start < end and (_JOINERS.match(word[start])
                           or unicodedata.category(word[start])[0] == 'M'):
        start += 1
    return word[start:end]


def folded(word: str) -> str:
    """Return what all spellings of `word` share that differ in case or encoding only."""
    return normalized(word).lower()


def spellings(token: str) -> tuple[str, ...]:
    """Return the spellings under which a vocabulary may know `token`, the likeliest first."""
    lower = token.lower()
    joined = _JOINERS.sub('', lower)
    underscored = _JOINERS.sub('_', lower)
    return tuple(dict.fromkeys((lower, token, joined, underscored, lower.capitalize(),
                                lower.upper())))
