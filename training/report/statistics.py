"""
The study's hypothesis tests: Mann-Whitney U, Holm-Bonferroni over all comparisons, effect sizes.

The paper makes 56 comparisons: in each of seven panels (six bodies and the quadruped's balanced
set) three between treatments (move, stop and test displacement), two a treatment (move against
stop, stop against test), and one of the training fitness. The unit is the run: a run's displacement
under several commands of one meaning enters as their mean, so that no run counts twice in a sample.
scipy and statsmodels do the tests, the bootstrap and the correction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq
from scipy.stats import bootstrap, mannwhitneyu, norm
from statsmodels.stats.multitest import multipletests

Array = NDArray[np.float64]
Method = Literal['exact', 'asymptotic']

#: Below this, the exact distribution of U is computed where there are no ties.
EXACT_PRODUCT = 250_000
#: The paper's stars: significance at the 0.01, 0.001 and 0.0001 level (caption of its figure 5).
STARS = ((0.0001, '***'), (0.001, '**'), (0.01, '*'))


@dataclass(frozen=True)
class Sample:
    """A named sample of one number a run."""

    label: str
    values: Array

    @property
    def median(self) -> float:
        """Median, NaN of an empty sample."""
        return float(np.median(self.values)) if len(self.values) else float('nan')


@dataclass(frozen=True)
class Comparison:
    """Two samples to be compared; `panel` and `question` say where and what for."""

    panel: str
    question: str
    first: Sample
    second: Sample


@dataclass(frozen=True)
class Tested:
    """
    Outcome of one comparison.

    Attributes
    ----------
    u
        Mann-Whitney's U of the first sample: pairs in which it is the larger, ties count half.
    p, p_holm
        Two-sided, as it is and after Holm-Bonferroni over all comparisons tested together.
    common_language
        Probability that a draw from the first sample exceeds one from the second: U / (n1 n2).
    rank_biserial
        2 * common_language - 1: from -1 (first always smaller) to 1.

    """

    comparison: Comparison
    u: float
    p: float
    p_holm: float
    method: Method
    common_language: float
    rank_biserial: float

    @property
    def interval(self) -> tuple[float, float]:
        """95% confidence interval of `rank_biserial`."""
        sizes = (len(self.comparison.first.values), len(self.comparison.second.values))
        low, high = common_language_interval(self.common_language, *sizes)
        return 2 * low - 1, 2 * high - 1

    @property
    def stars(self) -> str:
        """The paper's asterisks for the corrected p-value; '' above 0.01."""
        return next((stars for level, stars in STARS if self.p_holm < level), '')


def compare_all(comparisons: Sequence[Comparison]) -> list[Tested]:
    """
    Return the outcome of every comparison, corrected for all of them together.

    Raises
    ------
    ValueError
        If a sample is empty or holds a number that is not finite: leaving it out would change how
        many comparisons the others are corrected for.

    """
    raw = [_mann_whitney(comparison) for comparison in comparisons]
    if not raw:
        return []
    corrected = multipletests([p for _, p, _ in raw], method='holm')[1]
    tested = []
    for comparison, (u, p, method), p_holm in zip(comparisons, raw, corrected, strict=True):
        common = u / (len(comparison.first.values) * len(comparison.second.values))
        tested.append(Tested(comparison, u, p, float(p_holm), method, common, 2 * common - 1))
    return tested


def _mann_whitney(comparison: Comparison) -> tuple[float, float, Method]:
    first, second = (np.asarray(sample.values, dtype=np.float64)
                     for sample in (comparison.first, comparison.second))
    for sample, values in ((comparison.first, first), (comparison.second, second)):
        if not len(values) or not np.isfinite(values).all():
            raise ValueError(f'{comparison.panel}, {comparison.question}: sample {sample.label!r}: '
                             f'expected finite numbers, at least one; got {len(values)} numbers, '
                             f'{int((~np.isfinite(values)).sum())} of them not finite')
    both = np.concatenate([first, second])
    exact = len(np.unique(both)) == len(both) and len(first) * len(second) <= EXACT_PRODUCT
    method: Method = 'exact' if exact else 'asymptotic'
    if np.ptp(both) == 0:
        # All values tie: the test's variance is 0 and its statistic undefined; nothing differs.
        return len(first) * len(second) / 2, 1.0, method
    outcome = mannwhitneyu(first, second, alternative='two-sided', method=method)
    return float(outcome.statistic), float(outcome.pvalue), method


def common_language_interval(estimate: float, first: int, second: int, *,
                             confidence: float = 0.95) -> tuple[float, float]:
    """
    Return the confidence interval of a common-language effect size U / (n1 n2).

    A score interval: the ends are the values whose own standard error puts `estimate` at the limit,
    so that samples without overlap still have an interval of some width, which a bootstrap of them
    has not. Source: Newcombe (2006), Statistics in Medicine 25, 559-573, method 5.

    Parameters
    ----------
    estimate
        From 0 to 1.
    first, second
        Sizes of the samples.
    confidence
        Coverage.

    """
    z = float(norm.ppf((1 + confidence) / 2))
    others = (first + second) / 2 - 1

    def beyond(value: float) -> float:
        spread = value * (1 - value) * (1 + others * (1 - value) / (2 - value)
                                        + others * value / (1 + value)) / (first * second)
        return float((value - estimate) ** 2 - z ** 2 * spread)

    tiny = 1e-12
    low = brentq(beyond, 0.0, min(estimate, 1 - tiny)) if estimate > tiny else 0.0
    high = brentq(beyond, max(estimate, tiny), 1.0) if estimate < 1 - tiny else 1.0
    return float(low), float(high)


def median_interval(values: ArrayLike, *, confidence: float = 0.95, resamples: int = 10_000,
                    seed: int = 0) -> tuple[float, float]:
    """
    Return the bootstrapped confidence interval of the median (percentile method).

    A sample of one or of equal numbers has its value at both ends; an empty one, NaN.
    """
    values = np.asarray(values, dtype=np.float64)
    if len(values) == 0:
        return float('nan'), float('nan')
    if np.ptp(values) == 0:
        return float(values[0]), float(values[0])
    interval = bootstrap((values,), np.median, confidence_level=confidence, n_resamples=resamples,
                         method='percentile', vectorized=True,
                         rng=np.random.default_rng(seed)).confidence_interval
    return float(interval.low), float(interval.high)


def median_error(values: ArrayLike, *, resamples: int = 10_000, seed: int = 0) -> float:
    """Return the bootstrapped standard error of the median; 0 for equal numbers."""
    values = np.asarray(values, dtype=np.float64)
    if len(values) == 0 or np.ptp(values) == 0:
        return 0.0 if len(values) else float('nan')
    return float(bootstrap((values,), np.median, n_resamples=resamples, method='percentile',
                           vectorized=True, rng=np.random.default_rng(seed)).standard_error)
