"""
Where the ceiling is: words drawn towards their WordNet synonyms, those of the test words included.

After Faruqui et al. (2015), in one step and behind the metric. This is no ear that was trained on
other words: a dictionary has told it of every word that is asked. It says what relations add.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from typing import Any

import numpy as np

from training.grounding import accuracy
from training.grounding.accuracy import Array, Points
from training.grounding.lexicon import Lexicon
from training.grounding.wordnet import Pair, WordNet
from w2b_core.hearing import places
from w2b_core.hearing.metric import Metric, unit
from w2b_core.vocabulary import Vocabulary

#: Weight of the synonyms' mean beside the word's own place; the best of 1, 2 and 4 on the shipped
#: lexicon, so that the ceiling is rather too high.
SYNONYM_WEIGHT = 2.0
TITLE = 'retrofitted: knows the synonyms of the test words'


def measure(words: Lexicon, vocabulary: Vocabulary, metric: Metric, wordnet: WordNet,
            counts: Sequence[int], splits: int) -> dict[str, Any]:
    """Return the accuracy by number of words, as JSON values."""
    points = retrofitted(vocabulary, metric, wordnet)
    forms = places.spelt(vocabulary)
    found: dict[str, Any] = {}
    for count in counts:
        row = accuracy.of_few_words(words, points, count, splits, forms=forms)
        if row is not None:
            found[str(count)] = {'macro': row.macro, 'low': row.low, 'high': row.high}
    left_out = accuracy.of_left_out_families(words, points)
    found['leave_one_family_out'] = {'macro': left_out.macro, 'low': left_out.low,
                                     'high': left_out.high}
    return found


def retrofitted(vocabulary: Vocabulary, metric: Metric, wordnet: WordNet, *,
                inflections: bool = True) -> Points:
    """
    Return where words lie, each drawn towards the synonyms of all its forms.

    `inflections`: whether a word's inflections count where it lies, as for the ear.
    """
    relations, known = wordnet.relations(vocabulary.words), places.spelt(vocabulary)
    synonyms, forms = _neighbours(relations.synonyms), _neighbours(relations.inflections)
    drawn: dict[str, Array] = {}

    def place(word: str) -> Array:
        if word not in drawn:
            own = {word, *forms[word]}
            others = sorted({other for form in own for other in synonyms[form]} - own)
            here = places.project([word, *others], vocabulary, metric, forms=inflections,
                                  among=known)
            added = SYNONYM_WEIGHT * here[1:].mean(axis=0) if others else 0.0
            drawn[word] = unit(here[0] + added)
        return drawn[word]

    return lambda names: np.array([place(name) for name in names])


def _neighbours(pairs: Sequence[Pair]) -> defaultdict[str, set[str]]:
    found: defaultdict[str, set[str]] = defaultdict(set)
    for first, second in pairs:
        found[first].add(second)
        found[second].add(first)
    return found
