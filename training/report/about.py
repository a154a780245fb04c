"""What a study consists of and where it comes from: size, provenance, time, differences."""

from __future__ import annotations

from collections import Counter
from typing import Any

import pandas as pd

from training.report import tables
from training.report.comparisons import panels, select
from training.report.parts import Section, counted
from training.report.published import GENERATIONS, RUNS_AN_ARM, title
from training.report.verdicts import too_few_seeds
from training.study.directory import StudyDirectory, read_json
from training.study.lexicon import lexicon_sha256, load_lexicon
from training.study.store import Tables


def lead(runs: pd.DataFrame, about: dict[str, Any]) -> str:
    """Return the report's first sentences: how much was computed, with what."""
    identity = about['identity']
    cpu_s = float(runs.cpu_s.fillna(runs.wall_s).sum())
    return (f'{counted(len(runs), "evolutionary run")} of '
            f'{counted(identity["generations"], "generation")} and '
            f'{int(runs.evaluations.sum()):,} simulations in {core_time(cpu_s)}. Engine: '
            f'{identity["engine"]}, {identity["precision"]}. Objective: {identity["objective"]}. '
            f'Program {versions_of(runs)}, commit {commits(runs)}. Vocabulary '
            f'{identity["vocabulary"]}, its vectors’ hash {identity["vocabulary_sha256"][:12]}.')


def core_time(seconds: float) -> str:
    """Return CPU time in the unit that suits it."""
    if seconds < 60:
        return f'{seconds:.1f} core seconds'
    return (f'{seconds / 60:.1f} core minutes' if seconds < 3600
            else f'{seconds / 3600:.1f} core hours')


def commits(runs: pd.DataFrame) -> str:
    """Return the commits that made the runs, ten digits each, with a note of changes to them."""
    found = (str(commit).partition('+') for commit in runs.git_commit.fillna(''))
    return ', '.join(sorted({commit[:10] + plus + rest for commit, plus, rest in found
                             if commit})) or 'unknown'


def versions_of(runs: pd.DataFrame) -> str:
    """Return the versions of the program that made the runs."""
    return ', '.join(sorted({str(version) for version in runs.program_version if version}))


def _hashes(identity: dict[str, Any]) -> dict[str, str]:
    """Return what identifies the engine: its results for each body, in old studies its sources."""
    results = identity.get('results_sha256')
    if not isinstance(results, dict):
        return {'hash of the sources that decide a run': identity['sources_sha256']}
    return {f'hash of the engine’s results, {title("paper", body)}': results[body]
            for body in sorted(results)}


def seeds(runs: pd.DataFrame, about: dict[str, Any]) -> tuple[set[int], int]:
    """Return which of the configured seeds are complete in all their cells, and how many are."""
    wanted: dict[int, set[tuple[str, str, str]]] = {}
    for one in about['config']['experiments']:
        first = one.get('first_seed', 0)
        for seed in range(first, first + one['seeds']):
            wanted.setdefault(seed, set()).update(
                (one['words'], body, treatment) for body in one['bodies']
                for treatment in one['treatments'])
    there: dict[int, set[tuple[str, str, str]]] = {}
    for row in runs.itertuples():
        there.setdefault(int(row.seed), set()).add((row.word_set, row.body, row.treatment))
    return ({seed for seed, cells in wanted.items() if cells <= there.get(seed, set())},
            len(wanted))


def equal_seeds(store: Tables, about: dict[str, Any]) -> Tables:
    """Return a store's rows of complete seeds alone: as many runs in every cell that has a seed."""
    complete, _ = seeds(store['runs'], about)
    return {name: table[table.seed.isin(complete)] for name, table in store.items()}


def partial(store: Tables, about: dict[str, Any]) -> list[str]:
    """Return in sentences what of the configured study is missing, none if it is all there."""
    complete, configured = seeds(store['runs'], about)
    few = too_few_seeds(len(complete), configured)
    return [line for line in (f'{few[0].upper()}{few[1:]}.' if few else '',
                              _unfinished(store['runs'], about), _unscored(store, about)) if line]


def _unscored(store: Tables, about: dict[str, Any]) -> str:
    """Return how many champions wait for what `python -m training robustness` does."""
    plan = about['config']['robustness']
    runs, scored = len(store['runs']), store['robustness'].run.nunique()
    if scored >= runs or not (plan['perturbed_starts'] or plan['pybullet_starts']
                              or plan['lexicon']):
        return ''
    return (f'Partial: {runs - scored} of {counted(runs, "champion")} not scored yet from other '
            'starts, in PyBullet and under the lexicon. What is said of robustness may still '
            'change.')


def _unfinished(runs: pd.DataFrame, about: dict[str, Any]) -> str:
    configured: Counter[tuple[str, str, str]] = Counter()
    for one in about['config']['experiments']:
        for body in one['bodies']:
            for treatment in one['treatments']:
                configured[one['words'], body, treatment] += one['seeds']
    there = Counter(zip(runs.word_set, runs.body, runs.treatment, strict=True))
    missing = configured - there
    if not missing:
        return ''
    return (f'Partial: {sum(missing.values())} of {sum(configured.values())} configured runs '
            'not finished yet (' + ', '.join(
                f'{title(words, body)} {treatment} {there[words, body, treatment]} of '
                f'{configured[words, body, treatment]}'
                for words, body, treatment in missing)
            + '). Numbers and verdicts may still change.')


