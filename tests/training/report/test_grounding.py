"""Accuracy on unheard words, ears, equivalence and seeds, on results whose truth is known."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from tests.training.report.report_data import tables
from tests.training.study_files import ROOT, main_command, plain, run_inline
from training.grounding import accuracy
from training.report import behaviour, grounding, tidy
from training.report.about import equal_seeds, partial, seeds
from training.report.comparisons import comparisons, per_run, thresholds_m
from training.report.equivalence import (
    DIFFERS,
    EQUIVALENT,
    TOO_FEW,
    UNDECIDED,
    difference,
    of_effect,
    paired,
)
from training.report.findings import beyond, findings
from training.report.grounding_section import grounding_section
from training.report.statistics import compare_all
from training.report.verdicts import UNTESTED, too_few_seeds, withheld
from training.study.lexicon import load_lexicon
from w2b_core.hearing import judge, places
from w2b_core.vocabulary import Vocabulary

PANEL = ('paper', 'minimal')


@pytest.fixture
def store() -> dict[str, pd.DataFrame]:
    """
    Results of champions: E is right under every word, C under the trained words and stop words.

    In PyBullet E is right in every second run.
    """
    store = tables({PANEL: 1.0}, seeds=12)
    rows = store['robustness']
    # “back” shares its stem with a command; “rear” does not.
    rows.loc[rows.word == 'back', 'word'] = 'rear'
    there = rows[(rows.condition == 'perturbed')].assign(condition='pybullet', engine='pybullet')
    odd = (there.treatment == 'experimental') & (there.seed % 2 == 1) & (there.role == 'held_out')
    there.loc[odd, ['final_x_m', 'displacement_m']] = 1.0
    store['robustness'] = pd.concat([rows, there], ignore_index=True)
    return store


def accuracies(store: dict[str, pd.DataFrame]) -> pd.DataFrame:
    limits = thresholds_m(per_run(store['runs'], store['outcomes'], store['robustness']))
    own = behaviour.own_words(store['outcomes'], store['robustness'], limits)
    return grounding.accuracies(own, store['robustness'], limits,
                                grounding.words_of_other_stems())


def test_accuracies_are_those_that_were_put_in(store: dict[str, pd.DataFrame]) -> None:
    means = accuracies(store).groupby('treatment')[[*grounding.PLACES]].mean()
    assert means.loc['experimental'].tolist() == [1.0, 1.0, 0.5, 1.0]
    # Control champions stand under every word of the lexicon: right for a third of the classes.
    assert means.loc['control'].tolist() == pytest.approx([0.0, 0.0, 0.0, 1 / 3])


def test_a_lexicon_that_lacks_a_behaviour_gives_no_accuracy(store: dict[str, pd.DataFrame]) -> None:
    store['robustness'] = store['robustness'][store['robustness'].word != 'rear']
    assert accuracies(store).lexicon.isna().all()


def test_no_word_of_other_stems_shares_one_with_a_command() -> None:
    words = grounding.words_of_other_stems()
    every = [word for group in words.values() for word in group]
    assert len(every) == len(set(every))
    said = (ROOT / 'docs' / 'study' / 'README.md').read_text(encoding='utf-8')
    assert f'on {len(every)} words of the lexicon that share no stem' in ' '.join(said.split())
    for stem in ('stop', 'halt', 'ceas', 'cess', 'suspen', 'forward', 'back'):
        assert not [word for word in every if word.startswith(stem)]
    study = load_lexicon()
    assert all(set(group) <= set(study[name]) for name, group in words.items())


def test_ears_hear_no_word_that_they_are_asked(
        store: dict[str, pd.DataFrame], monkeypatch: pytest.MonkeyPatch) -> None:
    real, nearest = accuracy.logistic, []

    def watching(points: np.ndarray, labels: np.ndarray, classes: int
                 ) -> Callable[[np.ndarray], np.ndarray]:
        answer = real(points, labels, classes)

        def asked(others: np.ndarray) -> np.ndarray:
            # Unit vectors: a word that was heard and is asked has the cosine 1 to itself.
            nearest.append((others @ points.T).max())
            return answer(others)
        return asked

    monkeypatch.setattr(accuracy, 'logistic', watching)
    found = grounding.ears(store['runs'], grounding.words_of_other_stems())
    assert len(nearest) == 2 * store['runs'].held_out.nunique()
    assert max(nearest) < 0.999
    assert len(found) == len(store['runs'])


def test_an_ear_without_its_metric_is_logistic_regression(store: dict[str, pd.DataFrame]) -> None:
    runs, words = store['runs'], grounding.words_of_other_stems()
    found = grounding.ears(runs, words).assign(held_out=runs.held_out.to_numpy())
    assert (found.groupby('held_out')[['ear', 'ear_lexicon']].nunique() == 1).all(axis=None)
    held_out = str(runs.held_out.iloc[0])
    row = found[found.held_out == held_out].iloc[0]
    vocabulary = Vocabulary.load('default')
    every = vocabulary.matrix(vocabulary.words[:places.SEARCHED_WORDS]).astype(float)
    mean = (every / np.linalg.norm(every, axis=1, keepdims=True)).mean(axis=0)

    def place(names: list[str]) -> np.ndarray:
        rows = vocabulary.matrix(names).astype(float)
        rows = rows / np.linalg.norm(rows, axis=1, keepdims=True) - mean
        return rows / np.linalg.norm(rows, axis=1, keepdims=True)

    trained = {'forward': 'forward', 'backward': 'backward', **{
        word: 'stop' for word in ('stop', 'cease', 'suspend', 'halt') if word != held_out}}
    kinds = list(words)
    classifier = judge.classify(place(list(trained)), np.array(
        [kinds.index(label) for label in trained.values()]), len(kinds))
    shares = [(classifier.logits(place(words[kind])).argmax(axis=1) == index).mean()
              for index, kind in enumerate(kinds)]
    assert row.ear_plain_lexicon == pytest.approx(np.mean(shares))
    # What the learned metric adds is far more than a draw of words could.
    assert row.ear_lexicon > row.ear_plain_lexicon + 0.1


def test_the_section_says_what_is_known(store: dict[str, pd.DataFrame]) -> None:
    limits = thresholds_m(per_run(store['runs'], store['outcomes'], store['robustness']))
    own = behaviour.own_words(store['outcomes'], store['robustness'], limits)
    section = grounding_section(store['runs'], own, store['robustness'], limits)
    means, effects, bodiless = section.tables.values()
    of = means.set_index('who')
    assert of.loc['champions E', 'words of other stems'] == '1.00 [1.00, 1.00]'
    assert of.loc['champions C', 'unheard word, as evolved'] == '0.00 [0.00, 0.00]'
    assert of.loc['ear', 'runs'] == '24'
    [row] = effects.to_dict('records')
    assert row['unheard word, as evolved'].startswith('+100 [')
    assert row['unheard word, as evolved'].endswith('differs')
    assert row['words of other stems'].startswith('+67 [')
    [row] = bodiless.to_dict('records')
    # The ear is right under the unheard stop word too: 12 pairs cannot show equality.
    assert row['ear: unheard word, as evolved'].startswith('+0 [')
    assert row['ear: unheard word, as evolved'].endswith('undecided')
    assert row['ear: words of other stems'].endswith('differs')
    assert set(section.figures) == {'grounding'}
    assert 'nan' not in ' '.join(frame.to_csv() for frame in section.tables.values())


@pytest.mark.parametrize(('truth', 'size', 'expected', 'least', 'most'), [
    # Of no difference, as good as all samples of this size say so; of one as large as the
    # margin, no more than the level of the two one-sided tests (5%, here of 300 draws).
    (0.0, 800, EQUIVALENT, 0.9, 1.0), (0.10, 800, EQUIVALENT, 0.0, 0.09),
    (0.10, 800, DIFFERS, 0.95, 1.0), (0.0, 800, DIFFERS, 0.0, 0.09),
    (0.0, 40, UNDECIDED, 0.9, 1.0)])
@pytest.mark.parametrize('kind', ['proportions', 'rates'])
def test_equivalence_is_claimed_as_often_as_its_level_allows(
        truth: float, size: int, expected: str, least: float, most: float, kind: str) -> None:
    rng = np.random.default_rng(7)
    said = []
    for _ in range(300):
        # Rates of ten starts spread less than single outcomes: larger samples stand for them.
        one, other = (rng.binomial(1, level, size) if kind == 'proportions'
                      else rng.beta(level, 1 - level, size) for level in (0.5 + truth, 0.5))
        found = difference(one, other)
        assert found is not None
        said.append(found.statement == expected
                    or (expected == DIFFERS and not (found.interval[0] <= 0 <= found.interval[1])))
    if kind == 'rates' and expected == UNDECIDED:
        least = 0.8
    assert least <= np.mean(said) <= most


def test_of_few_runs_and_of_samples_without_spread() -> None:
    few = difference(np.ones(3), np.zeros(3))
    assert few is not None
    assert few.statement == TOO_FEW
    assert difference([1.0], [0.0, 1.0]) is None
    same = difference(np.ones(20), np.ones(20))
    assert same is not None
    low, high = same.interval
    assert low < 0 < high, 'twenty equal pairs are no proof'
    assert same.statement == UNDECIDED
    many = difference(np.ones(100), np.ones(100))
    assert many is not None
    assert many.statement == EQUIVALENT
    pairs = paired(np.full(100, 1.0))
    assert pairs is not None
    assert pairs.estimate == 1.0
    assert pairs.statement == DIFFERS
    drawn = paired(np.random.default_rng(0).normal(0.0, 0.1, 400).clip(-1, 1))
    assert drawn is not None
    assert drawn.statement == EQUIVALENT


def test_effects_of_ranks_are_equal_different_or_unknown() -> None:
    def effect(shift: float, size: int) -> str:
        store = tables({PANEL: 1.0}, seeds=size)
        draw = np.random.default_rng(1).normal(0, 1, len(store['runs']))
        runs = store['runs']
        runs['fitness'] = draw + shift * (runs.treatment == 'experimental')
        table = per_run(runs, store['outcomes'], store['robustness'])
        [one] = [one for one in compare_all(comparisons(table))
                 if one.comparison.question == 'fitness: E against C']
        return of_effect(one)

    assert effect(0.0, 100) == EQUIVALENT
    assert effect(2.0, 30) == DIFFERS
    assert effect(0.0, 12) == UNDECIDED
    assert effect(0.0, 5) == TOO_FEW


def about(configured: int) -> dict[str, object]:
    return {'config': {'experiments': [
        {'words': 'paper', 'bodies': ['minimal'], 'treatments': ['experimental', 'control'],
         'seeds': configured}], 'robustness': {'perturbed_starts': 1, 'pybullet_starts': 0,
                                               'lexicon': True}}}


def test_too_few_seeds_give_no_verdict(store: dict[str, pd.DataFrame]) -> None:
    table = per_run(store['runs'], store['outcomes'], store['robustness'])
    tested = compare_all(comparisons(table))
    judged = [*findings(tested, table), *beyond(tested, table)]
    assert {one.verdict for one in judged} != {UNTESTED}
    complete, configured = seeds(store['runs'], about(100))
    assert (len(complete), configured) == (12, 100)
    reason = too_few_seeds(len(complete), configured)
    assert reason == '12 of 100 seeds: too few, no verdict'
    silent = withheld(judged, reason)
    assert {one.verdict for one in silent} == {UNTESTED}
    assert all(one.here.startswith(f'{reason}. So far: ') for one in silent)
    assert partial(store, about(100))[0] == f'{reason}.'
    # Sixty of a hundred are enough, twelve of twelve are all.
    assert too_few_seeds(60, 100) == too_few_seeds(*map(len, (complete, range(12)))) == ''
    assert withheld(judged, '') == judged
    assert too_few_seeds(59, 100)


def test_a_seed_counts_where_all_its_cells_are_done(store: dict[str, pd.DataFrame]) -> None:
    gone = 'paper-minimal-control-0003'
    partly = {name: frame[frame.run != gone] for name, frame in store.items()}
    complete, _ = seeds(partly['runs'], about(12))
    assert complete == set(range(12)) - {3}
    kept = equal_seeds(partly, about(12))
    assert (kept['runs'].groupby('treatment').seed.nunique() == 11).all()
    assert all(3 not in set(frame.seed) for frame in kept.values())


def test_the_table_of_outcomes_has_every_one_and_says_what_it_holds(tmp_path) -> None:  # type: ignore[no-untyped-def]
    study = tmp_path / 'study'
    run_inline(plain(), study)
    path = tmp_path / 'results.parquet'
    assert main_command('report', study, '--table', path) == 0
    assert not (study / 'report').exists()
    table = pq.read_table(path)
    rows = table.to_pandas()
    outcomes = pd.read_parquet(study / 'store' / 'outcomes.parquet')
    robustness = pd.read_parquet(study / 'store' / 'robustness.parquet')
    assert len(rows) == len(outcomes) + len(robustness)
    evolved = rows[rows.condition == 'evolved'].merge(outcomes, on=['run', 'word'])
    assert np.abs(evolved.final_x_m_x - evolved.final_x_m_y).max() <= 0.5e-4 + 1e-6
    assert table.schema.field('displacement_m').metadata[b'unit'] == b'm'
    before = path.read_bytes()
    assert main_command('report', study, '--table', path) == 0
    assert path.read_bytes() == before


def test_a_table_that_is_too_large_is_not_written(store, tmp_path, monkeypatch) -> None:  # type: ignore[no-untyped-def]
    monkeypatch.setattr(tidy, 'LARGEST_BYTES', 1000)
    with pytest.raises(ValueError, match=r'expected at most 1,000 bytes, the table of .* outcomes'):
        tidy.write_tidy(store, tmp_path / 'results.parquet')
    assert list(tmp_path.iterdir()) == []
