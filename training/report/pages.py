"""A report's files: one HTML page, Markdown, figures as PNG and PDF, comparisons as CSV."""

from __future__ import annotations

import base64
import re
from io import BytesIO
from pathlib import Path

import pandas as pd
from jinja2 import Environment, FileSystemLoader
from markupsafe import Markup, escape
from matplotlib.figure import Figure
from PIL import Image

from training.evolution.checkpoint import write_atomically
from training.report.parts import Content
from training.report.style import settings
from training.report.tables import comparisons_csv

#: Dots an inch of printed width, tried in turn until a picture is small enough.
DPI = (250, 200, 160, 130)
LARGEST_BYTES = 300_000
#: A table of no more rows is printed on one page.
SHORT_ROWS = 15
#: Attribute of a table's cell that stays on one line.
NOWRAP = ' class="n"'


def write_report(content: Content, out: Path) -> None:
    """Write the HTML file, figures as PNG and PDF, comparisons and summary into `out`."""
    images = write_summary(content, out)
    for section in content.sections:
        for name, figure in section.figures.items():
            write_atomically(out / 'figures' / f'{name}.pdf', pdf(figure))
    environment = Environment(loader=FileSystemLoader(Path(__file__).parent / 'templates'),
                              autoescape=True, trim_blocks=True, lstrip_blocks=True)
    environment.filters['code'] = _html_code
    page = environment.get_template('report.html').render(
        content=content, table=_html_table, short=SHORT_ROWS, images={
            name: 'data:image/png;base64,' + base64.b64encode(image).decode()
            for name, image in images.items()})
    write_atomically(out / 'report.html', page.encode())


def write_summary(content: Content, out: Path) -> dict[str, bytes]:
    """
    Write summary.md, comparisons.csv and figures/*.png into `out`; return the pictures by name.

    Pictures of figures that the report has no longer are removed, so that `out` may be committed as
    it is. Each file is at most `LARGEST_BYTES`, or as small as the last of `DPI` makes it.
    """
    figures = out / 'figures'
    figures.mkdir(parents=True, exist_ok=True)
    images = {name: png(figure) for section in content.sections
              for name, figure in section.figures.items()}
    for name, image in images.items():
        write_atomically(figures / f'{name}.png', image)
    for path in [*figures.glob('*.png'), *figures.glob('*.pdf')]:
        if path.stem not in images:
            path.unlink()
    write_atomically(out / 'comparisons.csv',
                     comparisons_csv(content.tested).to_csv(index=False).encode())
    write_atomically(out / 'summary.md', summary(content).encode())
    return images


def png(figure: Figure) -> bytes:
    """Return a figure as PNG of 256 colours; the same figure gives the same bytes."""
    best = b''
    for dpi in DPI:
        drawn, packed = BytesIO(), BytesIO()
        with settings():
            figure.savefig(drawn, format='png', dpi=dpi, metadata={'Software': None})
        with Image.open(drawn) as picture:
            picture.convert('RGB').quantize(256, dither=Image.Dither.NONE).save(
                packed, format='PNG', optimize=True, dpi=(dpi, dpi))
        best = packed.getvalue()
        if len(best) <= LARGEST_BYTES:
            break
    return best


def pdf(figure: Figure) -> bytes:
    """Return a figure as PDF without a date: the same figure gives the same bytes."""
    buffer = BytesIO()
    with settings():
        figure.savefig(buffer, format='pdf', dpi=300, metadata={'CreationDate': None})
    return buffer.getvalue()


def _html_table(frame: pd.DataFrame) -> Markup:
    """Return a table's HTML; an index of words is shown, a plain numbering is not."""
    named = frame.index.dtype.kind not in 'iu'
    heads = ([''] if named else []) + list(map(str, frame.columns))
    rows = [([('th', str(name))] if named else []) + [('td', str(cell)) for cell in row]
            for name, row in zip(frame.index, frame.itertuples(index=False), strict=True)]
    lines = ['<table>', '<thead><tr>', *(f'<th>{escape(head)}</th>' for head in heads),
             '</tr></thead>', '<tbody>']
    for row in rows:
        # Of numbers, intervals and pairs nothing is wrapped: a half of one misleads.
        lines += ['<tr>', *(f'<{tag}{"" if re.search("[A-Za-z]{2}", cell) else NOWRAP}>'
                            f'{escape(cell)}</{tag}>' for tag, cell in row), '</tr>']
    return Markup('\n'.join([*lines, '</tbody>', '</table>']))


def _html_code(text: str) -> Markup:
    """Return text with what stands `between backticks` as code."""
    return Markup(re.sub('`([^`]+)`', r'<code>\1</code>', str(escape(text))))


def summary(content: Content) -> str:
    """Return the report's text and tables as Markdown, figures linked from `figures/`."""
    lines = [f'# {content.heading}', '']
    for paragraph in [*content.lead, *(f'**{line}**' for line in content.partial)]:
        lines += [paragraph, '']
    for name, caption in content.first:
        lines += [f'![{caption}](figures/{name}.png)', '', f'*{caption}*', '']
    shown = {name for name, _ in content.first}
    for heading, found in (('What replicates', content.findings),
                           ('Beyond the paper', content.beyond)):
        frame = pd.DataFrame([(one.claim, one.here, f'**{one.verdict}**') for one in found],
                             columns=['Claim', 'Here', 'Verdict'])
        lines += [f'## {heading}', '', markdown_table(frame), '']
    lines += ['Rules of the verdicts:', '', *(f'- {rule}' for rule in content.rules), '',
              '## What differs from the paper', '', *(f'- {line}' for line in content.differences)]
    for section in content.sections:
        lines += ['', f'## {section.heading}', '']
        lines += [f'{paragraph}\n' for paragraph in section.paragraphs]
        for name in (name for name in section.figures if name not in shown):
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
    return '\n'.join('| ' + ' | '.join(_escaped(cell) for cell in row) + ' |' for row in rows)


def _escaped(cell: str) -> str:
    # Stars of significance must not begin emphasis.
    return cell.replace('|', '\\|') if set(cell) - {'*'} else cell.replace('*', '\\*')
