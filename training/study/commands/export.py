"""
Write a study's finished runs to one file: `python -m training study export DIR FILE`.

The file holds all that the report and a new scoring of champions need, champions included; 1,400
runs of 6,000 generations take less than 10 MB. It may be written while the study runs. `python -m
training study import FILE DIR` takes it up elsewhere.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from training.study.directory import StudyDirectory, StudyError
from training.study.record import RecordError
from training.study.transfer import export_study


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument('study', type=Path, metavar='DIR', help='a study, under way or finished')
    parser.add_argument('file', type=Path, metavar='FILE', help='the record, such as mine.zip')


def main(args: argparse.Namespace) -> int:
    """Run the command; return the exit code: 0, or 2 for an error."""
    try:
        runs, size = export_study(StudyDirectory(args.study), args.file)
    except (StudyError, RecordError, OSError, ValueError) as error:
        print(f'study export: {" ".join(str(error).split())}', file=sys.stderr)
        return 2
    print(f'{runs} runs, {size / 1e6:.2f} MB: {args.file}')
    return 0
