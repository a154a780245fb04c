"""Hypothesis tests: against scipy, statsmodels and numbers worked out by hand."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from training.report.statistics import (
    Comparison,
    Sample,
    common_language_interval,
    compare_all,
    median_error,
    median_interval,
)


def compared(first: list[float], second: list[float], question: str = 'q') -> Comparison:
    return Comparison('panel', question, Sample('a', np.array(first)),
                      Sample('b', np.array(second)))


def test_three_against_three_without_overlap() -> None:
    # Of the 20 ways to deal 6 ranks into two threes, 2 are as extreme: p = 0.1.
    [tested] = compare_all([compared([4, 5, 6], [1, 2, 3])])
    assert (tested.u, tested.method) == (9.0, 'exact')
    assert tested.p == pytest.approx(0.1)
    assert (tested.common_language, tested.rank_biserial) == (1.0, 1.0)


def test_holm_steps_down_over_all_comparisons() -> None:
    far, near = ([10.0 + i for i in range(8)], [0.5 + i for i in range(8)])
    tested = compare_all([compared(far, list(map(float, range(8))), 'far'),
                          compared(near, list(map(float, range(8))), 'near')])
    assert tested[0].p_holm == pytest.approx(2 * tested[0].p)
    assert tested[1].p_holm == pytest.approx(max(tested[1].p, 2 * tested[0].p))
    alone = compare_all([tested[0].comparison])
    assert alone[0].p_holm == alone[0].p


def test_ties_use_the_corrected_normal_approximation() -> None:
    [tested] = compare_all([compared([0, 0, 1, 2], [0, 1, 1, 3])])
    assert tested.method == 'asymptotic'
    [equal] = compare_all([compared([0, 0], [0, 0, 0])])
    assert (equal.p, equal.rank_biserial, equal.u) == (1.0, 0.0, 3.0)


@settings(max_examples=20, deadline=None)
@given(st.lists(st.integers(-50, 50), min_size=2, max_size=12),
       st.lists(st.integers(-50, 50), min_size=2, max_size=12))
def test_effect_sizes_are_what_they_say(first: list[int], second: list[int]) -> None:
    one, other = compare_all([compared(first, second)]), compare_all([compared(second, first)])
    pairs = list(product(first, second))
    larger = sum(a > b for a, b in pairs) + 0.5 * sum(a == b for a, b in pairs)
    assert one[0].common_language == pytest.approx(larger / len(pairs))
    assert one[0].rank_biserial == pytest.approx(-other[0].rank_biserial)
    assert one[0].p == pytest.approx(other[0].p)


def test_stars_are_the_papers() -> None:
    rng = np.random.default_rng(0)
    base = rng.normal(size=30)
    stars = [compare_all([compared(list(base + shift), list(rng.normal(size=30)))])[0].stars
             for shift in (0.0, 3.0)]
    assert stars == ['', '***']


@pytest.mark.parametrize(('values', 'said'), [
    ([], '0 numbers'), ([1.0, float('nan')], '1 of them not finite')])
def test_a_sample_with_holes_is_refused_and_named(values: list[float], said: str) -> None:
    with pytest.raises(ValueError, match='panel, q: sample') as refused:
        compare_all([compared(values, [1.0, 2.0])])
    assert said in str(refused.value)


def test_the_interval_covers_the_median_about_as_often_as_it_says() -> None:
    rng = np.random.default_rng(1)
    covered = 0
    for seed in range(200):
        low, high = median_interval(rng.exponential(size=30), resamples=500, seed=seed)
        covered += low <= np.log(2) <= high
    assert 0.88 <= covered / 200 <= 0.99


def test_degenerate_intervals() -> None:
    assert median_interval([3.0, 3.0]) == (3.0, 3.0)
    assert median_error([3.0, 3.0]) == 0.0
    assert all(np.isnan(value) for value in median_interval([]))
    assert median_interval([1, 5, 2, 8]) == median_interval([1, 5, 2, 8]), 'seeded'


def test_the_error_of_a_median_is_near_theory() -> None:
    values = np.random.default_rng(2).normal(size=400)
    # Asymptotic standard error of a normal sample's median: 1.2533 sigma / sqrt(n).
    assert median_error(values) == pytest.approx(1.2533 / 20, rel=0.35)


def test_the_interval_of_an_effect_is_newcombes() -> None:
    # The ends solve (x - estimate)^2 = z^2 var(x), with var(x) worked out by hand for 10 and 10:
    # x (1 - x) (1 + 9 (1 - x) / (2 - x) + 9 x / (1 + x)) / 100.
    for estimate in (0.2, 0.5, 0.9):
        for x in common_language_interval(estimate, 10, 10):
            variance = x * (1 - x) * (1 + 9 * (1 - x) / (2 - x) + 9 * x / (1 + x)) / 100
            assert (x - estimate) ** 2 == pytest.approx(1.959964 ** 2 * variance, rel=1e-5)
    low, high = common_language_interval(0.5, 10, 10)
    assert low + high == pytest.approx(1), 'symmetric'


def test_samples_without_overlap_have_an_interval_with_a_width() -> None:
    [tested] = compare_all([compared([float(10 + i) for i in range(20)],
                                     [float(i) / 2 for i in range(20)])])
    low, high = tested.interval
    assert (tested.rank_biserial, high) == (1.0, 1.0)
    assert 0.6 < low < 0.95
    assert common_language_interval(0.0, 1, 1)[0] == 0.0
    assert common_language_interval(0.0, 1, 1)[1] > 0.5, 'two runs say next to nothing'


def test_the_interval_of_an_effect_covers_it_about_as_often_as_it_says() -> None:
    rng = np.random.default_rng(3)
    truth = 0.7602  # P(X > Y) for X ~ N(1, 1), Y ~ N(0, 1): Phi(1 / sqrt 2)
    first, second = rng.normal(1, 1, (400, 20, 1)), rng.normal(0, 1, (400, 1, 20))
    covered = [low <= truth <= high for low, high in (
        common_language_interval(float(estimate), 20, 20)
        for estimate in (first > second).mean(axis=(1, 2)))]
    assert 0.91 <= np.mean(covered) <= 0.99
