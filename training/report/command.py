"""
A study's report: `python -m training report DIR`.

Writes DIR/report/report.html (one file, images inside), its figures as PNG and PDF, comparisons.csv
and summary.md. Everything in it follows from the store and the champions in DIR; numbers of the
paper stand beside ours, and each of its claims has a verdict. The same store gives the same report.
"""

from __future__ import annotations

import argparse
import base64
import sys
from io import BytesIO
from pathlib import Path
from typing import Any

import pandas as pd
from jinja2 import Environment, FileSystemLoader
from markupsafe import Markup
from matplotlib.figure import Figure

from training.evolution.checkpoint import write_atomically
from training.report import tables
from training.report.content import gather
from training.report.parts import Content
from training.study.directory import StudyDirectory, StudyError
from training.study.store import build_store, read_store

DPI = 160


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument('study', type=Path, metavar='DIR', help='a study (see: study --help)')
    parser.add_argument('--out', type=Path, default=None, metavar='DIR',
                        help='where the report goes (default: DIR/report)')


def main(args: argparse.Namespace) -> int:
    """Run the command; return the exit code."""
    study = StudyDirectory(args.study)
    out = args.out or study.path / 'report'
    try:
        about = study.about()
        build_store(study, history_points=about['config']['history_points'])
        content = gather(study, read_store(study), about)
        write_report(content, out)
    except (StudyError, OSError, ValueError) as error:
        print(f'report: {" ".join(str(error).split())}', file=sys.stderr)
        return 2
    print(out / 'report.html')
    return 0


def write_report(content: Content, out: Path) -> None:
    """Write the HTML file, figures, comparisons and summary into `out`."""
    figures = out / 'figures'
    figures.mkdir(parents=True, exist_ok=True)
    images = {}
    for section in content.sections:
        for name, figure in section.figures.items():
            png = _image(figure, 'png')
            write_atomically(figures / f'{name}.png', png)
            write_atomically(figures / f'{name}.pdf', _image(figure, 'pdf'))
            images[name] = 'data:image/png;base64,' + base64.b64encode(png).decode()
    environment = Environment(loader=FileSystemLoader(Path(__file__).parent / 'templates'),
                              autoescape=True, trim_blocks=True, lstrip_blocks=True)
    page = environment.get_template('report.html').render(
        content=content, images=images, table=_html_table)
    write_atomically(out / 'report.html', page.encode())
    write_atomically(out / 'comparisons.csv',
                     tables.all_comparisons(content.tested).to_csv(index=False).encode())
    write_atomically(out / 'summary.md', summary(content).encode())


def _image(figure: Figure, kind: str) -> bytes:
    buffer = BytesIO()
    # Without the date, the same results give the same file.
    metadata: dict[str, Any] = {'CreationDate': None} if kind == 'pdf' else {'Software': None}
    figure.savefig(buffer, format=kind, dpi=DPI, metadata=metadata)
    return buffer.getvalue()


def _html_table(frame: pd.DataFrame) -> Markup:
    """Return a table's HTML; an index of words is shown, a plain numbering is not."""
    return Markup(frame.to_html(index=frame.index.dtype.kind not in 'iu', border=0, escape=True))


def summary(content: Content) -> str:
    """Return the report's text and tables as Markdown, figures linked from `figures/`."""
    lines = [f'# {content.heading}', '', content.lead, '', '## What replicates', '',
             '| The paper | Here | Verdict |', '|---|---|---|']
    lines += [f'| {one.claim} | {one.here} | **{one.verdict}** |' for one in content.findings]
    lines += ['', '## What differs from the paper', '']
    lines += [f'- {line}' for line in content.differences]
    for section in content.sections:
        lines += ['', f'## {section.heading}', '']
        lines += [f'{paragraph}\n' for paragraph in section.paragraphs]
        for name in section.figures:
            lines += [f'![{section.captions[name]}](figures/{name}.png)', '',
                      f'*{section.captions[name]}*', '']
        for caption, frame in section.tables.items():
            lines += [f'**{caption}**', '', markdown_table(frame), '']
    return '\n'.join(lines).rstrip() + '\n'


def markdown_table(frame: pd.DataFrame) -> str:
    """Return a data frame of text as a Markdown table."""
    if frame.index.dtype.kind not in 'iu':
        frame = frame.rename_axis('').reset_index()
    rows = [list(map(str, frame.columns)), ['---'] * len(frame.columns),
            *(list(map(str, row)) for row in frame.itertuples(index=False))]
    return '\n'.join('| ' + ' | '.join(cell.replace('|', '\\|') for cell in row) + ' |'
                     for row in rows)
