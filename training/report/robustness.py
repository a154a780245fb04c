"""The report's part on whether the finding holds elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pandas as pd

from training.evolution.treatments import WORD_SETS
from training.evolution.vectors import vectors
from training.report import behaviour, comparisons, figures_robustness, tables
from training.report.comparisons import Panel
from training.report.parts import Section
from training.report.published import TITLES
from training.study.lexicon import load_lexicon
from training.study.store import Tables


def robustness_section(store: Tables, rates: pd.DataFrame | None, limits: dict[str, float],
                        shown: Sequence[Panel], about: dict[str, Any]) -> Section:
    """Return the part; `rates` as `behaviour.lexicon` returns them, `limits` the thresholds."""
    section = Section('Does the finding hold elsewhere?')
    robustness = store['robustness']
    if robustness.empty:
        section.paragraphs.append('No champion has been scored again yet.')
        return section
    plan = about['config']['robustness']
    lengths = store['runs'].groupby('body').body_length_m.first()
    section.paragraphs.append(
        'A champion is right under a forward (backward) word if it ends more than a threshold in '
        'front of (behind) its start, and under a stop word if it ends no farther away than that. '
        'The threshold is a quarter of the median move of all the body’s champions: '
        + ', '.join(f'{TITLES.get(body, body)} {limit:.2f} m ({limit / lengths[body]:.1f} lengths)'
                    for body, limit in limits.items()) + '.')
    own = behaviour.own_words(store['outcomes'], robustness, limits)
    in_pybullet = robustness[robustness.condition == 'pybullet'].run.nunique()
    section.paragraphs.append(
        f'Perturbed: {plan["perturbed_starts"]} starts raised by up to 2 mm and tilted by up to '
        f'0.5 degrees, the same for all champions. PyBullet: {in_pybullet} of {len(store["runs"])} '
        f'champions, {plan["pybullet_starts"]} start(s), the exact one first.')
    section.add_figure('conditions', figures_robustness.conditions(own, shown), (
        'Rate of right behaviour under the runs’ own words: as evolved, from perturbed starts, in '
        'PyBullet. Bars: mean over champions, whiskers: bootstrapped 95% intervals.'))
    section.tables['Rates of right behaviour under own words.'] = tables.rates(own)
    if rates is not None:
        _lexicon_part(section, robustness, rates, limits, about)
    return section


def _lexicon_part(section: Section, robustness: pd.DataFrame, rates: pd.DataFrame,
                  limits: dict[str, float], about: dict[str, Any]) -> None:
    words = load_lexicon()
    counts = ', '.join(f'{len(words[name])} {name}' for name in words)
    section.paragraphs.append(
        f'Lexicon: {counts} words that no run heard (training/study/lexicon.yaml says how they '
        'were chosen). A controller that shows a behaviour under unrelated words as often as under '
        'the behaviour’s synonyms has not understood the synonyms: read the coloured bars against '
        'the grey ones.')
    shown = comparisons.panels(rates)
    section.add_figure('lexicon', figures_robustness.lexicon(rates, shown), (
        'Rate of each behaviour under its unheard synonyms (coloured) and under unrelated words '
        '(grey). Bars: mean over champions, whiskers: bootstrapped 95% intervals.'))
    section.tables['Rates under the lexicon; differences in percentage points.'] = (
        tables.lexicon(rates))
    stops = [word for pairs in WORD_SETS.values() for word, meaning in pairs[1]
             if meaning == 'stop']
    every = [word for group in words.values() for word in group]
    heard = vectors(about['identity']['vocabulary'], every + stops)
    near = tables.cosines(heard, every + list(dict.fromkeys(stops)))
    nearest = dict(zip(every, near[:len(every), len(every):].max(axis=1).tolist(), strict=True))
    panel = next((one for one in shown if one == ('paper', 'quadruped')), shown[0])
    per_word = behaviour.by_word(robustness, limits)
    section.add_figure('similarity', figures_robustness.similarity(per_word, nearest, panel), (
        'Every word of the lexicon: the share of champions that stop under it, by its cosine to '
        'the nearest stop command. Champions that use the embedding stop more under nearer '
        'words.'))
