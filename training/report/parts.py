"""The parts that a report is put together from."""

from __future__ import annotations

from dataclasses import dataclass, field

import pandas as pd
from matplotlib.figure import Figure

from training.report.findings import Finding
from training.report.statistics import Tested


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


@dataclass
class Content:
    """A whole report."""

    heading: str
    lead: str
    findings: list[Finding]
    differences: list[str]
    sections: list[Section]
    tested: list[Tested]
