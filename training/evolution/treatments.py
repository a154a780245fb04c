"""
Which words a run trains on, and what their vectors are.

Word sets are the study's; treatments say what happens to the vectors: `experimental` leaves them as
they are, `control` shuffles each word's vector by its own permutation, once a run (paper, section
II-G). All draws come from the run's seed alone, so any process repeats them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from hashlib import sha256
from zlib import crc32

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Words = tuple[tuple[str, str], ...]

TREATMENTS = ('experimental', 'control')

#: Branches of a run's seed: what is drawn for one purpose never moves what another draws.
EVOLUTION, HELD_OUT, PERMUTATION, STARTS, VARIATIONS, GATE = range(6)

#: Word set -> (always trained on, of these one a run is held out). Paper, sections II-A and III.
#: The paper's balanced set trains on the misspelling `foward`, which the package behind the default
#: vocabulary left out: `balanced` has `forwards` in its place, `balanced_paper` is to the letter
#: and asks for a vocabulary that knows it, such as the full Google News embedding.
WORD_SETS: dict[str, tuple[Words, Words]] = {
    'paper': ((('forward', 'forward'), ('backward', 'backward')),
              tuple((word, 'stop') for word in ('stop', 'cease', 'suspend', 'halt'))),
    **{name: ((('forward', 'forward'), (other, 'forward'),
               ('backward', 'backward'), ('backwards', 'backward')),
              tuple((word, 'stop') for word in ('stop', 'cease', 'suspend')))
       for name, other in (('balanced', 'forwards'), ('balanced_paper', 'foward'))},
}


def generator(seed: int, branch: int, *keys: int) -> np.random.Generator:
    """Return the generator of one purpose (`EVOLUTION`, ...) of the run with `seed`."""
    return np.random.Generator(np.random.PCG64(
        np.random.SeedSequence(seed, spawn_key=(branch, *keys))))


def draw_words(word_set: str, seed: int) -> tuple[Words, Words]:
    """
    Return (trained words, held-out words) of a run, each word with the behaviour it asks for.

    One of the set's stop words is drawn to be held out.

    Raises
    ------
    ValueError
        If there is no such word set.

    """
    if seed < 0:
        raise ValueError(f'seed: expected an integer >= 0, got {seed}')
    if word_set not in WORD_SETS:
        raise ValueError(f'word set: expected one of {", ".join(WORD_SETS)}, got {word_set!r}')
    always, stops = WORD_SETS[word_set]
    chosen = int(generator(seed, HELD_OUT).integers(len(stops)))
    return always + stops[:chosen] + stops[chosen + 1:], (stops[chosen],)


def permutation(seed: int, word: str, length: int) -> NDArray[np.int64]:
    """Return the control treatment's permutation (length,) for `word` in the run with `seed`."""
    return generator(seed, PERMUTATION, crc32(word.encode())).permutation(length)


def treated(vectors: Mapping[str, ArrayLike], words: Iterable[str], treatment: str,
            seed: int) -> Array:
    """
    Return the vectors (W, T) of `words` as a run under `treatment` hears them.

    Raises
    ------
    ValueError
        If there is no such treatment.

    """
    if treatment not in TREATMENTS:
        raise ValueError(f'treatment: expected one of {", ".join(TREATMENTS)}, got {treatment!r}')
    rows = []
    for word in words:
        vector = np.asarray(vectors[word], dtype=np.float64)
        if treatment == 'control':
            vector = vector[permutation(seed, word, len(vector))]
        rows.append(vector)
    return np.array(rows)


def vector_hash(vector: ArrayLike) -> str:
    """Return the SHA-256 of a vector's little-endian float32 bytes, as controller files hold it."""
    return sha256(np.asarray(vector, dtype='<f4').tobytes()).hexdigest()
