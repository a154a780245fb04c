"""
What a study says of grounding: accuracy on words that no run heard, beside ears without a body.

Three places for the unheard word (as evolved, perturbed starts, PyBullet) and one for many words:
those of the study's lexicon that share no stem with any command of the study, by the stem families
of the ear's lexicon. An ear that learns from the same words as a run is asked the same words: it
needs no body, so where it is right and a champion is not, the body did not help.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from training.evolution.treatments import WORD_SETS
from training.grounding import accuracy
from training.grounding import lexicon as ear_lexicon
from training.grounding.ear import shipped_metric
from training.report.behaviour import BEHAVIOURS, KEYS, judged
from training.study.lexicon import load_lexicon
from w2b_core.hearing import places
from w2b_core.hearing.inflections import inflections
from w2b_core.hearing.metric import Metric, unit
from w2b_core.vocabulary import Vocabulary

#: Column of a champion's accuracy -> how tables call it.
PLACES = {'unheard': 'unheard word, as evolved', 'perturbed': 'unheard word, perturbed starts',
          'pybullet': 'unheard word, PyBullet', 'lexicon': 'words of other stems'}
#: Ears -> how tables call them.
EARS = {'ear': 'ear', 'ear_plain': 'ear without its metric'}


def words_of_other_stems() -> dict[str, list[str]]:
    """Return behaviour -> words of the study's lexicon that share no stem with any command."""
    known = ear_lexicon.load().words
    commands = {word for always, stops in WORD_SETS.values() for word, _ in always + stops}
    heard = {known[word].family for word in commands if word in known} | commands
    study = load_lexicon()
    return {behaviour: [word for word in study[behaviour] if word in known
                        and known[word].family not in heard] for behaviour in BEHAVIOURS}


def accuracies(own: pd.DataFrame, robustness: pd.DataFrame, limits: Mapping[str, float],
               words: Mapping[str, Sequence[str]]) -> pd.DataFrame:
    """
    Return each champion's accuracy, one row a run: the columns of `PLACES`, NaN where not scored.

    Parameters
    ----------
    own
        As `behaviour.own_words` returns it.
    robustness, limits
        Table of the store, and thresholds as `comparisons.thresholds_m` returns them.
    words
        As `words_of_other_stems` returns them.

    """
    held_out = own[own.question == 'held out'].pivot_table(
        index=KEYS, columns='condition', values='rate').rename(columns={'as evolved': 'unheard'})
    behaviours = {word: name for name, group in words.items() for word in group}
    rows = robustness[(robustness.condition == 'lexicon') & robustness.word.isin(behaviours)]
    table = held_out
    if len(rows):
        asked = rows.word.map(behaviours)
        right = rows.assign(asked=asked, right=judged(rows, asked, dict(limits)))
        # Macro: the mean of the behaviours' shares.
        shares = right.groupby([*KEYS, 'asked']).right.mean().unstack('asked')
        table = held_out.join(shares.reindex(columns=[*words]).mean(axis=1, skipna=False)
                              .rename('lexicon'))
    return table.reindex(columns=[*PLACES]).reset_index()


def ears(runs: pd.DataFrame, words: Mapping[str, Sequence[str]]) -> pd.DataFrame:
    """
    Return what ears answer that learned from the words of each run, one row a run.

    Columns `ear` and `ear_plain` (1 or 0: is the held-out word right), and the same with `_lexicon`
    (macro accuracy on `words`). `ear_plain` is logistic regression on centred vectors alone; `ear`
    adds the learned metric and inflections of the trained words, none of them asked. Neither
    refuses a word. The vectors are word2vec's, as in the experimental treatment.
    """
    answers = {key: _ears_of(*key, words) for key in {
        (str(row.vocabulary), str(row.word_set), str(row.held_out)) for row in runs.itertuples()}}
    return pd.DataFrame([{'run': row.run, **answers[
        str(row.vocabulary), str(row.word_set), str(row.held_out)]} for row in runs.itertuples()])


def _ears_of(spec: str, word_set: str, held_out: str, words: Mapping[str, Sequence[str]]
             ) -> dict[str, float]:
    vocabulary = Vocabulary.load(spec)
    built = shipped_metric(vocabulary)
    always, stops = WORD_SETS[word_set]
    trained = [pair for pair in (*always, *stops) if pair[0] != held_out]
    asked = [(held_out, 'stop'), *((word, name) for name, group in words.items()
                                   for word in group if word in vocabulary)]
    taken = {word for word, _ in asked}
    known = places.spelt(vocabulary)
    found: dict[str, float] = {}
    for name in EARS:
        learned = list(trained)
        if name == 'ear':
            if built is None:
                continue
            learned += [(form, label) for word, label in trained
                        for form in inflections(word, known.__contains__)
                        if form not in taken and form not in dict(trained)]
        points = _points(vocabulary, built.metric if name == 'ear' and built else None)
        labels = np.array([BEHAVIOURS.index(label) for _, label in learned])
        answer = accuracy.logistic(points([word for word, _ in learned]), labels, len(BEHAVIOURS))
        right = answer(points([word for word, _ in asked])) == np.array(
            [BEHAVIOURS.index(label) for _, label in asked])
        found[name] = float(right[0])
        kinds = np.array([label for _, label in asked[1:]])
        found[f'{name}_lexicon'] = float(np.mean([right[1:][kinds == kind].mean()
                                                  for kind in BEHAVIOURS]))
    return found


def _points(vocabulary: Vocabulary, metric: Metric | None) -> accuracy.Points:
    """Return where words lie by their own vectors: behind a metric, or about the mean."""
    if metric is not None:
        return lambda words: places.project(words, vocabulary, metric, forms=False)
    mean = unit(vocabulary.matrix(vocabulary.words[:places.SEARCHED_WORDS]).astype(np.float64)
                ).mean(axis=0)
    return lambda words: unit(unit(vocabulary.matrix(words).astype(np.float64)) - mean)
