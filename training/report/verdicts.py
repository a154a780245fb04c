"""How a claim becomes a verdict. The rules are data, so that the report can print them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import comb

from training.report.published import ALPHA, ALPHA_FITNESS
from training.report.statistics import Tested

REPLICATES, IN_PART, NOT, UNTESTED = ('replicates', 'replicates in part', 'does not replicate',
                                      'not tested')
CONSISTENT = 'consistent'
HOLDS, HOLDS_IN_PART, HOLDS_NOT = 'holds', 'holds in part', 'does not hold'

#: Share of the move commands' displacement that is *almost as much*, and that is some of it.
ALMOST, SOME = 0.75, 0.4
#: Without this share of a study's seeds, complete in every cell, there are no verdicts.
ENOUGH_SEEDS = 0.6
#: Of fewer runs than these, a median or a count decides nothing.
FEWEST = 10

RULES = (
    'A claim of a difference “replicates” if the corrected p-value is below the paper’s level '
    f'({ALPHA} for displacement, {ALPHA_FITNESS} for Table III) and the direction is the paper’s, '
    'in every place where the paper has it; “in part” if in some of them.',
    'A claim of no difference is “consistent” if no corrected p-value is below the level. That is '
    'no proof of equality, so the largest effect size stands beside it.',
    'A claim of a difference in one body only is decided by that difference: without it, or with '
    'its direction reversed, the claim “does not replicate”, however many other bodies agree; with '
    'it, “replicates” if no other body differs, and “in part” if one does.',
    'A claim about all six bodies is judged only if all six were run.',
    f'No verdict at all before {ENOUGH_SEEDS:.0%} of the configured seeds are complete in every '
    'cell: a study that is looked at again and again finds something.',
    '“Not tested”: so few runs that not even samples without any overlap would be significant.',
    'That morphology matters “replicates” if the effect is significant in some bodies and not in '
    'others, and the 95% intervals of the largest and the smallest effect do not overlap; “in '
    'part” if they do, since one significant and one insignificant effect need not differ.',
    f'“Almost as much” is at least {ALMOST:.0%} of the medians; “in part” from {SOME:.0%}.',
    'Beyond the paper: “holds” in every body where the difference is significant as evolved (or, '
    'for the lexicon, in every body); “in part” in some of them. The move words by themselves are '
    'counted, not tested.',
)


@dataclass(frozen=True)
class Finding:
    """A claim, what was found here, and a verdict in a word or two."""

    claim: str
    here: str
    verdict: str


def p_value(value: float) -> str:
    """Return a p-value for running text."""
    return f'p = {value:.2g}' if value >= 1e-4 else f'p = {value:.0e}'


def too_few(tested: Sequence[Tested], alpha: float, family: int) -> str:
    """Return which samples are too small for any outcome to be significant, '' if none is."""
    for one in tested:
        first, second = len(one.comparison.first.values), len(one.comparison.second.values)
        # The exact two-sided p-value of samples without overlap, at Holm's first step.
        least = min(1.0, 2 * family / comb(first + second, first))
        if least >= alpha:
            return (f'too few runs: {first} and {second} ({one.comparison.panel}) cannot give a '
                    f'corrected p below {least:.2g}')
    return ''


def too_few_seeds(complete: int, configured: int) -> str:
    """Return that too few of a study's seeds are complete for any verdict, '' if enough are."""
    if complete >= ENOUGH_SEEDS * configured:
        return ''
    return f'{complete} of {configured} seeds: too few, no verdict'


def withheld(findings: Sequence[Finding], reason: str) -> list[Finding]:
    """Return findings without their verdicts, for a reason; as they are without one."""
    if not reason:
        return list(findings)
    return [Finding(one.claim, f'{reason}. So far: {one.here}', UNTESTED) for one in findings]


def difference(claim: str, tested: Sequence[Tested], family: int, *, sign: int = 1,
               words: tuple[str, str, str] = (REPLICATES, IN_PART, NOT)) -> Finding:
    """Judge the claim that in each of `tested` the first sample is larger (`sign` -1: smaller)."""
    lacking = too_few(tested, ALPHA, family) if tested else 'no runs'
    if lacking:
        return Finding(claim, lacking, UNTESTED)
    shown = [one for one in tested if one.p_holm < ALPHA and sign * one.rank_biserial > 0]
    here = f'shown in {len(shown)} of {len(tested)} places at corrected p < {ALPHA}'
    missing = [f'{one.comparison.panel} ({one.comparison.question}, {p_value(one.p_holm)})'
               for one in tested if one not in shown]
    if missing:
        here += '; not in ' + ', '.join(missing)
    return Finding(claim, here, words[0] if not missing else words[1] if shown else words[2])


def equality(claim: str, tested: Sequence[Tested], family: int) -> Finding:
    """Judge the claim that none of `tested` differs."""
    lacking = too_few(tested, ALPHA, family) if tested else 'no runs'
    if lacking:
        return Finding(claim, lacking, UNTESTED)
    differing = [one for one in tested if one.p_holm < ALPHA]
    largest = max(tested, key=lambda one: abs(one.rank_biserial))
    low, high = largest.interval
    here = (f'{len(differing)} of {len(tested)} comparisons differ at corrected p < {ALPHA}; '
            f'largest rank-biserial effect {largest.rank_biserial:+.2f} [{low:+.2f}, {high:+.2f}] '
            f'({largest.comparison.panel}, {p_value(largest.p_holm)})')
    return Finding(claim, here, NOT if differing else CONSISTENT)
