"""
How often a champion does what a word asks for, and how often it does so for words that do not ask.

Rates are per champion; the report shows their mean over an arm's champions. The chance baseline is
what a champion does under unrelated words: one that stops for half of all words is right on half
of the stop words by chance. *Selectivity* is the difference of the two.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from training.evolution.treatments import WORD_SETS
from training.report.comparisons import right

#: What the study's words ask for, in the paper's order.
BEHAVIOURS = tuple(dict.fromkeys(
    behaviour for words in WORD_SETS['paper'] for _word, behaviour in words))
#: Edges between bins of cosines to the nearest stop command.
BINS = (0.1, 0.2, 0.3, 0.5)
KEYS = ['run', 'word_set', 'body', 'treatment']


def judged(rows: pd.DataFrame, asked: pd.Series, thresholds: dict[str, float]) -> pd.Series:
    """Return 1.0 for each row whose outcome is what `asked` has for it, else 0.0."""
    return right(asked, rows.final_x_m.astype(float), rows.displacement_m.astype(float),
                 rows.largest_step_m.astype(float),
                 rows.body.map(thresholds).astype(float)).astype(float)


def own_words(outcomes: pd.DataFrame, robustness: pd.DataFrame,
              thresholds: dict[str, float]) -> pd.DataFrame:
    """
    Return each champion's rate of right behaviour under its own words, by condition.

    One row a run, condition (`as evolved`, `perturbed`, `pybullet`) and question (`forward`,
    `backward`, `stop`, or `held out`), in the column `rate`.
    """
    evolved = outcomes.rename(columns={'behaviour': 'word_class'}).assign(condition='as evolved')
    columns = [*KEYS, 'condition', 'word_class', 'role', 'final_x_m', 'displacement_m',
               'largest_step_m']
    rows = pd.concat([evolved[columns],
                      robustness[robustness.condition != 'lexicon'][columns]])
    rows['rate'] = judged(rows, rows.word_class, thresholds)
    rows['question'] = np.where(rows.role == 'held_out', 'held out', rows.word_class)
    return rows.groupby([*KEYS, 'condition', 'question'], as_index=False).rate.mean()


def lexicon(robustness: pd.DataFrame, thresholds: dict[str, float]) -> pd.DataFrame:
    """
    Return each champion's rates under the lexicon's words.

    One row a run and behaviour: `synonyms`, the share of the behaviour's synonyms under which it
    is shown; `unrelated`, the share of unrelated words under which it is shown all the same.
    """
    rows = robustness[robustness.condition == 'lexicon']
    parts = []
    for behaviour in BEHAVIOURS:
        asked = pd.Series(behaviour, index=rows.index)
        shown = rows.assign(shown=judged(rows, asked, thresholds))
        rate = {name: shown[shown.word_class == word_class].groupby(KEYS).shown.mean()
                for name, word_class in (('synonyms', behaviour), ('unrelated', 'unrelated'))}
        parts.append(pd.DataFrame(rate).reset_index().assign(behaviour=behaviour))
    return pd.concat(parts, ignore_index=True)


def selectivity(rates: pd.DataFrame) -> pd.DataFrame:
    """Return one row a run: rate on stop synonyms minus rate on unrelated words."""
    stop = rates[rates.behaviour == 'stop']
    return stop.assign(selectivity=stop.synonyms - stop.unrelated)[[*KEYS, 'selectivity']]


def by_cosine(robustness: pd.DataFrame, thresholds: dict[str, float],
              nearest: Mapping[str, float]) -> pd.DataFrame:
    """
    Return how much of the lexicon stops each champion, by the words' nearness to stop commands.

    One row a run and bin of words (`BINS`): `cosine`, the mean of its words' largest cosines to a
    stop command, as `nearest` gives them; `stopped`, the share of the words under which the
    champion stops; `words`, how many there are.
    """
    rows = robustness[robustness.condition == 'lexicon']
    cosine = rows.word.map(nearest).astype(float)
    asked = pd.Series('stop', index=rows.index)
    rows = rows.assign(stopped=judged(rows, asked, thresholds),
                       bin=np.digitize(cosine, BINS))
    # The same for all champions, also for those that know a word of the lexicon.
    middle = pd.Series(nearest).groupby(np.digitize(list(nearest.values()), BINS)).mean()
    shares = rows.groupby([*KEYS, 'bin'], as_index=False).agg(
        stopped=('stopped', 'mean'), words=('stopped', 'size'))
    return shares.assign(cosine=shares.bin.map(middle)).drop(columns='bin')


def sorted_out(outcomes: pd.DataFrame, thresholds: dict[str, float]) -> pd.DataFrame:
    """
    Return which champions are right as evolved, one row a run.

    `trained`: under every trained word; `unheard`: under the held-out one.
    """
    rows = outcomes.rename(columns={'behaviour': 'word_class'})
    rows = rows.assign(right=judged(rows, rows.word_class, thresholds) > 0)
    parts = {name: rows[rows.role == role].groupby(KEYS).right.all()
             for name, role in (('trained', 'trained'), ('unheard', 'held_out'))}
    return pd.DataFrame(parts).fillna(False).astype(bool).reset_index()
