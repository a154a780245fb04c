"""
Each claim of the paper beside what this study says of it, and what the paper did not ask.

`verdicts.RULES` says how claims are judged.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import pandas as pd

from training.report.comparisons import ELSEWHERE, panels, select
from training.report.move_words import with_words, word_by_word
from training.report.parts import counted
from training.report.published import ALPHA, ALPHA_FITNESS, FITNESS, TITLES, title
from training.report.statistics import Tested
from training.report.verdicts import (
    ALMOST,
    FEWEST,
    HOLDS,
    HOLDS_IN_PART,
    HOLDS_NOT,
    IN_PART,
    NOT,
    REPLICATES,
    SOME,
    UNTESTED,
    Finding,
    difference,
    equality,
    p_value,
    too_few,
)


class _Outcomes:
    """The tested comparisons, found by place and question."""

    def __init__(self, tested: Sequence[Tested], table: pd.DataFrame) -> None:
        self._index = {(one.comparison.panel, one.comparison.question): one for one in tested}
        self.family = len(tested)
        shown = panels(table)
        self.bodies = [title(*panel) for panel in shown if panel[0] == 'paper'
                       and panel[1] in TITLES]
        self.balanced = [title(*panel) for panel in shown if panel[0].startswith('balanced')]

    def at(self, places: Iterable[str], *questions: str) -> list[Tested]:
        """Return the outcomes of `questions` at `places`, as far as there are any."""
        return [self._index[place, question] for place in places for question in questions
                if (place, question) in self._index]


def findings(tested: Sequence[Tested], table: pd.DataFrame) -> list[Finding]:
    """Return the paper's claims with this study's verdicts; `table` as `per_run` returns it."""
    study = _Outcomes(tested, table)
    bodies, balanced, family = study.bodies, study.balanced, study.family
    between = study.at(bodies, 'test: E against C')
    found = [
        with_words(difference(
            'Robots move more under the move than under the stop commands, in every body and '
            'treatment (figures 5 and 6).',
            study.at(bodies + balanced, 'E: move against stop', 'C: move against stop'), family),
            table),
        equality('No body shows a difference between word2vec and control in how far the robots '
                 'move when commanded to move (figure 5).',
                 study.at(bodies, 'move: E against C'), family),
        _four_of_six(between, family),
        _morphology(between, family),
        _stop_against_test(study.at(bodies, 'E: test against stop', 'C: test against stop'),
                           family),
        _fitness(study.at(bodies, 'fitness: E against C'), family),
    ]
    if balanced:
        found += [
            equality('Balanced set: no difference in training performance (figure 6).',
                     study.at(balanced, 'fitness: E against C', 'move: E against C'), family),
            difference('Balanced set: under the unheard stop word, word2vec robots move less than '
                       'control robots (implied by the text on figure 6).',
                       study.at(balanced, 'test: E against C'), family, sign=-1),
            difference('Balanced set, control: more movement under the unheard than under the '
                       'trained stop words (figure 6).', study.at(balanced, 'C: test against stop'),
                       family),
            equality('Balanced set, word2vec: no difference between unheard and trained stop '
                     'words (figure 6).', study.at(balanced, 'E: test against stop'), family),
            _control_moves(table),
        ]
    return found


def beyond(tested: Sequence[Tested], table: pd.DataFrame) -> list[Finding]:
    """Return what the paper did not ask: does the finding hold elsewhere, and for other words?"""
    study = _Outcomes(tested, table)
    places = study.bodies + study.balanced
    as_evolved = [one.comparison.panel for one in study.at(places, 'test: E against C')
                  if one.p_holm < ALPHA and one.rank_biserial < 0]
    words = (HOLDS, HOLDS_IN_PART, HOLDS_NOT)
    found = [word_by_word(table)]
    for name, there in ((name, f'{"in" if name == "PyBullet" else "from"} {name}')
                        for name in ELSEWHERE):
        claim = (f'Under the unheard stop word, word2vec robots move less than control robots also '
                 f'{there}, wherever they do as evolved.')
        if not study.at(places, f'test, {name}: E against C'):
            found.append(Finding(claim, 'not scored', UNTESTED))
        elif not as_evolved:
            found.append(Finding(claim, 'no significant difference as evolved, so none to hold',
                                 UNTESTED))
        else:
            found.append(difference(claim, study.at(as_evolved, f'test, {name}: E against C'),
                                    study.family, sign=-1, words=words))
    found.append(difference(
        'Beyond the held-out command: word2vec champions tell unheard synonyms of stop from '
        'unrelated words better than control champions do (rate of stopping under the one minus '
        'the other).', study.at(places, 'lexicon selectivity for stop words: E against C'),
        study.family, words=words))
    return found


def _incomplete(tested: list[Tested]) -> str:
    """Return what is missing for a claim about all six bodies, '' if nothing is."""
    there = {one.comparison.panel for one in tested}
    missing = [name for name in TITLES.values() if name not in there]
    return f'no runs of: {", ".join(missing)}' if missing else ''


def _less(tested: list[Tested]) -> list[Tested]:
    return [one for one in tested if one.p_holm < ALPHA and one.rank_biserial < 0]


def _four_of_six(tested: list[Tested], family: int) -> Finding:
    claim = ('Under the unheard stop word, word2vec robots move less than control robots in four '
             'of the six bodies (figure 5, red brackets).')
    lacking = _incomplete(tested) or too_few(tested, ALPHA, family)
    if lacking:
        return Finding(claim, lacking, UNTESTED)
    less = _less(tested)
    leaning = [one for one in tested if one.rank_biserial < 0]
    named = ', '.join(one.comparison.panel for one in less) or 'none'
    here = (f'significant (corrected p < {ALPHA}) in {len(less)} of {len(tested)} bodies: {named}; '
            f'the effect has that direction in {len(leaning)} of {len(tested)}')
    return Finding(claim, here, REPLICATES if len(less) >= 4 else IN_PART if less else NOT)


def _morphology(tested: list[Tested], family: int) -> Finding:
    claim = ('Morphology facilitates or obstructs the grounding: that difference is there in some '
             'bodies and not in others (figure 5).')
    lacking = _incomplete(tested) or too_few(tested, ALPHA, family)
    if lacking:
        return Finding(claim, lacking, UNTESTED)
    some = 0 < len(_less(tested)) < len(tested)
    ends = [min(tested, key=lambda one: one.rank_biserial),
            max(tested, key=lambda one: one.rank_biserial)]
    apart = ends[0].interval[1] < ends[1].interval[0]
    effects = ', '.join(f'{word} {one.rank_biserial:+.2f} [{one.interval[0]:+.2f}, '
                        f'{one.interval[1]:+.2f}] ({one.comparison.panel})'
                        for word, one in zip(('largest', 'smallest'), ends, strict=True))
    here = (f'significant in {len(_less(tested))} of {len(tested)} bodies; rank-biserial effects: '
            f'{effects}: their intervals {"do not overlap" if apart else "overlap"}')
    return Finding(claim, here, NOT if not some else REPLICATES if apart else IN_PART)


def _stop_against_test(tested: list[Tested], family: int) -> Finding:
    claim = ('Robots move more under the unheard than under the trained stop words, in both '
             'treatments, in five of the six bodies but not the quadruped (figure 5).')
    lacking = _incomplete(tested) or too_few(tested, ALPHA, family)
    if lacking:
        return Finding(claim, lacking, UNTESTED)
    by_body: dict[str, dict[str, bool]] = {}
    for one in tested:
        by_body.setdefault(one.comparison.panel, {})[one.comparison.question[0]] = (
            one.p_holm < ALPHA and one.rank_biserial > 0)
    quadruped = by_body.pop(TITLES['quadruped'])
    both = [body for body, shown in by_body.items() if all(shown.values())]
    here = (f'in both treatments in {len(both)} of the {len(by_body)} other bodies'
            + (f' ({", ".join(both)})' if both else '')
            + ''.join(f'; {name} alone in {sum(shown[letter] for shown in by_body.values())} of '
                      f'{len(by_body)}' for name, letter in (('control', 'C'), ('word2vec', 'E')))
            + '; quadruped: ' + (' and '.join(
                name for name, letter in (('control', 'C'), ('word2vec', 'E'))
                if quadruped[letter]) or 'neither'))
    if len(both) == len(by_body) and not any(quadruped.values()):
        return Finding(claim, here, REPLICATES)
    return Finding(claim, here, IN_PART if both else NOT)


def _fitness(tested: list[Tested], family: int) -> Finding:
    claim = ('Training performance differs between the treatments in one body only, the 1DOF '
             'sphere with sensors, where word2vec is better (Table III).')
    lacking = _incomplete(tested) or too_few(tested, ALPHA_FITNESS, family)
    if lacking:
        return Finding(claim, lacking, UNTESTED)
    differing = {one.comparison.panel: one for one in tested if one.p_holm < ALPHA_FITNESS}
    [published] = [TITLES[body] for body, row in FITNESS.items() if row.significant]
    [there] = [one for one in tested if one.comparison.panel == published]
    here = ('differs at corrected p < 0.05 in ' + ', '.join(
        f'{body} (E {"above" if one.rank_biserial > 0 else "below"} C, {p_value(one.p_holm)})'
        for body, one in differing.items())) if differing else (
            'no body differs at corrected p < 0.05')
    if published not in differing:
        low, high = there.interval
        here += (f'; not in {published} (rank-biserial effect {there.rank_biserial:+.2f} '
                 f'[{low:+.2f}, {high:+.2f}], {p_value(there.p_holm)})')
    # That the other bodies do not differ is no evidence: the one difference decides.
    if published not in differing or there.rank_biserial < 0:
        return Finding(claim, here, NOT)
    return Finding(claim, here, REPLICATES if len(differing) == 1 else IN_PART)


def _control_moves(table: pd.DataFrame) -> Finding:
    claim = ('Balanced set, control: almost as much movement under the unheard stop word as under '
             'the move commands (figure 6).')
    balanced = [panel for panel in panels(table) if panel[0].startswith('balanced')]
    arm = select(table, balanced[0], 'control')
    if not arm.test.notna().any():
        return Finding(claim, 'no runs', UNTESTED)
    test, move = float(arm.test.median()), float(arm.move.median())
    share = test / move
    here = (f'median {test:.2f} against {move:.2f} body lengths, {share:.0%}, of '
            f'{counted(len(arm), "run")}; no test, as in the paper')
    return Finding(claim, here, UNTESTED if len(arm) < FEWEST else REPLICATES if share >= ALMOST
                   else IN_PART if share >= SOME else NOT)
