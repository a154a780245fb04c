"""What a report says, before it becomes a page: text, tables, figures and verdicts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from training.evolution.run import load_result
from training.evolution.vectors import vectors
from training.report import behaviour, comparisons, exemplars, figures, figures_priming, tables
from training.report.comparisons import Panel
from training.report.findings import findings
from training.report.parts import Content, Section
from training.report.published import ALPHA, COMMANDS, COMPARISONS, GENERATIONS, RUNS_AN_ARM, TITLES
from training.report.robustness import robustness_section
from training.report.statistics import Tested, compare_all
from training.study.directory import StudyDirectory, StudyError
from training.study.store import Tables, parse_run_id
from w2b_sim import bodies


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
    table = comparisons.per_run(runs, store['outcomes'])
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
                robustness_section(store, rates, limits, shown, about),
                _comparisons_section(tested), _time_section(runs)]
    return Content(
        f'Word2vec to behavior: the study “{about["config"]["name"]}”', _lead(runs, about),
        findings(tested, table), differences(runs, about),
        [section for section in sections if section is not None], tested)


def _lead(runs: pd.DataFrame, about: dict[str, Any]) -> str:
    identity = about['identity']
    commits = sorted({commit for commit in runs.git_commit if commit})
    return (f'{len(runs)} evolutionary runs of {identity["generations"]:,} generations, '
            f'{int(runs.evaluations.sum()):,} simulations in {runs.wall_s.sum() / 3600:.1f} '
            f'hours (sum of wall times, one core each). Engine {identity["engine"]}, '
            f'{identity["precision"]}; program {identity["program_version"]}, '
            f'sources {identity["sources_sha256"][:12]}, '
            f'commit {", ".join(commit[:10] for commit in commits) or "unknown"}; vocabulary '
            f'{identity["vocabulary"]}, vectors {identity["vocabulary_sha256"][:12]}.')


def differences(runs: pd.DataFrame, about: dict[str, Any]) -> list[str]:
    """Return in what this study is not the paper's, in sentences."""
    identity = about['identity']
    arms = runs.groupby(['word_set', 'body', 'treatment']).size()
    lines = [
        f'Size: {arms.min()} to {arms.max()} runs a body and treatment where the paper has '
        f'{RUNS_AN_ARM}, so differences that are significant there may not be so here.',
        f'Engine: {identity["engine"]} ({identity["precision"]}), where the paper used Pyrosim on '
        'ODE 0.12; how closely it repeats recorded evaluations: `python -m training fidelity`.',
    ]
    if identity['generations'] != GENERATIONS:
        lines.insert(1, f'Length: {identity["generations"]:,} generations where the paper has '
                     f'{GENERATIONS:,}.')
    if identity['objective'] == 'program':
        lines.append('Objective: the published program’s. Under stop words it takes away the '
                     'length of the path in x-y; the paper’s text says the final distance.')
    lines += [
        'World: gravity of -1 m/s² and viscous contact, as in the published program; the paper '
        'does not mention them.',
        'Spheres with sensors feel their joint’s angle, as the paper says; in the published '
        'program a defect wired those synapses to a motor neuron.',
        'Unit of the statistics: the run. A run’s displacement under several commands enters as '
        'their mean. The paper does not say how it pooled commands.',
        'Body lengths: ' + ', '.join(
            f'{TITLES.get(body, body)} {length:g} m' for body, length in
            runs.groupby('body', sort=False).body_length_m.first().items())
        + '. The paper does not state its own.',
        'The paper prints no heights of its figures’ bars: beside figures stand the claims of its '
        'text, beside tables its numbers.',
    ]
    return lines


