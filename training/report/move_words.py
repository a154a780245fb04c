"""
The move words one by one: a mean over forward and backward words hides a robot that obeys one only.

`table` as `comparisons.per_run` returns it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import NamedTuple

import pandas as pd

from training.report.comparisons import panels, select, thresholds_m
from training.report.published import title
from training.report.verdicts import (
    FEWEST,
    HOLDS,
    HOLDS_IN_PART,
    HOLDS_NOT,
    UNTESTED,
    Finding,
)


class _Obeyed(NamedTuple):
    """How many of a panel's champions go the asked way under every word of `behaviour`."""

    place: str
    behaviour: str
    obeying: int
    among: int

    @property
    def most(self) -> bool:
        """Whether at least half of them do."""
        return 2 * self.obeying >= self.among


def _obeyed(table: pd.DataFrame) -> list[_Obeyed]:
    limits = thresholds_m(table)
    counts = []
    for panel in panels(table):
        champions = select(table, panel)
        counts += [_Obeyed(title(*panel), behaviour,
                           int((champions[f'{behaviour}_least_m'] > limits[panel[1]]).sum()),
                           len(champions)) for behaviour in ('forward', 'backward')]
    return counts


def _named(counts: Iterable[_Obeyed]) -> str:
    return ', '.join(f'{one.place} ({one.behaviour}: {one.obeying} of {one.among})'
                     for one in counts)


def with_words(found: Finding, table: pd.DataFrame) -> Finding:
    """Return a finding on the mean over the move words with what that mean hides."""
    never = [one for one in _obeyed(table) if not one.obeying]
    if found.verdict == UNTESTED or not never:
        return found
    return replace(found, here=(
        f'{found.here}; the mean over both move words hides that no champion goes the asked way '
        f'under one of them in {_named(never)}'))


def word_by_word(table: pd.DataFrame) -> Finding:
    """Judge, by counts, whether the champions obey the forward and the backward words alike."""
    claim = ('Each move word by itself: in every body, at least half of the champions go forward '
             'under the forward words and backward under the backward words, farther than the '
             'threshold of the robustness tables.')
    counts = _obeyed(table)
    if min(one.among for one in counts) < FEWEST:
        return Finding(claim, f'fewer than {FEWEST} champions of a body', UNTESTED)
    lacking = [one for one in counts if not one.most]
    short = {one.place for one in lacking}
    places = {one.place for one in counts}
    here = f'under both in {len(places - short)} of {len(places)} places'
    if lacking:
        here += f'; fewer in {_named(lacking)}'
    return Finding(claim, here, HOLDS if not short else HOLDS_IN_PART if short < places
                   else HOLDS_NOT)
