"""The report's part on grounding: accuracy on unheard words, effects, and ears without a body."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from training.report import grounding, style
from training.report.comparisons import LETTERS, TREATMENTS, Panel, panels, select
from training.report.equivalence import Difference, difference, paired
from training.report.figures_robustness import mean_interval
from training.report.grounding import EARS, PLACES
from training.report.parts import Section
from training.report.published import title
from training.report.style import TREATMENT_COLOURS

#: Of three behaviours, a guess is right so often.
CHANCE = 1 / 3
_EAR_COLOUR = '#c1121f'


def grounding_section(runs: pd.DataFrame, own: pd.DataFrame, robustness: pd.DataFrame,
                      limits: Mapping[str, float]) -> Section:
    """Return the part; `own` as `behaviour.own_words` returns it, `limits` the thresholds."""
    words = grounding.words_of_other_stems()
    table = grounding.accuracies(own, robustness, limits, words).merge(
        grounding.ears(runs, words), on='run')
    shown = panels(table)
    section = Section('Is an unheard word understood, and does that need a body?')
    counts = ', '.join(f'{len(group)} of {name}' for name, group in words.items())
    section.paragraphs += [
        'Accuracy, as the robustness tables define right and wrong. The unheard word is a stop '
        f'word. Words of other stems: those of the lexicon ({counts}) that share no stem with any '
        'command of the study; accuracy is the mean of the three behaviours’ shares, by chance '
        f'{CHANCE:.2f} for whoever shows each behaviour equally often or one always.',
        'The ears learned from the very words that each run was trained on, and were asked the '
        'same words; they have no body. “Without its metric” is logistic regression on the word '
        'vectors, which know no more than a champion’s; the ear’s metric was learned from WordNet '
        'pairs, none of which touches a word that is asked, and it hears inflections of the '
        'trained words.']
    section.add_figure('grounding', figure(table, shown), (
        'Accuracy on words that no run heard, by body: champions of word2vec (E) and control (C) '
        'runs under the unheard stop word and under words of other stems, and ears without a body '
        'on the same words. Means with bootstrapped 95% intervals over runs; dotted: chance.'))
    section.tables['Accuracy on unheard words, mean over runs [95% interval].'] = _means(
        table, shown)
    section.tables['Effects: word2vec minus control champions, in percentage points [95% '
                   'interval], and what that says (see the rule on equivalence).'] = _effects(
        table, shown, between=True)
    section.tables['Does it need the body? Word2vec champions minus the ear on the same words, '
                   'in percentage points [95% interval].'] = _effects(table, shown, between=False)
    return section


def _means(table: pd.DataFrame, shown: Sequence[Panel]) -> pd.DataFrame:
    rows = []
    for panel in shown:
        for treatment in TREATMENTS:
            arm = select(table, panel, treatment)
            if len(arm):
                rows.append({'robot': title(*panel), 'who': f'champions {LETTERS[treatment]}',
                             'runs': str(len(arm)),
                             **{name: _mean(arm[place]) for place, name in PLACES.items()}})
        every = select(table, panel)
        rows += [{'robot': title(*panel), 'who': name, 'runs': str(len(every)),
                  **dict.fromkeys(PLACES.values(), ''),
                  PLACES['unheard']: _mean(every[ear]),
                  PLACES['lexicon']: _mean(every[f'{ear}_lexicon'])}
                 for ear, name in EARS.items() if ear in every]
    return pd.DataFrame(rows)


def _mean(values: pd.Series) -> str:
    found = values.dropna().to_numpy(float)
    if not len(found):
        return ''
    mean, low, high = mean_interval(found)
    return f'{mean:.2f} [{low:.2f}, {high:.2f}]'


def _effects(table: pd.DataFrame, shown: Sequence[Panel], *, between: bool) -> pd.DataFrame:
    rows = []
    for panel in shown:
        evolved, control = (select(table, panel, name) for name in ('experimental', 'control'))
        row = {'robot': title(*panel)}
        if between:
            for place, name in PLACES.items():
                row[name] = said(difference(evolved[place].dropna(), control[place].dropna()))
        else:
            for ear, name in EARS.items():
                for place, other in (('unheard', ear), ('lexicon', f'{ear}_lexicon')):
                    row[f'{name}: {PLACES[place]}'] = said(paired(
                        (evolved[place] - evolved[other]).dropna())) if other in evolved else ''
        rows.append(row)
    return pd.DataFrame(rows)


def said(found: Difference | None) -> str:
    """Return a difference in percentage points with its interval and statement; '' for none."""
    if found is None:
        return ''
    low, high = (100 * end for end in found.interval)
    return f'{100 * found.estimate:+.0f} [{low:+.0f}, {high:+.0f}]: {found.statement}'


@style.styled
def figure(table: pd.DataFrame, shown: Sequence[Panel]) -> Figure:
    """Return the accuracies on the unheard word and on words of other stems, one row a panel."""
    drawn = Figure(figsize=(style.PAGE_IN, 0.42 * len(shown) + 0.95), layout='constrained')
    plots = drawn.subplots(1, 2, sharey=True, squeeze=False)[0]
    who = [(place, treatment) for treatment in TREATMENTS for place in ('unheard', 'lexicon')]
    for plot, place in zip(plots, ('unheard', 'lexicon'), strict=True):
        for row, panel in enumerate(shown):
            marks = [(select(table, panel, treatment)[where], TREATMENT_COLOURS[treatment], 'o', 1)
                     for where, treatment in who if where == place]
            marks += [(select(table, panel)[ear if place == 'unheard' else f'{ear}_lexicon'],
                       _EAR_COLOUR, 'D', ear == 'ear') for ear in EARS if ear in table]
            for turn, (values, colour, mark, filled) in enumerate(marks):
                found = values.dropna().to_numpy(float)
                if not len(found):
                    continue
                mean, low, high = mean_interval(found)
                y = row + (turn - (len(marks) - 1) / 2) * 0.18
                plot.plot([low, high], [y, y], color=colour, linewidth=1.1)
                plot.plot(mean, y, mark, color=colour, markersize=4,
                          markerfacecolor=colour if filled else 'white')
        if place == 'lexicon':
            plot.axvline(CHANCE, color=style.GREY, linewidth=0.7, linestyle=':')
        plot.set(xlim=(-0.03, 1.03), ylim=(len(shown) - 0.5, -0.5),
                 xlabel='accuracy: ' + {'unheard': 'the unheard stop word',
                                        'lexicon': 'words of other stems'}[place])
        plot.set_yticks(np.arange(len(shown)), [title(*panel) for panel in shown])
    handles: list[Artist] = [
        *(Line2D([], [], color=TREATMENT_COLOURS[name], marker='o', markersize=4,
                 label=f'champions: {style.NAMES[name]}') for name in TREATMENTS),
        *(Line2D([], [], color=_EAR_COLOUR, marker='D', markersize=4, linestyle='', label=name,
                 markerfacecolor=_EAR_COLOUR if ear == 'ear' else 'white')
          for ear, name in EARS.items() if ear in table)]
    drawn.legend(handles=handles, loc='outside lower center', ncols=4)
    return drawn