def _vectors_section(runs: pd.DataFrame, about: dict[str, Any]) -> Section:
    vocabulary = about['identity']['vocabulary']
    section = Section('Tables I and II: the commands’ vectors')
    heard = vectors(vocabulary, COMMANDS)
    first, largest = tables.table_1(heard)
    section.tables['Table I. Cosines of the commands’ vectors: here (paper).'] = first
    section.paragraphs.append('Table I: largest difference to the paper after rounding: '
                              f'{largest:.2f}.')
    control = runs[(runs.treatment == 'control') & (runs.word_set == 'paper')]
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
    body = 'quadruped' if 'quadruped' in set(table.body) else str(table.body.iloc[0])
    chosen = exemplars.choose(table, store['outcomes'], limits, body)
    chosen = [one for one in chosen if (study.run_directory(one.run) / 'champion.json').exists()]
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
    section.paragraphs.append(f'How the three were chosen: {exemplars.RULE}')
    section.paragraphs.append('Shown: ' + '; '.join(
        f'{"abc"[number]} {one.run} ({one.kind}{"" if one.met else "; no such champion"})'
        for number, one in enumerate(chosen)) + '.')
    section.paragraphs.append(
        'The paper’s three: an experimental champion that is right under every word, a control '
        'champion that fails in training and under the unheard word, and a control champion that '
        'is right in training and fails under the unheard word.')
    section.add_figure('priming', figures_priming.priming(
        chosen, shown, length_m=bodies.get(body).length_m),
        'Hidden neurons while a command’s vector passes through the auditory neuron (rows: words; '
        'the last one is the unheard word), and the way of the body under each command; squares '
        'mark the end.')
    return section


def _displacement_section(table: pd.DataFrame, tested: Sequence[Tested],
                          shown: Sequence[Panel]) -> Section:
    section = Section('Figures 5 and 6: displacement')
    main = [panel for panel in shown if panel[0] == 'paper']
    if main:
        section.add_figure('displacement', figures.bars(table, tested, main), (
            'Median net displacement of run champions by body, command meaning and treatment; '
            'whiskers: bootstrapped 95% confidence intervals of the median; dots: champions. '
            f'Stars: Mann-Whitney U, Holm-Bonferroni over all {len(tested)} comparisons: * 0.01, '
            '** 0.001, *** 0.0001; red: word2vec against control under the unheard word. Paper '
            '(figure 5): significant red brackets in four of six bodies.'))
    balanced = [panel for panel in shown if panel[0] != 'paper']
    if balanced:
        beside = [('paper', panel[1]) for panel in balanced if ('paper', panel[1]) in shown]
        section.add_figure('balanced', figures.bars(table, tested, beside + balanced), (
            'The balanced set beside the paper’s set. Paper (figure 6): control champions move '
            'more under the unheard than under the trained stop words, almost as far as under '
            'move commands; word2vec champions do not.'))
    section.tables['Medians [95% intervals] in body lengths; right: median progress in metres '
                   'under the trained move commands.'] = tables.displacement(table)
    return section


def _comparisons_section(tested: Sequence[Tested]) -> Section:
    section = Section('All comparisons')
    section.paragraphs.append(
        f'{len(tested)} comparisons, all of them corrected together (the paper: {COMPARISONS}). '
        f'Claims about displacement use the level {ALPHA}, as the paper’s stars do. Common '
        'language: the probability that a run of the first sample exceeds one of the second; '
        'rank-biserial: twice that minus 1. Exact distribution of U where there are no ties.')
    section.tables['Mann-Whitney U, two-sided, Holm-Bonferroni.'] = tables.all_comparisons(tested)
    return section


def _time_section(runs: pd.DataFrame) -> Section:
    section = Section('Time')
    section.tables['Times of runs, one core each.'], hours = tables.timing(runs)
    section.paragraphs.append(
        'Projected from these runs: the paper’s study (1,200 runs and 200 of the balanced set, '
        f'{GENERATIONS:,} generations) takes {hours:.1f} core hours, {hours / 2:.1f} hours on two '
        'cores of its own. It rests on CPU times where they are known: wall times count what else '
        'the machine did.' if hours is not None else
        'The projection for the paper’s study needs runs of all its bodies and the balanced set.')
    return section
