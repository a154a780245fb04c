"""
A study's report: `python -m training report DIR`.

Writes DIR/report/report.html (one file, images inside), its figures as PNG and PDF, comparisons.csv
and summary.md. Everything in it follows from the store and the champions in DIR; numbers of the
paper stand beside ours, and each of its claims has a verdict. The same store gives the same report.
Of a study under way it reports what is there, and says, here and on the page, that it is partial.

`--publish docs/study` also writes what is worth committing there: summary.md, comparisons.csv, the
figures as PNG of at most 300 kB each, and results.parquet, every outcome in one table of at most 5
MB. `--table FILE` writes that table alone.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from training.report.about import equal_seeds
from training.report.content import gather
from training.report.pages import write_report, write_summary
from training.report.tidy import write_tidy
from training.study.directory import StudyDirectory, StudyError
from training.study.store import build_store, read_store


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument('study', type=Path, metavar='DIR', help='a study (see: study --help)')
    parser.add_argument('--out', type=Path, default=None, metavar='DIR',
                        help='where the report goes (default: DIR/report)')
    parser.add_argument('--publish', type=Path, default=None, metavar='DIR',
                        help='also write summary.md, comparisons.csv, small PNG figures and the '
                        'table of outcomes (Parquet) here, to be committed (ours: docs/study)')
    parser.add_argument('--equal-seeds', action='store_true',
                        help='leave out runs of seeds that are not complete in every cell')
    parser.add_argument('--table', type=Path, default=None, metavar='FILE',
                        help='write the table of outcomes (Parquet) here, and no report')


def main(args: argparse.Namespace) -> int:
    """Run the command; return the exit code."""
    study = StudyDirectory(args.study)
    out = args.out or study.path / 'report'
    try:
        about = study.about()
        build_store(study, history_points=about['config']['history_points'])
        store = read_store(study)
        if args.equal_seeds:
            store = equal_seeds(store, about)
        if args.table is not None:
            write_tidy(store, args.table)
            print(args.table)
            return 0
        content = gather(study, store, about)
        write_report(content, out)
        if args.publish is not None:
            write_summary(content, args.publish)
            write_tidy(store, args.publish / 'results.parquet')
    except (StudyError, OSError, ValueError) as error:
        print(f'report: {" ".join(str(error).split())}', file=sys.stderr)
        return 2
    for line in content.partial:
        print(f'report: {line}', file=sys.stderr)
    print(out / 'report.html')
    if args.publish is not None:
        print(args.publish / 'summary.md')
    return 0
