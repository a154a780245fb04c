"""The parts that a report is put together from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import pandas as pd
from matplotlib.figure import Figure

from training.report.statistics import Tested
from training.report.verdicts import Finding


@dataclass
class Section:
    """A part of the report; `figures` and `captions` share their keys, file names."""

    heading: str
    paragraphs: list[str] = field(default_factory=list)
    tables: dict[str, pd.DataFrame] = field(default_factory=dict)
    figures: dict[str, Figure] = field(default_factory=dict)
    captions: dict[str, str] = field(default_factory=dict)

    def add_figure(self, name: str, figure: Figure, caption: str) -> None:
        """Add a figure and what stands under it."""
        self.figures[name], self.captions[name] = figure, caption


def counted(count: int, noun: str) -> str:
    """Return a number with its noun, in the plural unless it is one."""
    return f'{count:,} {noun}{"" if count == 1 else "s"}'


@dataclass
class Content:
    """
    A whole report.

    `partial` says what of the study is missing, nothing if it is whole. `findings` judge the
    paper's claims, `beyond` what it did not ask, both by `rules`. `first_page` names the figures
    that stand before them, and not again in their sections.
    """

    heading: str
    lead: list[str]
    partial: list[str]
    findings: list[Finding]
    beyond: list[Finding]
    rules: Sequence[str]
    differences: list[str]
    sections: list[Section]
    tested: list[Tested]
    first_page: Sequence[str] = ('displacement', 'balanced', 'grounding')

    @property
    def first(self) -> list[tuple[str, str]]:
        """The first page's figures, those that there are: (name, caption)."""
        captions = {name: text for section in self.sections
                    for name, text in section.captions.items()}
        # The balanced set's stands there only where the paper's own is not.
        names = [name for name in self.first_page if name in captions]
        if 'displacement' in names and 'balanced' in names:
            names.remove('balanced')
        return [(name, captions[name]) for name in names]
