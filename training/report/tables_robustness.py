"""The report's tables on right and wrong: own words, elsewhere, and the lexicon."""

from __future__ import annotations

import pandas as pd

from training.report import behaviour
from training.report.comparisons import LETTERS, TREATMENTS, panels, select, thresholds_m
from training.report.figures_robustness import CONDITIONS, QUESTIONS
from training.report.published import title
from training.report.tables import arms

#: Thresholds, as shares of a body's typical move, at which rates are given side by side.
SHARES = (0.1, 0.25, 0.5)


def kinds(sorted_out: pd.DataFrame) -> pd.DataFrame:
    """Return how many champions are right in training and under the unheard word, as evolved."""
    rows = []
    for panel, treatment, arm in arms(sorted_out):
        rows.append({
            'robot': title(*panel), 'treatment': LETTERS[treatment], 'champions': str(len(arm)),
            'right under every word': _share(arm.trained & arm.unheard),
            'right in training, wrong under the unheard word': _share(arm.trained & ~arm.unheard),
            'wrong in training, right under the unheard word': _share(~arm.trained & arm.unheard),
            'wrong in training and under the unheard word': _share(~arm.trained & ~arm.unheard)})
    return pd.DataFrame(rows)


def _share(mask: pd.Series) -> str:
    return f'{int(mask.sum())} ({mask.mean():.0%})'


def rates(own: pd.DataFrame) -> pd.DataFrame:
    """Return the mean rate of right behaviour under own words, by condition."""
    rows = []
    for panel, treatment, arm in arms(own):
        for condition, name in CONDITIONS.items():
            part = arm[arm.condition == condition]
            if part.empty:
                continue
            row = {'robot': title(*panel), 'treatment': LETTERS[treatment], 'condition': name,
                   'champions': str(part.run.nunique())}
            for question in QUESTIONS:
                values = part[part.question == question].rate
                row[question] = f'{values.mean():.0%}' if len(values) else ''
            rows.append(row)
    return pd.DataFrame(rows)


def lexicon(lexicon_rates: pd.DataFrame, own: pd.DataFrame) -> pd.DataFrame:
    """Return the mean rates under the lexicon: synonyms, and unrelated words beside them."""
    tested = own[(own.condition == 'as evolved') & (own.question == 'held out')]
    rows = []
    for panel, treatment, arm in arms(lexicon_rates):
        row = {'robot': title(*panel), 'treatment': LETTERS[treatment]}
        for name in behaviour.BEHAVIOURS:
            part = arm[arm.behaviour == name]
            row[f'{name}: synonyms'] = f'{part.synonyms.mean():.0%}'
            row[f'{name}: unrelated'] = f'{part.unrelated.mean():.0%}'
            row[f'{name}: difference'] = f'{100 * (part.synonyms - part.unrelated).mean():+.0f}'
        held_out = select(tested, panel, treatment)
        held_out = held_out[held_out.run.isin(arm.run)].rate
        row['held-out stop command'] = f'{held_out.mean():.0%}'
        rows.append(row)
    return pd.DataFrame(rows)


def sensitivity(table: pd.DataFrame, outcomes: pd.DataFrame,
                robustness: pd.DataFrame) -> pd.DataFrame:
    """Return how the main rates depend on the threshold: a tenth, a quarter, half of a move."""
    rows = {(panel, treatment): {'robot': title(*panel), 'treatment': LETTERS[treatment]}
            for panel in panels(table) for treatment in TREATMENTS
            if len(select(table, panel, treatment))}
    for share in SHARES:
        limits = thresholds_m(table, share)
        right = behaviour.sorted_out(outcomes, limits)
        words = behaviour.lexicon(robustness, limits)
        for (panel, treatment), row in rows.items():
            arm = select(right, panel, treatment)
            row[f'every trained word, {share:.0%}'] = f'{arm.trained.mean():.0%}'
            row[f'unheard word, {share:.0%}'] = f'{arm.unheard.mean():.0%}'
            stop = select(words[words.behaviour == 'stop'], panel, treatment)
            row[f'stop words − unrelated, {share:.0%}'] = (
                f'{100 * (stop.synonyms - stop.unrelated).mean():+.0f}' if len(stop) else '')
    return pd.DataFrame(list(rows.values()))
