"""From outcomes to comparisons, rates and verdicts, on results whose answers are known."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from tests.training.report.report_data import tables
from training.report import behaviour
from training.report.comparisons import comparisons, panels, per_run, right, select, thresholds_m
from training.report.exemplars import choose
from training.report.findings import beyond, findings
from training.report.published import COMPARISONS, FITNESS, TITLES
from training.report.statistics import compare_all
from training.report.verdicts import (
    CONSISTENT,
    HOLDS,
    HOLDS_IN_PART,
    HOLDS_NOT,
    IN_PART,
    NOT,
    REPLICATES,
    UNTESTED,
)

WHOLE = {**{('paper', body): 1.0 for body in TITLES}, ('balanced', 'quadruped'): 1.0}


@pytest.fixture(scope='module')
def store() -> dict[str, pd.DataFrame]:
    return tables(WHOLE)


def test_the_papers_fifty_six_comparisons_are_made(store: dict[str, pd.DataFrame]) -> None:
    made = comparisons(per_run(store['runs'], store['outcomes']))
    assert len(made) == COMPARISONS == 56
    assert len({(one.panel, one.question) for one in made}) == 56


def test_robustness_adds_its_comparisons(store: dict[str, pd.DataFrame]) -> None:
    table = per_run(store['runs'], store['outcomes'], store['robustness'])
    made = comparisons(table)
    assert len(made) == 63, 'perturbed starts; these data have no PyBullet'
    perturbed = next(one for one in made if one.panel == 'Minimal'
                     and one.question == 'test, perturbed starts: E against C')
    assert len(perturbed.first.values) == 12
    rates = behaviour.lexicon(store['robustness'], thresholds_m(table))
    assert len(comparisons(table, behaviour.selectivity(rates))) == 70


def test_an_exploded_outcome_is_left_out_and_never_right() -> None:
    small = tables({('paper', 'quadruped'): 1.0}, seeds=2)
    outcomes, run = small['outcomes'], small['runs'].run.iloc[0]
    first = (outcomes.run == run) & (outcomes.word == 'forward')
    outcomes.loc[first, ['largest_step_m', 'displacement_m', 'final_x_m']] = [0.5, 40.0, 40.0]
    unheard = (outcomes.run == run) & (outcomes.role == 'held_out')
    outcomes.loc[unheard, ['displacement_m', 'final_x_m']] = np.nan
    table = per_run(small['runs'], outcomes).set_index('run')
    backward = outcomes[(outcomes.run == run) & (outcomes.word == 'backward')].displacement_m
    assert table.move[run] == pytest.approx(backward.iloc[0] / 0.1)
    assert np.isnan(table.test[run])
    made = {one.question: one for one in comparisons(table.reset_index())}
    assert len(made['test: E against C'].first.values) == 1
    assert len(made['move: E against C'].first.values) == 2
    compare_all(list(made.values()))
    state = behaviour.sorted_out(outcomes, {'quadruped': 0.25}).set_index('run')
    assert not state.trained[run]
    assert not state.unheard[run]


def test_exemplars_are_of_their_kind_and_counted(store: dict[str, pd.DataFrame]) -> None:
    table = per_run(store['runs'], store['outcomes'])
    limits = thresholds_m(table)
    first, second, third = choose(table, store['outcomes'], limits, ('paper', 'minimal'))
    assert (first.count, first.among, first.met) == (12, 12, True)
    # Right in training, wrong under the unheard word: so are all control champions here.
    assert (second.count, second.met) == (0, False)
    assert (third.count, third.met) == (12, True)
    arm = select(table, ('paper', 'minimal'), 'experimental').sort_values('fitness')
    assert first.run == arm.run.iloc[6], 'the median, of two the fitter'
    assert choose(table, store['outcomes'], limits, ('paper', 'none')) == []


def test_stopping_follows_the_cosine_only_where_it_does(store: dict[str, pd.DataFrame]) -> None:
    limits = thresholds_m(per_run(store['runs'], store['outcomes']))
    nearest = {'ahead': 0.15, 'back': 0.15, 'pause': 0.6, 'wait': 0.4, 'doctor': 0.05, 'text': 0.0}
    shares = behaviour.by_cosine(store['robustness'], limits, nearest)
    mean = shares.groupby(['treatment', 'cosine']).stopped.mean()
    assert mean['experimental'].to_dict() == pytest.approx(
        {0.025: 0.0, 0.15: 0.0, 0.4: 1.0, 0.6: 1.0})
    assert set(mean['control']) == {1.0}
    assert shares.groupby('run').words.sum().eq(6).all()


def test_thresholds_stand_in_the_papers_order(store: dict[str, pd.DataFrame]) -> None:
    table = per_run(store['runs'], store['outcomes'])
    limits = thresholds_m(table)
    assert list(limits) == list(TITLES)
    assert thresholds_m(table, 0.5)['minimal'] == pytest.approx(2 * limits['minimal'])


def test_a_run_enters_a_sample_once_in_body_lengths() -> None:
    small = tables({('paper', 'quadruped'): 1.0}, seeds=2)
    table = per_run(small['runs'], small['outcomes'])
    run = table.run.iloc[0]
    rows = small['outcomes'][small['outcomes'].run == run]
    moves = rows[(rows.role == 'trained') & (rows.behaviour != 'stop')].displacement_m
    assert table.move.iloc[0] == pytest.approx(moves.mean() / 0.1)
    stops = rows[(rows.role == 'trained') & (rows.behaviour == 'stop')].displacement_m
    assert len(stops) == 3
    assert table['stop'].iloc[0] == pytest.approx(stops.mean() / 0.1)
    assert table.forward_m.iloc[0] > 0
    assert table.backward_m.iloc[0] > 0
    assert len(table) == 4


def test_panels_stand_in_the_papers_order(store: dict[str, pd.DataFrame]) -> None:
    shuffled = store['runs'].sample(frac=1, random_state=0)
    assert panels(shuffled) == [*(('paper', body) for body in FITNESS), ('balanced', 'quadruped')]
    assert len(select(shuffled, ('paper', 'minimal'), 'control')) == 12


def test_right_is_right() -> None:
    classes = pd.Series(['forward', 'forward', 'backward', 'stop', 'stop', 'stop', 'forward'])
    x = pd.Series([0.3, 0.1, -0.3, 0.0, 0.25, np.nan, 5.0])
    y = pd.Series([9.0, 0.0, 0.0, 0.2, 0.0, 0.0, 0.0])
    step = pd.Series([0.01] * 6 + [0.5])
    judged = right(classes, x, np.hypot(x, y), step, pd.Series([0.2] * 7))
    assert judged.tolist() == [True, False, True, True, False, False, False]


def test_rates_and_their_baseline(store: dict[str, pd.DataFrame]) -> None:
    limits = thresholds_m(per_run(store['runs'], store['outcomes']))
    assert limits['quadruped'] == pytest.approx(0.25, rel=0.1)
    own = behaviour.own_words(store['outcomes'], store['robustness'], limits)
    held_out = own[own.question == 'held out'].groupby('treatment').rate.mean()
    assert held_out.to_dict() == {'control': 0.0, 'experimental': 1.0}
    assert (own[own.question == 'forward'].rate == 1).all()
    rates = behaviour.lexicon(store['robustness'], limits)
    stop = rates[rates.behaviour == 'stop'].groupby('treatment')[['synonyms', 'unrelated']].mean()
    # Control champions are right on every stop word, and deserve no credit for it.
    assert stop.loc['control'].tolist() == [1.0, 1.0]
    assert stop.loc['experimental'].tolist() == [1.0, 0.0]
    selectivity = behaviour.selectivity(rates).groupby('treatment').selectivity.mean()
    assert selectivity.to_dict() == {'control': 0.0, 'experimental': 1.0}


def test_verdicts_follow_their_rules(store: dict[str, pd.DataFrame]) -> None:
    table = per_run(store['runs'], store['outcomes'])
    verdicts = {one.claim[:45]: one for one in findings(
        compare_all(comparisons(table)), table)}
    assert verdicts['Robots move more under the move than under th'].verdict == REPLICATES
    assert verdicts['No body shows a difference between word2vec a'].verdict == CONSISTENT
    # In all six bodies, where the paper has four: at least as much as it claims.
    assert verdicts['Under the unheard stop word, word2vec robots '].verdict == REPLICATES
    # Here only control moves under the unheard word, and in the quadruped too.
    assert verdicts['Robots move more under the unheard than under'].verdict == NOT
    assert verdicts['Training performance differs between the trea'].verdict == NOT
    assert verdicts['Balanced set, control: more movement under th'].verdict == REPLICATES
    assert verdicts['Balanced set, word2vec: no difference between'].verdict == CONSISTENT
    assert verdicts['Balanced set, control: almost as much movemen'].verdict == REPLICATES
    # In all bodies alike: nothing here says that the body matters.
    assert verdicts['Morphology facilitates or obstructs the groun'].verdict == NOT
    assert verdicts['Balanced set: under the unheard stop word, wo'].verdict == REPLICATES
    assert len(verdicts) == 11


@pytest.mark.parametrize(('raised', 'by', 'verdict'), [
    (('spherical_1dof_sensors',), 1.0, REPLICATES),
    (('spherical_1dof_sensors', 'quadruped'), 1.0, IN_PART),
    (('spherical_1dof_sensors',), -1.0, NOT),
    # The other bodies agree with the paper, or all but one: that shows nothing.
    ((), 1.0, NOT), (('spherical_2dof_sensors',), 1.0, NOT)])
def test_a_difference_in_one_body_only_is_decided_by_that_body(
        store: dict[str, pd.DataFrame], raised: tuple[str, ...], by: float, verdict: str) -> None:
    runs = store['runs'].copy()
    better = runs.body.isin(raised) & (runs.treatment == 'experimental')
    runs.loc[better, 'fitness'] += by
    table = per_run(runs, store['outcomes'])
    [one] = [one for one in findings(compare_all(comparisons(table)), table)
             if one.claim.startswith('Training performance')]
    assert one.verdict == verdict
    if 'spherical_1dof_sensors' not in raised:
        assert 'not in 1DOF sphere with sensors' in one.here


def test_beyond_the_paper(store: dict[str, pd.DataFrame]) -> None:
    table = per_run(store['runs'], store['outcomes'], store['robustness'])
    rates = behaviour.lexicon(store['robustness'], thresholds_m(table))
    tested = compare_all(comparisons(table, behaviour.selectivity(rates)))
    words, perturbed, pybullet, lexicon = beyond(tested, table)
    assert (words.verdict, perturbed.verdict, lexicon.verdict) == (HOLDS, HOLDS, HOLDS)
    assert (pybullet.verdict, pybullet.here) == (UNTESTED, 'not scored')
    # Where control champions stop from perturbed starts, the difference is gone.
    moved = store['robustness'].copy()
    moved.loc[(moved.body == 'minimal') & (moved.role == 'held_out'), 'displacement_m'] = 0.01
    table = per_run(store['runs'], store['outcomes'], moved)
    _, perturbed, *_ = beyond(compare_all(comparisons(table)), table)
    assert perturbed.verdict == HOLDS_IN_PART
    assert 'not in Minimal' in perturbed.here


def test_a_body_that_never_goes_backward_is_named(store: dict[str, pd.DataFrame]) -> None:
    outcomes = store['outcomes'].copy()
    outcomes.loc[(outcomes.body == 'minimal') & (outcomes.behaviour == 'backward'),
                 ['final_x_m', 'displacement_m']] = 0.2
    table = per_run(store['runs'], outcomes)
    tested = compare_all(comparisons(table))
    moves = findings(tested, table)[0]
    assert moves.verdict == REPLICATES, 'the mean over both words is still larger than of stops'
    assert 'no champion goes the asked way under one of them in Minimal (backward: 0 of 24)' in (
        moves.here)
    words = beyond(tested, table)[0]
    assert words.verdict == HOLDS_IN_PART
    assert words.here == ('under both in 6 of 7 places; fewer in Minimal (backward: 0 of 24)')


def test_a_word_under_which_the_simulator_exploded_is_not_obeyed() -> None:
    small = tables({('balanced', 'quadruped'): 1.0}, seeds=10)
    outcomes = small['outcomes']
    # One of the two forward words, in all runs.
    outcomes.loc[outcomes.word == 'forwards', 'largest_step_m'] = 0.5
    table = per_run(small['runs'], outcomes)
    assert table.forward_m.notna().all()
    assert table.forward_least_m.isna().all()
    words = beyond(compare_all(comparisons(table)), table)[0]
    assert words.here.endswith('fewer in Quadruped, balanced set (forward: 0 of 20)')
    assert words.verdict == HOLDS_NOT


def test_that_the_body_matters_takes_effects_that_differ() -> None:
    """Significant in one body and in no other, far apart or near."""
    apart = tables(WHOLE, seeds=20)
    outcomes = apart['outcomes']
    unheard = (outcomes.role == 'held_out') & (outcomes.body != 'quadruped')
    outcomes.loc[unheard, 'displacement_m'] = np.random.default_rng(0).uniform(size=unheard.sum())
    table = per_run(apart['runs'], outcomes)
    found = findings(compare_all(comparisons(table)), table)
    [morphology] = [one for one in found if one.claim.startswith('Morphology')]
    assert morphology.verdict == REPLICATES
    assert 'significant in 1 of 6' in morphology.here


def test_claims_about_six_bodies_are_not_judged_on_one() -> None:
    small = tables({('paper', 'quadruped'): 1.0})
    table = per_run(small['runs'], small['outcomes'])
    found = findings(compare_all(comparisons(table)), table)
    untested = [one for one in found if one.verdict == UNTESTED]
    assert len(untested) == 4
    assert all('2DOF sphere without sensors' in one.here for one in untested)


def test_too_few_runs_decide_nothing() -> None:
    small = tables(WHOLE, seeds=6)
    table = per_run(small['runs'], small['outcomes'])
    found = findings(compare_all(comparisons(table)), table)
    # 6 against 6: p is at least 2 / C(12, 6) = 0.0022, and 56 times that after correction.
    assert all(one.verdict == UNTESTED and 'cannot give a corrected p below 0.12' in one.here
               for one in found[:-1])
