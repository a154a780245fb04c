"""
The vocabulary: words -> word2vec vectors.

`Vocabulary.load()` opens the words that come with the program; `vocabulary install` adds more.
"""

from w2b_core.vocabulary.errors import (
    UnknownWordError,
    VocabularyError,
    VocabularyFileError,
)
from w2b_core.vocabulary.lookup import Phrase, Vocabulary
from w2b_core.vocabulary.text import MAX_CHARACTERS, MAX_WORDS

__all__ = ['MAX_CHARACTERS', 'MAX_WORDS', 'Phrase', 'UnknownWordError', 'Vocabulary',
           'VocabularyError', 'VocabularyFileError']
