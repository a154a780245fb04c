"""
Equal, different, or not known: two one-sided tests (TOST) against margins fixed beforehand.

A p-value above the level says nothing of equality. A difference is *equivalent* to none if its 90%
interval lies within the margin, which is what two one-sided tests at the 5% level say (Schuirmann
1987); it *differs* if its 95% interval leaves out 0; else it is *undecided*. The margins were fixed
before the full-size study was complete: ten percentage points for rates; for rank-biserial effects
0.33, up to which an effect is called small (Romano et al. 2006, of Cliff's delta, the same number).
These statements are not corrected for the number of comparisons; verdicts do not use them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from statsmodels.stats.proportion import confint_proportions_2indep
from statsmodels.stats.weightstats import CompareMeans, DescrStatsW

from training.report.statistics import Tested, common_language_interval
from training.report.verdicts import FEWEST

Array = NDArray[np.float64]
RATE_MARGIN, EFFECT_MARGIN = 0.10, 0.33
EQUIVALENT, DIFFERS, UNDECIDED = 'equivalent', 'differs', 'undecided'
TOO_FEW = 'too few runs'
RULE = (
    f'Equivalence: a difference between rates is “{EQUIVALENT}” to none if its 90% interval lies '
    f'within ±{100 * RATE_MARGIN:.0f} percentage points, a rank-biserial effect if its 90% '
    f'interval lies within ±{EFFECT_MARGIN} (two one-sided tests at 5%); it “{DIFFERS}” if its 95% '
    f'interval leaves out 0; else it is “{UNDECIDED}”; of fewer than {FEWEST} runs nothing is '
    'said. Not corrected for the number of comparisons; no verdict rests on it.')


@dataclass(frozen=True)
class Difference:
    """Of means of rates, the smaller sample of `count`, with its 95% and its 90% interval."""

    estimate: float
    interval: tuple[float, float]
    narrower: tuple[float, float]
    count: int

    @property
    def statement(self) -> str:
        """`EQUIVALENT`, `DIFFERS`, `UNDECIDED` or `TOO_FEW`."""
        return stated(self.interval, self.narrower, RATE_MARGIN, self.count)


def stated(interval: tuple[float, float], narrower: tuple[float, float], margin: float,
           count: int) -> str:
    """Return what a 95% and a 90% interval of samples of at least `count` say about a margin."""
    if count < FEWEST:
        return TOO_FEW
    if -margin < narrower[0] and narrower[1] < margin:
        return EQUIVALENT
    return UNDECIDED if interval[0] <= 0 <= interval[1] else DIFFERS


def of_effect(one: Tested) -> str:
    """Return the statement on a comparison's rank-biserial effect."""
    sizes = (len(one.comparison.first.values), len(one.comparison.second.values))
    low, high = common_language_interval(one.common_language, *sizes, confidence=0.90)
    return stated(one.interval, (2 * low - 1, 2 * high - 1), EFFECT_MARGIN, min(sizes))


def difference(first: ArrayLike, second: ArrayLike) -> Difference | None:
    """
    Return the difference of the means of two samples of rates, None of fewer than two each.

    Of rates that are all 0 or 1, and of samples without any spread, the intervals are Newcombe's
    for proportions; of others, Welch's.
    """
    one, other = (np.asarray(values, dtype=np.float64) for values in (first, second))
    if min(len(one), len(other)) < 2:
        return None
    both = np.concatenate([one, other])
    if np.isin(both, (0.0, 1.0)).all() or (np.ptp(one) == 0 and np.ptp(other) == 0):
        intervals = [confint_proportions_2indep(one.sum(), len(one), other.sum(), len(other),
                                                method='newcomb', compare='diff', alpha=alpha)
                     for alpha in (0.05, 0.10)]
    else:
        means = CompareMeans.from_data(one, other)
        intervals = [means.tconfint_diff(alpha=alpha, usevar='unequal') for alpha in (0.05, 0.10)]
    return _within(float(one.mean() - other.mean()), intervals, min(len(one), len(other)))


def paired(values: ArrayLike) -> Difference | None:
    """
    Return the mean of paired differences of rates, with Student's intervals; None of one or none.

    Differences without any spread have the intervals of as many pairs of proportions.
    """
    rows = np.asarray(values, dtype=np.float64)
    if len(rows) < 2:
        return None
    if np.ptp(rows) == 0:
        # Of proportions this far apart, those about a half have the widest intervals.
        return difference(0.5 + rows / 2, 0.5 - rows / 2)
    spread = DescrStatsW(rows)
    return _within(float(rows.mean()), [spread.tconfint_mean(alpha=alpha)
                                        for alpha in (0.05, 0.10)], len(rows))


def _within(estimate: float, intervals: Sequence[tuple[float, float]], count: int) -> Difference:
    # Of rates no difference is beyond 1.
    ends = [(max(float(low), -1.0), min(float(high), 1.0)) for low, high in intervals]
    return Difference(estimate, ends[0], ends[1], count)
