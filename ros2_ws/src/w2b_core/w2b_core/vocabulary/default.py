"""
Making the default vocabulary, which is part of the program, from the installed source.

Rule: of the source's words of lower-case letters only, whose vectors' lengths are certain, the
words of `vocabularies/behaviour_words.txt` (the paper's words and what people would say to a robot
instead), filled up with the most frequent ones to `WORDS`. All in the source's order.
"""

from __future__ import annotations

from importlib import resources
from pathlib import Path

from w2b_core.vocabulary import store
from w2b_core.vocabulary.errors import VocabularyError
from w2b_core.vocabulary.install import UNCERTAIN

#: So many float16 vectors of 300 elements, with the words, stay below 4 MB.
WORDS = 6000


def behaviour_words() -> tuple[str, ...]:
    """Return the words that the default vocabulary should have, whatever their frequency."""
    file = resources.files('w2b_core') / 'vocabularies' / 'behaviour_words.txt'
    lines = file.read_text(encoding='utf-8').splitlines()
    return tuple(word for line in lines if not line.startswith('#') for word in line.split())


def make_default(source: Path, folder: Path, count: int = WORDS) -> list[str]:
    """
    Write the default vocabulary into the new folder `folder`.

    Parameters
    ----------
    source
        Folder of the installed vocabulary 'bolukbasi'.
    folder
        To be written.
    count
        Number of words.

    Returns
    -------
    The behaviour words that the source lacks.

    """
    about, words, vectors = store.read_folder(source)
    uncertain = set((source / UNCERTAIN).read_text(encoding='utf-8').split())
    usable = [index for index, word in enumerate(words)
              if word.isascii() and word.isalpha() and word.islower() and word not in uncertain]
    wanted = set(behaviour_words())
    chosen = [index for index in usable if words[index] in wanted]
    if not len(chosen) <= count <= len(usable):
        raise VocabularyError(f'expected {len(chosen):,} to {len(usable):,} words, got {count:,}')
    others = [index for index in usable if words[index] not in wanted]
    chosen = sorted(chosen + others[:count - len(chosen)])
    try:
        folder.mkdir(parents=True)
    except OSError as error:
        raise VocabularyError(f'{folder}: expected to make a new folder, got '
                              f'{error.strerror or error}') from None
    names = [words[index] for index in chosen]
    store.write_folder(folder, store.About(
        store.DEFAULT, count, about.dimensions, about.source, about.source_sha256,
        'restored from unit length', 'behaviour words and the most frequent ones'),
        names, vectors[chosen])
    return sorted(wanted - set(names))
