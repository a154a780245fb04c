"""
Making the default vocabulary, which is part of the program, from the installed source.

It has all words of the source, in two parts, each in the source's order:

1. With the original vectors, as float16, `WORDS` words of lower-case letters only, whose vectors'
   lengths are certain: those of `vocabularies/behaviour_words.txt` (the paper's words and what
   people would say to a robot instead), filled up with the most frequent ones.
2. With vectors in 6 bits an element (see `coding`), the others.

The first part never changes: controllers carry the hashes of the vectors that they were evolved
with.
"""

from __future__ import annotations

from importlib import resources
from pathlib import Path

import numpy as np

from w2b_core.vocabulary import coding, store
from w2b_core.vocabulary.errors import VocabularyError
from w2b_core.vocabulary.install import UNCERTAIN

#: With the original vectors: 3.6 MB. The others take 4.6 MB.
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
        Number of words with the original vectors.

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
    rest = sorted(set(range(len(words))) - set(chosen))
    names = [words[index] for index in chosen + rest]
    # The source's own vectors, whose file is an array of float16.
    originals = np.asarray(vectors)
    store.write_folder(folder, store.About(
        store.DEFAULT, len(names), about.dimensions, about.source, about.source_sha256,
        about.norms.replace(UNCERTAIN, f'{UNCERTAIN} of {about.name}'),
        'all words: first behaviour words and the most frequent ones with the original vectors, '
        'then the others, coded', coded_words=len(rest), coding=coding.NORMAL_6_BIT),
        names, originals[chosen], coding.encode(originals[rest]))
    return sorted(wanted - set(names))
