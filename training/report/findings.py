"""
Each claim of the paper beside what this study says of it, by rules that are written down here.

A claim of a difference *replicates* if the corrected p-value is below the paper's level and the
direction is the paper's, in every place where the paper has it. A claim of no difference is
*consistent* if no corrected p-value is below the level: that is no proof of equality, so the
largest effect size is given beside it. Where there are so few runs that not even samples without
any overlap would be significant, nothing is claimed: *not tested*.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import comb

import pandas as pd

from training.report.comparisons import panels, select
from training.report.published import ALPHA, ALPHA_FITNESS, FITNESS, TITLES, title
from training.report.statistics import Tested


@dataclass(frozen=True)
class Finding:
    """A claim of the paper, what was found here, and a verdict in a word or two."""

    claim: str
    here: str
    verdict: str


REPLICATES, IN_PART, NOT, UNTESTED = ('replicates', 'replicates in part', 'does not replicate',
                                      'not tested')
CONSISTENT = 'consistent'


def findings(tested: Sequence[Tested], table: pd.DataFrame) -> list[Finding]:
    """Return the paper's claims with this study's verdicts; `table` as `per_run` returns it."""
    index = {(one.comparison.panel, one.comparison.question): one for one in tested}
    bodies = [title(*panel) for panel in panels(table) if panel[0] == 'paper'
              and panel[1] in TITLES]
    balanced = [title(*panel) for panel in panels(table) if panel[0].startswith('balanced')]

    def these(places: Iterable[str], *questions: str) -> list[Tested]:
        return [index[place, question] for place in places for question in questions
                if (place, question) in index]

    found = [
        _difference('Robots move more under the move than under the stop commands, in every body '
                    'and treatment (figure 5).',
                    these(bodies + balanced, 'E: move against stop', 'C: move against stop'),
                    len(tested)),
        _equality('No body shows a difference between word2vec and control in how far the robots '
                  'move when commanded to move (figure 5).',
                  these(bodies, 'move: E against C'), len(tested)),
        _four_of_six(these(bodies, 'test: E against C'), len(tested)),
        _stop_against_test(these(bodies, 'E: test against stop', 'C: test against stop'),
                           len(tested)),
        _fitness(these(bodies, 'fitness: E against C'), len(tested)),
    ]
    if balanced:
        found += [
            _equality('Balanced set: no difference in training performance (figure 6).',
                      these(balanced, 'fitness: E against C', 'move: E against C'),
                      len(tested)),
            _difference('Balanced set, control: more movement under the unheard than under the '
                        'trained stop words (figure 6).', these(balanced, 'C: test against stop'),
                        len(tested)),
            _equality('Balanced set, word2vec: no difference between unheard and trained stop '
                      'words (figure 6).', these(balanced, 'E: test against stop'), len(tested)),
            _control_moves(table),
        ]
    return found


def _too_few(tested: Sequence[Tested], alpha: float, family: int) -> str:
    """Return which samples are too small for any outcome to be significant, '' if none is."""
    for one in tested:
        first, second = len(one.comparison.first.values), len(one.comparison.second.values)
        # The exact two-sided p-value of samples without overlap, at Holm's first step.
        least = min(1.0, 2 * family / comb(first + second, first))
        if least >= alpha:
            return (f'too few runs: {first} and {second} ({one.comparison.panel}) cannot give a '
                    f'corrected p below {least:.2g}')
    return ''


def _p(value: float) -> str:
    return f'p = {value:.2g}' if value >= 1e-4 else f'p = {value:.0e}'


def _difference(claim: str, tested: list[Tested], family: int) -> Finding:
    lacking = _too_few(tested, ALPHA, family) if tested else 'no runs'
    if lacking:
        return Finding(claim, lacking, UNTESTED)
    shown = [one for one in tested if one.p_holm < ALPHA and one.rank_biserial > 0]
    here = f'shown in {len(shown)} of {len(tested)} places at corrected p < {ALPHA}'
    missing = [f'{one.comparison.panel} ({one.comparison.question}, {_p(one.p_holm)})'
               for one in tested if one not in shown]
    if missing:
        here += '; not in ' + ', '.join(missing)
    return Finding(claim, here, REPLICATES if not missing else IN_PART if shown else NOT)


def _equality(claim: str, tested: list[Tested], family: int) -> Finding:
    lacking = _too_few(tested, ALPHA, family) if tested else 'no runs'
    if lacking:
        return Finding(claim, lacking, UNTESTED)
    differing = [one for one in tested if one.p_holm < ALPHA]
    largest = max(tested, key=lambda one: abs(one.rank_biserial))
    here = (f'{len(differing)} of {len(tested)} comparisons differ at corrected p < {ALPHA}; '
            f'largest rank-biserial effect {largest.rank_biserial:+.2f} '
            f'({largest.comparison.panel}, {_p(largest.p_holm)})')
    return Finding(claim, here, NOT if differing else CONSISTENT)


def _incomplete(tested: list[Tested]) -> str:
    """Return what is missing for a claim about all six bodies, '' if nothing is."""
    there = {one.comparison.panel for one in tested}
    missing = [name for name in TITLES.values() if name not in there]
    return f'no runs of: {", ".join(missing)}' if missing else ''


def _four_of_six(tested: list[Tested], family: int) -> Finding:
    claim = ('Under the unheard stop word, word2vec robots move less than control robots in four '
             'of the six bodies: morphology affects the grounding (figure 5, red brackets).')
    lacking = _incomplete(tested) or _too_few(tested, ALPHA, family)
    if lacking:
        return Finding(claim, lacking, UNTESTED)
    less = [one for one in tested if one.p_holm < ALPHA and one.rank_biserial < 0]
    leaning = [one for one in tested if one.rank_biserial < 0]
    named = ', '.join(one.comparison.panel for one in less) or 'none'
    here = (f'significant (corrected p < {ALPHA}) in {len(less)} of {len(tested)} bodies: {named}; '
            f'the effect has that direction in {len(leaning)} of {len(tested)}')
    return Finding(claim, here, REPLICATES if len(less) >= 4 else IN_PART if less else NOT)


def _stop_against_test(tested: list[Tested], family: int) -> Finding:
    claim = ('Robots move more under the unheard than under the trained stop words, in both '
             'treatments, in five of the six bodies but not the quadruped (figure 5).')
    lacking = _incomplete(tested) or _too_few(tested, ALPHA, family)
    if lacking:
        return Finding(claim, lacking, UNTESTED)
    by_body: dict[str, list[bool]] = {}
    for one in tested:
        by_body.setdefault(one.comparison.panel, []).append(
            one.p_holm < ALPHA and one.rank_biserial > 0)
    quadruped = TITLES['quadruped']
    both = [body for body, shown in by_body.items() if all(shown) and body != quadruped]
    others = [body for body in by_body if body != quadruped]
    exception = any(by_body[quadruped])
    here = (f'in both treatments in {len(both)} of the {len(others)} other bodies'
            + (f' ({", ".join(both)})' if both else '')
            + f'; in the quadruped {"also" if exception else "not"}')
    if len(both) == len(others) and not exception:
        return Finding(claim, here, REPLICATES)
    return Finding(claim, here, IN_PART if both else NOT)


def _fitness(tested: list[Tested], family: int) -> Finding:
    claim = ('Training performance differs between the treatments in one body only, the 1DOF '
             'sphere with sensors, where word2vec is better (Table III).')
    lacking = _incomplete(tested) or _too_few(tested, ALPHA_FITNESS, family)
    if lacking:
        return Finding(claim, lacking, UNTESTED)
    differing = {one.comparison.panel: one for one in tested if one.p_holm < ALPHA_FITNESS}
    published = {TITLES[body] for body, row in FITNESS.items() if row.significant}
    here = ('differs at corrected p < 0.05 in ' + ', '.join(
        f'{body} (E {"above" if one.rank_biserial > 0 else "below"} C, {_p(one.p_holm)})'
        for body, one in differing.items())) if differing else (
            'no body differs at corrected p < 0.05')
    if set(differing) == published and all(
            one.rank_biserial > 0 for one in differing.values()):
        return Finding(claim, here, REPLICATES)
    agreeing = sum((body in differing) == (body in published) for body in TITLES.values())
    return Finding(claim, f'{here}; agrees with the paper in {agreeing} of {len(TITLES)} bodies',
                   IN_PART if agreeing else NOT)


def _control_moves(table: pd.DataFrame) -> Finding:
    claim = ('Balanced set, control: almost as much movement under the unheard stop word as under '
             'the move commands (figure 6).')
    arm = select(table, ('balanced', 'quadruped'), 'control')
    if arm.empty:
        return Finding(claim, 'no runs', UNTESTED)
    test, move = float(arm.test.median()), float(arm.move.median())
    share = test / move
    here = f'median {test:.2f} against {move:.2f} body lengths, {share:.0%}'
    return Finding(claim, here, REPLICATES if share >= 0.75 else IN_PART if share >= 0.4 else NOT)
