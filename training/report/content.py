"""What a report says, before it becomes a page: text, tables, figures and verdicts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from training.evolution.run import load_result
from training.evolution.vectors import vectors
from training.report import (
    behaviour,
    comparisons,
    exemplars,
    figures,
    figures_priming,
    tables,
    tables_robustness,
)
from training.report.about import (
    differences,
    lead,
    partial,
    provenance_section,
    seeds,
    time_section,
)
from training.report.comparisons import Panel
from training.report.equivalence import RULE as EQUIVALENCE
from training.report.findings import beyond, findings
from training.report.grounding_section import grounding_section
from training.report.parts import Content, Section, counted
from training.report.published import ALPHA, COMMANDS, COMPARISONS, GENERATIONS, title
from training.report.robustness import robustness_section
from training.report.statistics import Tested, compare_all
from training.report.style import LINEAR_TO
from training.report.verdicts import RULES, too_few_seeds, withheld
from training.study.directory import StudyDirectory, StudyError
from training.study.store import Tables, parse_run_id
from w2b_core import bodies

#: Said under the figures of displacement.
SQUEEZED = (f'The axis is linear to {LINEAR_TO:g} body length (dotted line) and logarithmic above: '
            'there, equal steps in height are equal ratios.')


def gather(study: StudyDirectory, store: Tables, about: dict[str, Any]) -> Content:
    """
    Return the report on a study.

    Raises
    ------
    StudyError
        If no run is finished.

    """
    runs = store['runs']
    if runs.empty:
        raise StudyError(f'{study.path}: no run is finished yet; nothing to report')
    table = comparisons.per_run(runs, store['outcomes'], store['robustness'])
    limits = comparisons.thresholds_m(table)
    robustness = store['robustness']
    rates = selectivity = None
    if (robustness.condition == 'lexicon').any():
        rates = behaviour.lexicon(robustness, limits)
        selectivity = behaviour.selectivity(rates)
    tested = compare_all(comparisons.comparisons(table, selectivity))
    shown = comparisons.panels(table)
    sections = [_vectors_section(runs, about), _fitness_section(store, table, tested, shown),
                _priming_section(study, store, table, limits),
                _displacement_section(table, tested, shown),
                grounding_section(runs, behaviour.own_words(store['outcomes'], robustness, limits),
                                  robustness, limits),
                robustness_section(store, table, rates, limits, tested, about),
                _comparisons_section(tested), time_section(runs),
                provenance_section(study, runs, about)]
    complete, configured = seeds(runs, about)
    few = too_few_seeds(len(complete), configured)
    return Content(
        f'Word2vec to behavior: the study “{about["config"]["name"]}”',
        [lead(runs, about)], partial(store, about),
        withheld(findings(tested, table), few), withheld(beyond(tested, table), few),
        (*RULES, EQUIVALENCE), differences(runs, about),
        [section for section in sections if section is not None], tested)


def _vectors_section(runs: pd.DataFrame, about: dict[str, Any]) -> Section:
    vocabulary = about['identity']['vocabulary']
    section = Section('Tables I and II: the commands’ vectors')
    heard = vectors(vocabulary, COMMANDS)
    first, largest = tables.table_1(heard)
    section.tables['Table I. Cosines of the commands’ vectors: here (paper).'] = first
    section.paragraphs.append('Table I: largest difference to the paper after rounding: '
                              f'{largest:.2f}.')
    # In the report's order of bodies: the sample is a run of the quadruped, if there is one.
    control = pd.concat([runs[:0], *(comparisons.select(runs, panel, 'control')
                                     for panel in comparisons.panels(runs)
                                     if panel[0] == 'paper')])
    if len(control):
        second, line = tables.table_2(heard, [int(seed) for seed in control.evolution_seed])
        section.tables[f'Table II. The same after permutation, in the run {control.run.iloc[0]}: '
                       'here (paper’s sample).'] = second
        section.paragraphs.append(f'Table II is a sample, ours and the paper’s. {line}')
    return section


def _fitness_section(store: Tables, table: pd.DataFrame, tested: Sequence[Tested],
                     shown: Sequence[Panel]) -> Section:
    section = Section('Table III: training performance')
    section.tables['Table III. Median fitness of run champions in metres (standard deviation over '
                   'runs; bootstrapped standard error of the median).'] = tables.table_3(
                       table, tested)
    section.paragraphs.append(
        'The paper’s numbers in brackets are called standard deviations; at 0.06 to 0.09 they are '
        'closer to a standard error of the median, which is why ours shows both.')
    section.add_figure('fitness', figures.fitness(store['history'], shown),
                       'Fitness of the best individual over generations: median and middle half '
                       'of the runs. Dashed: the medians of the paper’s Table III, reached after '
                       f'{GENERATIONS:,} generations.')
    return section


def _priming_section(study: StudyDirectory, store: Tables, table: pd.DataFrame,
                     limits: Mapping[str, float]) -> Section | None:
    # The paper shows the quadruped, which is the first panel wherever it was run.
    panel = comparisons.panels(table)[0]
    chosen = [one for one in exemplars.choose(table, store['outcomes'], limits, panel)
              if (study.run_directory(one.run) / 'champion.json').exists()]
    if not chosen:
        return None
    settings = store['runs'].set_index('run')
    vocabulary = str(settings.vocabulary.iloc[0])
    shown = []
    for one in chosen:
        row = settings.loc[one.run]
        words = [word for pairs in parse_run_id(one.run).words() for word, _ in pairs]
        network = load_result(study.run_directory(one.run)).network
        shown.append(exemplars.show(
            one.run, network, vectors(vocabulary, words), str(row.engine), str(row.precision)))
    section = Section('Figure 4: how words prime the network, and where they send the body')
    section.paragraphs.append(f'{title(*panel)}. How the three were chosen: {exemplars.RULE}')
    section.paragraphs.append('Shown: ' + '; '.join(
        f'({"abc"[number]}) {one.run}: {one.kind}, as {"is" if one.count == 1 else "are"} '
        f'{one.count} of the {counted(one.among, "champion")} of its treatment'
        f'{"" if one.met else ", so the fittest other one is shown"}'
        for number, one in enumerate(chosen)) + '.')
    section.paragraphs.append(
        'The paper’s three: an experimental champion that is right under every word, a control '
        'champion that fails in training and under the unheard word, and a control champion that '
        'is right in training and fails under the unheard word. It calls them representative '
        'without a count; the table below counts all champions.')
    section.add_figure('priming', figures_priming.priming(
        chosen, shown, length_m=bodies.get(panel[1]).length_m),
        'Hidden neurons while a command’s vector passes through the auditory neuron (rows: words; '
        'the last one, in bold, is the unheard word), and the way of the body under each command; '
        'squares mark the end, a hollow one that of the unheard word.')
    section.tables['Champions by what they do as evolved (right and wrong as in the robustness '
                   'tables): number and share.'] = tables_robustness.kinds(
        behaviour.sorted_out(store['outcomes'], dict(limits)))
    return section


def _displacement_section(table: pd.DataFrame, tested: Sequence[Tested],
                          shown: Sequence[Panel]) -> Section:
    section = Section('Figures 5 and 6: displacement')
    main = [panel for panel in shown if panel[0] == 'paper']
    if main:
        section.add_figure('displacement', figures.bars(table, tested, main), (
            'Median net displacement of run champions by body, command meaning and treatment; '
            'whiskers: bootstrapped 95% confidence intervals of the median; dots: champions. '
            f'{SQUEEZED} '
            f'Stars: Mann-Whitney U, Holm-Bonferroni over all {len(tested)} comparisons: * 0.01, '
            '** 0.001, *** 0.0001; red: word2vec against control under the unheard word. Paper '
            '(figure 5): significant red brackets in four of six bodies.'))
    balanced = [panel for panel in shown if panel[0] != 'paper']
    if balanced:
        beside = [('paper', panel[1]) for panel in balanced if ('paper', panel[1]) in shown]
        section.add_figure('balanced', figures.bars(table, tested, beside + balanced), (
            'The balanced set, beside the paper’s set where that was run; axis and '
            'marks as in the figure above. Paper (figure 6): control champions move more under the '
            'unheard than under the trained stop words, almost as far as under move commands; '
            'word2vec champions do not.'))
        section.paragraphs.append(
            'The paper says of the balanced set that its significance levels were identical to '
            'those of the quadruped in figure 5; it also says that there the quadruped’s stop and '
            'test displacements do not differ, and that here the control’s do. Both claims are '
            'judged above as they stand.')
    section.tables['Medians [95% intervals] of net displacement, and medians of the path’s length, '
                   'in body lengths; right: median progress in metres under the trained move '
                   'commands.'] = tables.displacement(table)
    section.tables['The unheard word, word by word: median net displacement in body lengths (runs '
                   'that held it out).'] = tables.by_held_out(table)
    return section


def _comparisons_section(tested: Sequence[Tested]) -> Section:
    section = Section('All comparisons')
    section.paragraphs.append(
        f'{counted(len(tested), "comparison")}, all of them corrected together (the paper: '
        f'{COMPARISONS}). Claims about displacement use the level {ALPHA}, as the paper’s stars '
        'do. Common language: the probability that a run of the first sample exceeds one of the '
        'second; '
        'rank-biserial: twice that minus 1, with Newcombe’s 95% score interval (not corrected for '
        'the number of comparisons). p: from the exact distribution of U where no values tie, '
        'from the normal approximation with correction for ties otherwise. Full precision: '
        'comparisons.csv.')
    section.tables['Mann-Whitney U, two-sided, Holm-Bonferroni.'] = tables.all_comparisons(tested)
    return section