def provenance_section(study: StudyDirectory, runs: pd.DataFrame, about: dict[str, Any]) -> Section:
    """Return the part on what made the runs, as every run's provenance.json has it."""
    identity = about['identity']
    places = [read_json(study.run_directory(run) / 'provenance.json')['environment']
              for run in runs.run]
    started = sorted(place['started_utc'] for place in places if place.get('started_utc'))
    versions: dict[str, set[str]] = {'python': {str(place.get('python')) for place in places}}
    for place in places:
        for name, version in place.get('packages', {}).items():
            versions.setdefault(name, set()).add(version or 'none')
    rows = {
        'study': about['config']['name'],
        'program version': versions_of(runs),
        'commit': commits(runs),
        **_hashes(identity),
        'engine, precision': f'{identity["engine"]}, {identity["precision"]}',
        'objective': identity['objective'],
        'population, generations': f'{identity["population"]}, {identity["generations"]:,}',
        'vocabulary': identity['vocabulary'],
        'hash of the commands’ vectors': identity['vocabulary_sha256'],
        'hash of the lexicon': lexicon_sha256(load_lexicon()),
        'runs started (UTC)': f'{started[0]} to {started[-1]}' if started else 'unknown',
        'versions': ', '.join(f'{name} {" / ".join(sorted(found))}'
                              for name, found in versions.items()),
        'machines': str(len({place.get('host') for place in places})),
    }
    section = Section('Provenance')
    section.paragraphs.append(
        'Every run keeps this beside its champion; runs of another identity (engine and its '
        'results, objective, population, generations, vectors) are refused, so all runs of this '
        'report share it. Same seed, same bits: any run can be made again and compared.')
    section.tables['What made the runs.'] = pd.DataFrame(
        {'value': list(rows.values())}, index=pd.Index(list(rows), dtype=object))
    return section


def differences(runs: pd.DataFrame, about: dict[str, Any]) -> list[str]:
    """Return in what this study is not the paper's, in sentences."""
    identity = about['identity']
    arms = runs.groupby(['word_set', 'body', 'treatment']).size()
    lengths = {body: float(select(runs, (word_set, body)).body_length_m.iloc[0])
               for word_set, body in panels(runs)}
    size = (f'{arms.min()} to ' if arms.min() < arms.max() else '') + counted(arms.max(), 'run')
    lines = [
        f'Size: {size} a body and treatment where the paper has {RUNS_AN_ARM}, '
        'so differences that are significant there may not be so here.',
        f'Engine: {identity["engine"]} ({identity["precision"]}), where the paper used Pyrosim on '
        'ODE 0.12; how closely it repeats recorded evaluations: `python -m training fidelity`.',
    ]
    if identity['generations'] != GENERATIONS:
        lines.insert(1, f'Length: {counted(identity["generations"], "generation")} where the paper '
                     f'has {GENERATIONS:,}.')
    if identity['objective'] == 'program':
        lines.append('Objective: the published program’s. Under stop words it takes away the '
                     'length of the path in x-y; the paper’s text says the final distance.')
    if 'balanced' in set(runs.word_set):
        lines.append('Balanced set: trained on “forwards”, where the paper has the misspelling '
                     '“foward”, which the vocabulary lacks.')
    lines += [
        'World: gravity of -1 m/s² and viscous contact, as in the published program; the paper '
        'does not mention them.',
        'Spheres with sensors feel their joint’s angle, as the paper says; in the published '
        'program a defect wired those synapses to a motor neuron.',
        'Unit of the statistics: the run. A run’s displacement under several commands enters as '
        'their mean. The paper does not say how it pooled commands.',
        'Comparisons: the paper’s 56, and those on robustness, all corrected together, which asks '
        'more of each.',
        'Body lengths: ' + ', '.join(
            f'{title("paper", body)} {length:g} m' for body, length in lengths.items())
        + '. The paper does not state its own.',
        'The paper prints no heights of its figures’ bars: beside figures stand the claims of its '
        'text, beside tables its numbers.',
    ]
    return lines


def time_section(runs: pd.DataFrame) -> Section:
    """Return the part on what runs cost, and the paper’s study would."""
    section = Section('Time')
    section.tables['Times of runs, one core each.'], hours = tables.timing(runs)
    section.paragraphs.append(
        'Projected from these runs: the paper’s study (1,200 runs and 200 of the balanced set, '
        f'{GENERATIONS:,} generations) takes {hours:.1f} core hours, {hours / 2:.1f} hours on two '
        'cores of its own. It rests on CPU times where they are known: wall times count what else '
        'the machine did.' if hours is not None else
        'The projection for the paper’s study needs runs of all its bodies and the balanced set.')
    return section
