"""The report's part on whether the finding holds elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from training.evolution.treatments import WORD_SETS
from training.evolution.vectors import vectors
from training.report import (
    behaviour,
    comparisons,
    figures,
    figures_robustness,
    tables,
    tables_robustness,
)
from training.report.comparisons import THRESHOLD_SHARE
from training.report.parts import Section
from training.report.published import TITLES
from training.report.statistics import Tested
from training.study.lexicon import load_lexicon
from training.study.store import Tables


def robustness_section(store: Tables, table: pd.DataFrame, rates: pd.DataFrame | None,
                       limits: dict[str, float], tested: Sequence[Tested],
                       about: dict[str, Any]) -> Section:
    """Return the part; `rates` as `behaviour.lexicon` returns them, `limits` the thresholds."""
    section = Section('Does the finding hold elsewhere?')
    robustness = store['robustness']
    shown = comparisons.panels(table)
    lengths = store['runs'].groupby('body').body_length_m.first()
    section.paragraphs.append(
        'A champion is right under a forward (backward) word if it ends more than a threshold in '
        'front of (behind) its start, and under a stop word if it ends no farther away than that. '
        f'The threshold is {THRESHOLD_SHARE:.0%} of the median move of all the body’s champions, '
        'both treatments together: '
        + ', '.join(f'{TITLES.get(body, body)} {limit:.2f} m ({limit / lengths[body]:.1f} lengths)'
                    for body, limit in limits.items() if np.isfinite(limit)) + '.')
    if robustness.empty:
        section.paragraphs.append('No champion has been scored again yet.')
    section.paragraphs += _counts(store, about)
    own = behaviour.own_words(store['outcomes'], robustness, limits)
    elsewhere = [one for one in tested if one.comparison.question.startswith('test, ')]
    if elsewhere:
        section.add_figure('effects', figures.effects(tested, shown), (
            'Whether word2vec champions move less than control champions under the unheard stop '
            'word: as evolved, from perturbed starts and in PyBullet. Rank-biserial correlation '
            'with its 95% interval (Newcombe’s score method); filled marks are significant after '
            'correction.'))
    section.add_figure('conditions', figures_robustness.conditions(own, shown), (
        'Rate of right behaviour under the runs’ own words, as evolved and elsewhere. Bars: mean '
        'over champions (0: measured, below 0.5%), whiskers: bootstrapped 95% intervals of the '
        'mean.'))
    section.tables['Rates of right behaviour under own words, mean over champions.'] = (
        tables_robustness.rates(own))
    if rates is not None:
        _lexicon_part(section, robustness, rates, own, limits, about)
    section.tables['The same rates with other thresholds, in shares of the body’s median move; '
                   'last columns: rate of stopping under synonyms of stop minus under unrelated '
                   'words, percentage points.'] = (
        tables_robustness.sensitivity(table, store['outcomes'], robustness))
    return section


def _counts(store: Tables, about: dict[str, Any]) -> list[str]:
    """Return what was scored, and how many outcomes were left out, in sentences."""
    robustness, plan, runs = store['robustness'], about['config']['robustness'], len(store['runs'])
    lines = []
    count = {name: robustness[robustness.condition == name].run.nunique()
             for name in ('perturbed', 'pybullet', 'lexicon')}
    if count['perturbed']:
        lines.append(f'Perturbed starts: {count["perturbed"]} of {runs} champions from '
                     f'{plan["perturbed_starts"]} starts raised by up to 2 mm and tilted by up to '
                     '0.5 degrees, the same ones for all champions.')
    if count['pybullet']:
        starts = plan['pybullet_starts']
        lines.append(f'PyBullet, an engine that took no part in the evolution: {count["pybullet"]} '
                     f'of {runs} champions from {starts} start{"s" if starts > 1 else ""}, the '
                     'unperturbed one first.')
    elif len(robustness):
        lines.append('PyBullet: no champion was scored in it.')
    every = pd.concat([store['outcomes'], robustness]) if len(robustness) else store['outcomes']
    exploded = int((~comparisons.sound(every)).sum())
    lines.append(f'{exploded} of {len(every):,} outcomes were left out of displacements and count '
                 'as wrong, because the simulator exploded (a step above 0.1 m, or no number).'
                 if exploded else f'In none of {len(every):,} outcomes did the simulator explode '
                 '(a step above 0.1 m, or no number).')
    return lines


def _lexicon_part(section: Section, robustness: pd.DataFrame, rates: pd.DataFrame,
                  own: pd.DataFrame, limits: dict[str, float], about: dict[str, Any]) -> None:
    words = load_lexicon()
    counts = ', '.join(f'{len(words[name])} {name}' for name in words)
    section.paragraphs.append(
        f'Lexicon: {counts} words that no run heard (training/study/lexicon.yaml says how they '
        'were chosen). A controller that shows a behaviour under unrelated words as often as under '
        'the behaviour’s synonyms has not understood the synonyms: read the coloured bars against '
        'the grey ones. The blue bar is the paper’s own test, the held-out stop command.')
    shown = comparisons.panels(rates)
    section.add_figure('lexicon', figures_robustness.lexicon(rates, own, shown), (
        'Rate of each behaviour under its unheard synonyms (coloured), under the held-out stop '
        'command (blue) and under unrelated words (grey). Bars: mean over '
        'champions (0: measured, below 0.5%), whiskers: bootstrapped 95% intervals of the mean.'))
    section.tables['Rates under the lexicon, mean over champions; differences in percentage '
                   'points.'] = tables_robustness.lexicon(rates, own)
    stops = [word for pairs in WORD_SETS.values() for word, meaning in pairs[1]
             if meaning == 'stop']
    every = [word for group in words.values() for word in group]
    heard = vectors(about['identity']['vocabulary'], every + stops)
    near = tables.cosines(heard, every + list(dict.fromkeys(stops)))
    nearest = dict(zip(every, near[:len(every), len(every):].max(axis=1).tolist(), strict=True))
    shares = behaviour.by_cosine(robustness, limits, nearest)
    edges = ', '.join(f'{edge:g}' for edge in behaviour.BINS)
    section.add_figure('similarity', figures_robustness.by_cosine(shares, shown), (
        'Share of the lexicon’s words that stop a champion, by the words’ cosine to the nearest '
        f'stop command (bins divided at {edges}). Champions that use the embedding stop more '
        'under nearer words; to control champions a permuted vector tells nothing but its length. '
        'Whiskers: bootstrapped 95% intervals of the mean over champions.'))
