"""What can go wrong between a word and its vector; each message is one line."""


class VocabularyError(ValueError):
    """A command that cannot be turned into vectors, or a vocabulary that cannot be used."""


class VocabularyFileError(VocabularyError):
    """A file or folder of word vectors is missing, damaged or of another kind."""


class UnknownWordError(VocabularyError):
    """
    The vocabulary lacks a word.

    Attributes
    ----------
    word
        As it was looked up.
    suggestions
        The known words that are spelt most like it, the likeliest first; may be empty.

    """

    def __init__(self, word: str, suggestions: tuple[str, ...], source: str) -> None:
        self.word = word
        self.suggestions = suggestions
        hint = (f'did you mean {" or ".join(map(repr, suggestions))}?' if suggestions
                else 'no known word is spelt like it')
        super().__init__(f'unknown word {word!r}: expected a word of the vocabulary {source}; '
                         f'{hint}')
