"""
Where a word lies behind a metric: half its own vector, half those of its other inflections.

News speak of one form of a word otherwise than of another (*withdrew*, *dashed*), and rare forms
have noisy vectors; all forms ask for the same. Nothing but spelling says which words are forms of
one another, so that no word that is judged is told of by another's meaning.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from w2b_core.hearing.inflections import inflections
from w2b_core.hearing.metric import Metric, unit
from w2b_core.vocabulary import Vocabulary

Array = NDArray[np.float64]

#: Most frequent words of a vocabulary among which inflections and the background are looked for.
SEARCHED_WORDS = 50_000


def spelt(vocabulary: Vocabulary) -> frozenset[str]:
    """Return the words of a vocabulary, of a huge one the most frequent, as it spells them."""
    return frozenset(vocabulary.words[:SEARCHED_WORDS])


def project(words: Sequence[str], vocabulary: Vocabulary, metric: Metric, *, forms: bool = True,
            among: Collection[str] | None = None) -> Array:
    """
    Return where words lie, unit vectors of shape (n, E).

    Parameters
    ----------
    words
        As the vocabulary spells them.
    vocabulary, metric
        Their vectors, and the metric behind which they lie.
    forms
        Whether their inflections count; a word without any lies where its vector does.
    among
        The words that may be inflections; `spelt(vocabulary)` by default.

    """
    if not forms or not words:
        return metric.project(vocabulary.matrix(words))
    known = (spelt(vocabulary) if among is None else among).__contains__
    groups = [inflections(word, known) for word in words]
    places = {form: place for place, form in enumerate(dict.fromkeys(chain(*groups)))}
    points = metric.project(vocabulary.matrix(places))
    every = points[[places[form] for group in groups for form in group]]
    counts = np.array([len(group) for group in groups])
    starts = np.cumsum(counts) - counts
    own = every[starts]
    others = np.add.reduceat(every, starts, axis=0) - own
    where: Array = unit(own + others / np.maximum(counts - 1, 1)[:, None])
    return where
